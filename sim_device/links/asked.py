# A question to the core: what makes its frame, which answer fits, and the answer once it is there.

from protocol import schema
from protocol.messages import BY_NAME

_ERROR = BY_NAME["ERROR"]
_STEP_MASK = (1 << 30) - 1
_LATE_STEPS = 64


def overtaken(error, step):
    """Whether this was said of an old copy of a STEP: the core was before the present one then, or has just taken it."""
    return error.code == schema.ERROR_STEP_ORDER and step + 1 - error.detail & _STEP_MASK <= _LATE_STEPS


# `make(seq)` gives the frame; `answer` is set by whoever received it, if takes() allows it.
class Asked:
    def __init__(self, name, make, kind, fits, step=None):
        self.name = name
        self.make = make
        self.kind = kind
        self.fits = fits
        self.step = step
        self.answer = None

    def takes(self, message):
        """Whether this can be its answer. That it was asked out of turn cannot be, if it is what the core expects."""
        if type(message) is _ERROR:
            return message.message_id == BY_NAME[self.name].ID and not (
                message.code == schema.ERROR_STEP_ORDER and message.detail == self.step)
        return type(message) is self.kind and self.fits(message)
