"""Questions to a running core, each with one answer: handshake, parameters, stores.

Contract: `ask` repeats an unanswered question every 200 ms and gives up after 3 s
with a CoreError that names what was waited for. Frames that answer nothing
asked (telemetry) are read and dropped.
"""

import sys
import time

from host_tools.core_process import CoreError
from host_tools.terminal_port import PortError
from protocol.dialect import SchemaError
from protocol.host_link import HostLink
from protocol.messages import BY_NAME
from protocol.schema_pull import SchemaPull

IDENTIFY = BY_NAME["IDENTIFY"]
REPEAT_S = 0.2
DEAD_S = 3.0
BOOT_S = 15.0       # a small board loads 53 files; a VM starts on a loaded machine


class CoreSession:
    def __init__(self, port):
        self.port = port
        self.link = HostLink()
        self.hello = None

    def handshake(self):
        """Wait for HELLO (asking for it, as a core that was welcomed before says it no more), then WELCOME it."""
        self.hello = self.ask(IDENTIFY(section=0, offset=0), "HELLO", patience_s=BOOT_S)
        refusal = self.link.refusal(self.hello)
        if refusal:
            raise CoreError("On %s %s." % (self.port.path, refusal))
        self._write(self.link.welcome(self.hello))
        self._acquaint()
        return self.hello

    def _acquaint(self):
        """A core of another schema is asked for it, and spoken to by it."""
        try:
            if not self.link.meet(self.hello):
                pull = SchemaPull(self.hello)
                while not pull.whole:
                    pull.take(self.ask(pull.question(), "IDENTITY", pull.fits))
                self.link.adopt(pull.dialect())
        except SchemaError as error:
            raise CoreError("On %s %s." % (self.port.path, error)) from None
        if self.link.translation is not None:
            print("On %s %s." % (self.port.path, self.link.translation.summary()), file=sys.stderr, flush=True)

    def encode(self, message, seq=None):
        """As HostLink's; what this core cannot be told is a CoreError."""
        try:
            return self.link.encode(message, seq)
        except SchemaError as error:
            raise CoreError("On %s %s." % (self.port.path, error)) from None

    def ask(self, request, answer, fits=lambda message: True, patience_s=DEAD_S):
        """The first `answer` for which fits(message) holds; None if the core answers ERROR to this request."""
        flaw = self.link.flaw((answer,))
        if flaw:
            raise CoreError("On %s %s." % (self.port.path, flaw))
        wire = self.encode(request)
        end = time.monotonic() + patience_s
        while time.monotonic() < end:
            self._write(wire)
            again = time.monotonic() + REPEAT_S
            while time.monotonic() < again:
                for message in self._read():
                    if message.NAME == answer and fits(message):
                        return message
                    if message.NAME == "ERROR" and message.message_id == request.ID:
                        return None
        counts = self.link.counts()
        came = "%d good frames and %d bytes" % (counts["frames_in"], counts["bytes_in"]) if counts["bytes_in"] else "nothing"
        raise CoreError("Waited %g s for %s on %s in vain (%s came): is a core running there, and nothing else reading "
                        "the port?" % (patience_s, answer, self.port.path, came))

    def _read(self):
        return [message for message, _, _, _ in self._take()]

    def _take(self):
        """The messages that came, with their headers."""
        try:
            return self.link.take(self.port.read(0.02))
        except PortError as error:
            raise CoreError(str(error)) from None

    def _write(self, data):
        try:
            self.port.write(data)
        except PortError as error:
            raise CoreError(str(error)) from None
