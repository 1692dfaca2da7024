# A bus of this machine, the kernel's CAN or CAN over UDP, as one more controller of the hub's: so a core that speaks
# SLCAN is on that bus, too.

from collections import deque

import can

from sim_device.links.can_adapter import open_bus
from sim_device.links.can_frame import KINDS, LENGTHS, parse

BURST = 256     # frames taken at once
ECHOES = 256


# As SlcanAdapter towards the hub. What that bus does not take is lost, and counted in `dropped`.
class CanUplink:
    def __init__(self, name, bus):
        kind, _, channel = name.partition(":")
        self.present = True
        self.dropped = 0
        self._can = open_bus(kind, channel)
        self._bus = bus
        self._frames = []
        self._own = deque(maxlen=ECHOES)    # lines that we sent, where that bus lets us hear ourselves
        self._echoes = kind == "udp"
        self.controller = bus.attach(name)
        self.controller.open = True

    @property
    def waiting(self):
        return bool(self._frames)

    def fileno(self):
        return self._can.fileno()

    def receive(self):
        for _ in range(BURST):
            try:
                message = self._can.recv(0)
                if message is None:
                    break
                line = line_of(message)
            except (can.CanError, ValueError, IndexError):
                continue    # no CAN frame: anybody may send to a multicast group
            frame = parse(line)
            if frame is not None and not message.is_error_frame and not self._is_echo(line):
                self._frames.append(frame)
        return True

    def _is_echo(self, line):
        if line not in self._own:
            return False
        while self._own.popleft() != line:
            pass    # those before it were lost on the way
        return True

    def act(self, now_s, patient):
        taken = 0
        for frame in self._frames:
            if patient and len(self.controller.queue) >= self.controller.queue_max:
                break
            self._bus.offer(self.controller, frame, now_s)
            taken += 1
        del self._frames[:taken]
        return taken

    def deliver(self, frame):
        message = message_of(frame)
        try:
            self._can.send(message, timeout=0.1)
        except can.CanError:
            self.dropped += 1
            return
        if self._echoes:
            self._own.append(line_of(message))

    def flush(self):
        pass

    def close(self):
        self._can.shutdown()


def line_of(message):
    """The message as SLCAN's text has it."""
    letter = "r" if message.is_remote_frame else "b" if message.bitrate_switch else "d" if message.is_fd else "t"
    head = "%s%08X" % (letter.upper(), message.arbitration_id) if message.is_extended_id else "%s%03X" % (letter, message.arbitration_id)
    return ("%s%X%s" % (head, LENGTHS.index(message.dlc), message.data.hex().upper())).encode()


def message_of(frame):
    extended, fd, fast, remote = KINDS[frame.line[:1]]
    at = 9 if extended else 4
    data = bytes.fromhex(frame.line[at + 1:].decode())
    return can.Message(arbitration_id=int(frame.line[1:at], 16), is_extended_id=bool(extended), is_fd=bool(fd), bitrate_switch=bool(fast),
                       is_remote_frame=bool(remote), dlc=LENGTHS[int(frame.line[at:at + 1], 16)], data=None if remote else data)
