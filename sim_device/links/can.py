# The virtual robot's end of a CAN bus, by python-can (can_adapter.py). Between CAN frames and ours stand
# protocol/can_cutter.py and can_joiner.py.

import contextlib
import time

import can
import serial

from protocol import dbc
from protocol.can_cutter import CanCutter
from protocol.can_joiner import FRAME_MAX, CanJoiner
from sim_device.links.can_adapter import WAIT_S, Adapter, open_bus
from sim_device.links.peer_errors import PeerError
from sim_device.links.pty import LinkError

BURST = 1000    # frames of others that one read() passes over
FAULT_S = 1.0   # for the answer of a bus that is to be made worse
DOWN, UP = 0, 1


# Stands in for a Pty towards Peer: read() gives whole frames, write() takes one. Nobody's absence is seen on a bus, so
# read() is never None. What comes off the bus never raises; an adapter that goes is a PeerError.
class CanLink:
    resetting = False   # as a Pty's
    clock = staticmethod(time.monotonic)

    def __init__(self, name, wait_s=WAIT_S):
        kind, _, channel = name.partition(":")
        self.path = self.name = name
        self.dropped = 0
        self.fd = kind == "slcan-fd"
        self._bus = open_bus(kind, channel, wait_s)
        self._cutter = CanCutter(DOWN, self.fd)
        # No CAN frame: noise on an adapter's line, or what anybody sends to a multicast group.
        self._noise = (ValueError, IndexError, *[can.CanOperationError] * (kind == "udp"))
        self._joiner = CanJoiner(bytearray(FRAME_MAX), UP)

    def read(self, timeout_ms=0):
        """The next frame, waiting for it up to the timeout; b"" if none came."""
        end_s = time.monotonic() + timeout_ms / 1000
        joiner = self._joiner
        for _ in range(BURST):
            try:
                message = self._bus.recv(max(0.0, end_s - time.monotonic()))
            except self._noise:
                continue
            except (can.CanError, serial.SerialException, OSError) as error:
                raise PeerError("the CAN bus %s was closed while in use (%s): start all again" % (self.name, error)) from None
            if message is None:
                return b""
            if message.is_extended_id or message.is_remote_frame or message.is_error_frame:
                continue    # others' business
            size = joiner.join(message.arbitration_id, message.data, len(message.data))
            if size:
                return bytes(joiner.frame[:size])
        return b""

    def write(self, data):
        cutter, frames = self._cutter, []
        cutter.begin(data, len(data))
        while cutter.next():
            frames.append(can.Message(arbitration_id=cutter.can_id, is_extended_id=False, is_fd=self.fd, bitrate_switch=self.fd,
                                      data=cutter.data[:cutter.size]))
        try:
            with getattr(self._bus, "together", contextlib.nullcontext)():
                for frame in frames:
                    self._bus.send(frame, timeout=1.0)
        except (can.CanError, serial.SerialException, OSError) as error:
            if isinstance(error, can.CanOperationError) and isinstance(self._bus, Adapter):
                raise PeerError("the CAN bus %s takes no more frames (%s): start all again" % (self.name, error)) from None
            self.dropped += 1   # the kernel's queue is full: asked again by and by
            return False
        return True

    def speaks(self, dialect):
        """The core's schema, by which its telemetry is laid out."""
        with contextlib.suppress(dbc.DbcError):     # one that has no such layout tells none as single frames
            self._joiner.speaks(*dbc.tables(dialect.messages))

    def worsen(self, faults):
        """Asks the bus for these faults, [(name, number)]: only one of can_hub's can. LinkError otherwise."""
        for name, value in faults:
            done = False
            with contextlib.suppress(can.CanError, serial.SerialException, OSError):
                done = isinstance(self._bus, Adapter) and self._bus.told("!%s=%.6f" % (name, value), FAULT_S)
            if not done:
                raise LinkError("the CAN bus %s brings no faults about, as only one of sim_device.can_hub does; leave loss, full, busy and "
                                "busoff out of --faults, or use hil --link slcan" % self.name)

    def happens(self, kind, seconds):
        """An event of --faults, now."""
        with contextlib.suppress(can.CanError, serial.SerialException, OSError):    # that it is gone, the next frame tells
            self._bus.tell("!%s=%.6f" % ("jam" if kind == "full" else kind, seconds or 0))

    def flush(self):
        return True

    def close(self):
        with contextlib.suppress(can.CanError, serial.SerialException, OSError):
            self._bus.shutdown()
