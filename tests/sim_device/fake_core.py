# A driver for the tests of the session: it speaks the protocol through the core's own Link, but has no map to build.
# It drives slowly round and says DONE after a number of steps. Its faults are chosen by arguments.
#
#   python tests/sim_device/fake_core.py PATH [--steps N] [--fault NAME] [--at STEP]

import argparse
import os
import select
import sys
import time
import tty
import zlib

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))

from protocol import parameters, schema, states  # noqa: E402
from protocol.link import Link  # noqa: E402
from protocol.messages import BY_NAME  # noqa: E402

INFRARED = 1 << states.DEGRADED.index("infrared")
ID = {name: message.ID for name, message in BY_NAME.items()}
MAP = bytes(range(256)) * 3
MAP += zlib.crc32(MAP).to_bytes(4, "little")  # as the map's own layout ends


class FakeCore:
    def __init__(self, fd, options):
        self.fd = fd
        self.options = options
        self.link = Link(boot_id=options.boot_id)
        self.parameters = {}
        self.last_step = 0
        self.executed = self.pings = 0
        self.seen = {}

    def send(self, name, *values, items=0):
        for i, value in enumerate(values):
            self.link.out[i] = value
        assert self.link.send(ID[name], items), name
        self.flush()

    def flush(self):
        os.write(self.fd, bytes(self.link.tx[:self.link.tx_len]))

    def hello(self):
        self.link.send_hello(1, 2, 0, 0, len(parameters.PARAMETERS), 196608, 60000, 40000)
        if self.options.fault == "old_schema":
            self.link.out[2] ^= 1
            self.link.send(ID["HELLO"])
        self.flush()

    def run(self):
        poll = select.poll()
        poll.register(self.fd, select.POLLIN)
        hello_s = 0.0
        while True:
            if self.options.fault == "silence":
                time.sleep(0.1)
                continue
            if self.options.fault == "garbage":
                os.write(self.fd, os.urandom(64))
                time.sleep(0.01)
                continue
            if self.link.epoch == 0 and time.monotonic() > hello_s:
                hello_s = time.monotonic() + 0.2
                self.hello()
            if not poll.poll(50):
                continue
            data = bytearray(os.read(self.fd, 4096))
            if not data:
                return
            at = 0
            while at < len(data):
                at = self.link.feed(data, at, len(data))
                if self.link.message_id:
                    self.answer(self.link.message_id, self.link.values)
                elif self.link.tx_len:
                    self.flush()

    def answer(self, message_id, values):
        name = next(name for name, known in ID.items() if known == message_id)
        getattr(self, "on_" + name.lower(), self.on_other)(values)

    def on_other(self, values):
        pass

    def on_identify(self, values):
        if values[0] == 3:
            return self.send("LINK", *list(self.link.counters)[:13])
        if values[0] == 4:
            return self.send("IDENTITY", 4, values[1], 0, 0)    # it does not tell its schema
        self.hello()

    def on_ping(self, v):
        self.pings += 1
        if self.options.fault == "restarts_when_pinged" and self.pings in (5, 10):
            self.options.boot_id += 1
            self.link = Link(boot_id=self.options.boot_id)
            return self.hello()
        self.send("PONG", v[0], int(time.monotonic() * 1000) & 0x3FFFFFF)

    def on_param_set(self, v):
        row = parameters.PARAMETERS[v[0]]
        status = schema.PARAM_OK if row[3] <= v[2] <= row[4] else schema.PARAM_OUT_OF_RANGE
        if self.options.fault == "refuses" and row[0] == "track":
            status = schema.PARAM_OUT_OF_RANGE
        if self.options.fault == "loses" and self.seen.setdefault((v[0], v[1]), 0) == 0 and row[0] in ("track", "dock_x"):
            self.seen[v[0], v[1]] = 1
            self.flush = lambda: None
            self.on_param_set(v)
            del self.flush
            return
        if status == schema.PARAM_OK:
            self.parameters[v[0], v[1]] = v[2]
        self.send("PARAM_VALUE", v[0], v[1], status, self.parameters.get((v[0], v[1]), 0))

    def on_step(self, v):
        step, fault = v[0], self.options.fault if v[0] == self.options.at else None
        if fault == "closes":
            sys.exit(0)
        if fault == "deaf":
            time.sleep(60)
        if fault == "restarts":
            self.options.at = None
            self.link, self.last_step = Link(boot_id=self.options.boot_id + 1), step - 1
            return self.hello()
        self.execute(step)
        if fault != "loses":
            self.flush()  # else executed, but the answer is lost: the host asks again, and the link has it retained
        if step % 5 == 0:
            self.tell(step)

    def execute(self, step):
        assert step == self.last_step + 1, (step, self.last_step)
        self.last_step = step
        self.executed += 1
        done = step >= self.options.steps
        state = states.FOLLOW if not done else states.FAILED if self.options.fault == "fails" else states.DONE
        if self.options.fault == "odd_state" and not done:
            state = 200
        for i, value in enumerate((step, 60, 80, state, 0, step & 0xFFFF)):
            self.link.out[i] = value
        self.link.send(ID["STEP_RSP"])

    def tell(self, step):
        self.send("POSE", step, step * 100, 0, 0, 0, 0, 0, states.FOLLOW, 0, step, 3, 7, 1, 0)
        self.send("VECTOR", step % 40, 0, 0, step % 100, 2, 3, 4, 5)

    def on_status(self, v):
        done = self.last_step >= self.options.steps and self.options.fault != "fails"
        if self.options.fault == "deaf_at_end":
            time.sleep(60)
        if self.options.fault == "builds":
            return self.status(states.BUILD, 1, states.REASON_CLOSED, 0)
        reason = states.REASON_CLOSED if done else states.REASON_STUCK if self.options.fault == "fails" else states.REASON_NONE
        degraded = INFRARED if self.options.fault == "ill" and self.last_step >= self.options.at else 0
        self.status(states.DONE if done else states.FOLLOW, int(done), reason, degraded)

    def status(self, *ended):
        self.send("STATUS_RSP", self.last_step, *ended, self.executed & 0xFFFF, 0, 0, 0, 30, 10, 0, 1234, 196608, 60000, 1, 0, 0, 0)

    def on_nvm_done(self, v):
        self.send("NVM", 0, schema.NVM_NOTHING, 0, 0, 0, 0)

    def on_map_info(self, v):
        if self.options.fault == "no_map":
            return self.send("ERROR", schema.ERROR_NOT_READY, ID["MAP_INFO"], 0)
        crc = zlib.crc32(MAP[:-4]) ^ (self.options.fault == "bad_map")
        self.send("MAP_INFO_RSP", 1, len(MAP), crc & 0xFFFF, crc >> 16)

    def on_map_read(self, v):
        part = MAP[v[1]:v[1] + 88]
        self.send("MAP_DATA", v[0], v[1], len(part), *part, items=len(part))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("path")
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--fault")
    parser.add_argument("--at", type=int, default=100)
    parser.add_argument("--boot-id", type=int, default=77)
    options = parser.parse_args()
    while not os.path.exists(options.path):
        time.sleep(0.02)
    fd = os.open(options.path, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(fd)
    try:
        FakeCore(fd, options).run()
    except OSError:
        pass  # the link was taken away


if __name__ == "__main__":
    main()
