# What a core speaks is found out, before anything is asked of it in its words: its schema is known here, or it is asked for it.

from protocol.dialect import SchemaError
from protocol.messages import BY_NAME
from protocol.schema_pull import SchemaPull
from sim_device.links.peer_errors import PeerError

# Without these there is no mission. All other messages may be missing, or say less.
NEEDED = ("STEP", "STEP_RSP", "STATUS", "STATUS_RSP", "POSE", "MAP_INFO", "MAP_INFO_RSP", "MAP_READ", "MAP_DATA", "PARAM_SET",
          "PARAM_VALUE", "ERROR")
_IDENTITY = BY_NAME["IDENTITY"]


# Link, tap and log are told what the core speaks whose frames they get. A core that comes back with another schema is none of this mission.
class Acquaintance:
    def __init__(self, pty, taps, log):
        self._pty, self._taps, self._log = pty, taps, log
        self._dialect = None

    def make(self, peer, hello):
        """From here on the peer's link speaks as the core that said this. PeerError where the two have too little in common."""
        link = peer.link
        try:
            if not link.meet(hello):
                pull = SchemaPull(hello)
                while not pull.whole:
                    pull.take(peer.ask(pull.question(), _IDENTITY, pull.fits))
                link.adopt(pull.dialect())
        except SchemaError as error:
            raise PeerError("%s: %s" % (peer.path, error)) from None
        flaw = link.flaw(NEEDED)
        if flaw:
            raise PeerError("%s: %s" % (peer.path, flaw))
        if self._dialect not in (None, link.dialect):
            raise PeerError("the core on %s has come back with another schema: start the mission again" % peer.path)
        peer.keep()
        self._pty.speaks(link.dialect)
        self._taps.speaks(link.dialect)
        if self._log is not None and self._dialect is None and link.translation is not None:
            self._log.speaks(link.dialect)
        self._dialect = link.dialect
