# `python -m sim_device.can_hub PATH PATH ...`: a CAN bus on this machine, without the kernel's. Each PATH becomes a pty
# with an SLCAN adapter behind it, as /dev/ttyACM0 has one for a CANable: for the core, for the virtual robot, for
# anything else that speaks SLCAN, as cantools' monitor.

import argparse
import contextlib
import json
import os
import select
import signal
import sys
import time

from protocol.can_cutter import NODE, START, STEP_PRIORITY
from sim_device.links.can_bus import CanBus
from sim_device.links.pty import LinkError
from sim_device.links.slcan_adapter import SlcanAdapter
from sim_device.links.trace import GrowingFile, TraceError

ABSENT_MS = 20      # how often we look who has come
EXIT_BAD_INPUT, EXIT_INCOMPLETE = 2, 3
SPIN_S = 0.0003     # in lockstep the next frame is nearer than being woken takes; see links/pty.py
SLEEPS = 50
STEP_ID = b"%03X" % (STEP_PRIORITY | NODE << 6 | 1)     # of a STEP's CAN frames


# Owns the adapters. turn() waits for text on any of them and carries what comes of it over the bus; run() does so until
# stop() is true. `candump`, a GrowingFile, gets every frame. `step_s_max`: for how long the busiest step would keep the bus,
# from its STEP to the next.
class CanHub:
    def __init__(self, paths, bus=None, candump=None, uplink=None):
        self.bus = bus or CanBus()
        self.adapters = []
        self._by_fd = {}
        self._here = {}
        self._poll = select.poll()
        self._candump = candump
        self._patience = 0
        with contextlib.ExitStack() as undo:
            for path in paths:
                self._add(SlcanAdapter(path, self.bus), undo)
            if uplink:
                from sim_device.links.can_uplink import CanUplink  # here: python-can takes a tenth of a second
                self._add(CanUplink(uplink, self.bus), undo)
            self._undo = undo.pop_all()
        self._by_controller = {adapter.controller: adapter for adapter in self.adapters}
        self._looked_s = 0.0
        self.step_s_max = 0.0
        self._begun_s = None

    def _add(self, adapter, undo):
        undo.callback(adapter.close)
        self.adapters.append(adapter)
        self._by_fd[adapter.fileno()] = adapter
        self._here[adapter] = False

    def run(self, stop=lambda: False):
        while not stop():
            self.turn()

    def turn(self):
        self._look_who_is_there()
        for fd, events in self._wait():
            adapter = self._by_fd[fd]
            if not adapter.receive() or events & ~(select.POLLIN | select.POLLHUP):
                self._poll.unregister(fd)
                self._here[adapter] = False
        self._carry(time.monotonic())

    def _carry(self, now_s):
        # A queue that is full while the bus is moving makes its sender wait, as USB does; on a bus that stands still it is full.
        patient = True
        while True:
            taken = sum([adapter.act(now_s, patient) for adapter in self.adapters if adapter.waiting])
            carried = 0
            while (passed := self.bus.transmit(now_s)) is not None:
                frame, _, receivers = passed
                if frame.line[1:4] == STEP_ID:
                    self._step(frame)
                for controller in receivers:
                    self._by_controller[controller].deliver(frame)
                if self._candump is not None:
                    self._candump.add(b"(%.6f) can0 %s\n" % (time.time(), frame.candump().encode()))
                carried += 1
            if not any([adapter.waiting for adapter in self.adapters]):
                break
            patient = bool(taken or carried)
        for adapter in self.adapters:
            adapter.flush()

    def _step(self, frame):
        if len(frame.line) > 5 and int(frame.line[-2:], 16) & START:
            now_s = self.bus.busy_s - frame.bus_s
            if self._begun_s is not None:
                self.step_s_max = max(self.step_s_max, now_s - self._begun_s)
            self._begun_s = now_s

    def _look_who_is_there(self):
        now_s = time.monotonic()
        if now_s - self._looked_s < ABSENT_MS / 1000:
            return
        self._looked_s = now_s
        for adapter, here in self._here.items():
            if not here and adapter.present:
                self._here[adapter] = True
                self._poll.register(adapter.fileno(), select.POLLIN)

    def _wait(self):
        poll = self._poll.poll
        if self._patience < 0:
            self._patience += 1
            return poll(ABSENT_MS)
        end_s = time.perf_counter() + SPIN_S
        while not (events := poll(0)):
            if time.perf_counter() > end_s:
                self._patience = -SLEEPS
                return poll(ABSENT_MS)
            os.sched_yield()
        return events

    def figures(self):
        return {**self.bus.figures(), "step_s_max": round(self.step_s_max, 6), "dropped": sum(adapter.dropped for adapter in self.adapters)}

    def close(self):
        self._undo.close()


def main(argv=None):
    parser = argparse.ArgumentParser(prog="python -m sim_device.can_hub", allow_abbrev=False,
                                     description="A CAN bus of 500 kbit/s with an SLCAN adapter on each PATH.")
    parser.add_argument("paths", metavar="PATH", nargs="+", help="the name to give an adapter's pty")
    parser.add_argument("--candump", metavar="FILE", help="keep every frame, as `candump -L` does")
    parser.add_argument("--uplink", metavar="BUS", help="join the bus to this one: socketcan:NAME or udp")
    options = parser.parse_args(argv)
    asked, candump = [], None
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda number, _: asked.append(number))
    try:
        with contextlib.ExitStack() as stack:
            if len(set(map(os.path.abspath, options.paths))) < len(options.paths):
                raise LinkError("two of the adapters have one name: give another")
            candump = stack.enter_context(contextlib.closing(GrowingFile(options.candump))) if options.candump else None
            hub = CanHub(options.paths, candump=candump, uplink=options.uplink)
            stack.callback(hub.close)
            hub.run(lambda: bool(asked))
    except (LinkError, TraceError) as error:
        print("can_hub: %s" % error, file=sys.stderr)
        return EXIT_BAD_INPUT
    incomplete = candump.failure if candump else ""     # a full disk stops no bus
    print(json.dumps({"event": "bus", **hub.figures(), "incomplete": incomplete}), flush=True)
    if incomplete:
        print("can_hub: %s" % incomplete, file=sys.stderr)
    return EXIT_INCOMPLETE if incomplete else 0


if __name__ == "__main__":
    sys.exit(main())
