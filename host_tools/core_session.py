"""Questions to a running core, each with one answer: handshake, parameters, stores.

Contract: `ask` repeats an unanswered question every 200 ms and gives up after 3 s
with a CoreError that names what was waited for. Frames that answer nothing
asked (telemetry) are read and dropped.
"""

import time

from host_tools.core_process import CoreError
from host_tools.message_fields import IDS, hash_text
from host_tools.tap_frames import TapFrames
from host_tools.terminal_port import PortError
from protocol import schema, schema_hash

REPEAT_S = 0.2
DEAD_S = 3.0
BOOT_S = 10.0       # a VM start on a loaded machine


class CoreSession:
    def __init__(self, port):
        self.port = port
        self.frames = TapFrames()
        self.hello = None

    def handshake(self):
        """Wait for HELLO (asking for it, as a core that was welcomed before says it no more), then WELCOME it."""
        self.hello = self.ask("IDENTIFY", {"section": 0, "offset": 0}, "HELLO", lambda fields: True, BOOT_S)
        ours = schema_hash.halves()
        theirs = self.hello["schema_lo"], self.hello["schema_hi"]
        if ours != theirs:
            raise CoreError("The core speaks schema %s (protocol %d to %d) and these tools %s (protocol %d): install the same "
                            "version of both." % (hash_text(*theirs), self.hello["protocol_min"],
                                                  self.hello["protocol_max"], hash_text(*ours), schema.VERSION))
        self.frames.epoch = 1
        self._send("WELCOME", {"epoch": 1, "boot_id": self.hello["boot_id"], "schema_lo": ours[0], "schema_hi": ours[1]})
        return self.hello

    def ask(self, request, fields, answer, fits, patience_s=DEAD_S):
        """The first `answer` for which fits(fields) holds; None if the core answers ERROR to this request."""
        got = []

        def take(name, taken):
            if name == answer and fits(taken):
                got.append(taken)
            elif name == "ERROR" and taken["message_id"] == IDS[request]:
                got.append(None)

        end = time.monotonic() + patience_s
        try:
            while time.monotonic() < end:
                self._send(request, fields)
                again = time.monotonic() + REPEAT_S
                while not got and time.monotonic() < again:
                    self.frames.feed(self.port.read(0.02), take)
                if got:
                    return got[0]
        except PortError as error:
            raise CoreError(str(error)) from None
        heard = "%d good frames and %d bytes" % (self.frames.good, self.frames.bytes)
        raise CoreError("Waited %g s for %s on %s in vain (%s came): is a core running there, and nothing else reading the port?" % (
            patience_s, answer, self.port.path, heard if self.frames.bytes else "nothing"))

    def _send(self, name, fields):
        self.port.write(self.frames.encode(name, fields))
