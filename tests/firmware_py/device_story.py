# A device with a port in memory and a host beside it: what is asked, what comes back.

from firmware_py.device import Device
from protocol import schema
from protocol.host_link import HostLink
from protocol.messages import BY_NAME

NOTHING_NEAR = (20,) * 8


class MemoryPort:
    heap_bytes, heap_code_bytes, heap_boot_bytes, locked = 196608, 40000, 60000, 1

    def __init__(self):
        self.out = bytearray()
        self.used = 60000
        self.ms = 1000

    def write(self, buf, size):
        self.out += bytes(buf[:size])

    def heap_used(self):
        return self.used

    def ticks_ms(self):
        return self.ms & 0x3FFFFFF

    def wait(self, ms):
        assert ms > 0
        self.ms += max(ms - 1, 1)  # a little less, as every port


class Story:
    """joined: HELLO was said and answered. ask(): the messages that come back, telemetry left out."""

    def __init__(self, joined=True, boot_id=77):
        self.port = MemoryPort()
        self.device = Device(self.port, boot_id)
        self.core = self.device.core
        self.host = HostLink()
        self.telemetry = []
        if joined:
            self.join()

    def join(self):
        self.device.hello()
        (hello,) = self.heard()
        self.give(self.host.welcome(hello))
        return hello

    def heard(self):
        data, self.port.out = bytes(self.port.out), bytearray()
        messages = self.host.feed(data)
        self.telemetry += [m for m in messages if 0x20 <= m.ID < 0x30]
        return [m for m in messages if not 0x20 <= m.ID < 0x30]

    def give(self, data):
        self.device.receive(bytearray(data), len(data))

    def ask(self, name, *fields):
        self.give(self.host.encode(BY_NAME[name](*fields)))
        return self.heard()

    def step(self, number, left=0, right=0, ir=NOTHING_NEAR, bump=0):
        return self.ask("STEP", number, left, right, ir, 0, bump, ())

    def one(self, name, *fields):
        (answer,) = self.ask(name, *fields)
        return answer

    def map(self):
        """The map as the host pulls it."""
        info = self.one("MAP_INFO", 0)
        data = bytearray()
        while len(data) < info.size:
            piece = self.one("MAP_READ", info.generation, len(data))
            assert type(piece).__name__ == "MAP_DATA" and piece.offset == len(data), piece
            data += piece.data
        return info, bytes(data)


def error(code, message, detail):
    return BY_NAME["ERROR"](code, BY_NAME[message].ID, detail)


UNKNOWN, OUT_OF_RANGE, LOCKED, OK = schema.PARAM_UNKNOWN, schema.PARAM_OUT_OF_RANGE, schema.PARAM_LOCKED, schema.PARAM_OK
