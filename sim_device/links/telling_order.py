# The order in which the core told what was not asked reliably: of each kind the newest wins.

LATE = 64               # frames: what seems to be further behind is ahead


# All kinds share one SEQ of eight bits, so by the newest of any kind each frame gets a number that does not go round: a kind may
# come as seldom as it likes.
class TellingOrder:
    def __init__(self):
        self.restart()

    def restart(self):
        """A new epoch: SEQ begins at 1."""
        self._newest = 0
        self._told = {}         # number of the newest of each kind

    def takes(self, kind, seq):
        """False for what was overtaken by its own kind, or came twice."""
        number = self._newest - LATE + (seq - self._newest + LATE & 255)
        self._newest = max(self._newest, number)
        if number <= self._told.get(kind, number - 1):
            return False
        self._told[kind] = number
        return True
