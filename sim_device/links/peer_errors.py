# What may be wrong with the core at the far end, each as one sentence.

from protocol import parameters, schema
from protocol.frame_reader import BYTES_IN, FRAMES_IN
from protocol.messages import BY_ID, BY_NAME

GARBAGE_BYTES = 512
GARBAGE_S = 3.0

_STEP = BY_NAME["STEP"]
_PARAMETER_NAMES = [row[0] for row in parameters.PARAMETERS]


class PeerError(Exception):
    """One sentence: what was waited for, and what came instead."""


class Refused(PeerError):
    """The core answered ERROR; `code` is its number."""

    def __init__(self, sentence, code):
        super().__init__(sentence)
        self.code = code


class Restarted(Exception):
    """The core has started anew and said this `hello`."""

    def __init__(self, hello):
        super().__init__()
        self.hello = hello


class Interrupted(Exception):
    """The caller's stop() became true while we waited."""


def refused(path, error):
    """The Refused that says what this ERROR means."""
    why = {
        schema.ERROR_UNKNOWN_ID: "it does not know this message",
        schema.ERROR_STEP_ORDER: "it expects step %d" % error.detail,
        schema.ERROR_RANGE: "a value is out of range",
        schema.ERROR_STALE: "its map is of generation %d now" % error.detail,
        schema.ERROR_NOT_READY: "it is not ready for that",
    }.get(error.code, "error %d" % error.code)
    if error.code == schema.ERROR_NOT_READY and error.message_id == _STEP.ID and 0 <= error.detail < len(_PARAMETER_NAMES):
        why = "it needs parameter %s first" % _PARAMETER_NAMES[error.detail]
    return Refused("the core on %s refused %s: %s" % (path, BY_ID[error.message_id].NAME, why), error.code)


def silent(path, what, dead_s):
    return PeerError("the core on %s has not answered %s for %g s" % (path, what, dead_s))


def is_garbage(counters, since_s):
    return since_s > GARBAGE_S and counters[BYTES_IN] > GARBAGE_BYTES and counters[FRAMES_IN] == 0


def nobody(path, counters, waited_s):
    """Why there is no core, after so long."""
    waited_s = round(waited_s, 1)
    if counters[FRAMES_IN]:
        return "frames arrive on %s, but no HELLO within %g s: is another program than the core at its far end?" % (path, waited_s)
    if counters[BYTES_IN]:
        return "bytes arrive on %s (%d of them), but no frame of this protocol within %g s: something else than the core is there" % (
            path, counters[BYTES_IN], waited_s)
    return "nobody answered on %s within %g s: start the core on it" % (path, waited_s)
