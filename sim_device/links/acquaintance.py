# What a core speaks is found out, before anything is asked of it in its words: its schema is known here, or it is asked for it.

from protocol.dialect import SchemaError
from protocol.messages import BY_NAME
from protocol.schema_pull import SchemaPull
from sim_device.links.peer_errors import PeerError

# Without these there is no mission. All other messages may be missing, or say less.
NEEDED = ("STEP", "STEP_RSP", "STATUS", "STATUS_RSP", "POSE", "MAP_INFO", "MAP_INFO_RSP", "MAP_READ", "MAP_DATA", "PARAM_SET", "PARAM_VALUE",
          "ERROR")
_IDENTITY = BY_NAME["IDENTITY"]


def acquaint(peer, hello):
    """The Dialect of the core that said this, which the peer's link speaks from now on. PeerError where the two have too little in common."""
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
    return link.dialect
