# How long to wait for an answer before asking again: Jacobson's estimate in integers of microseconds.
# Host only: the core never waits for anything (link.py).

RTO_FIRST_US = 100_000      # nothing is known yet
RTO_MIN_US = 3_000
RTO_MAX_US = 1_000_000
BACKOFF_MAX_US = 50_000     # repeats do not lie further apart, unless the line itself is that slow
AMBIGUOUS_MAX = 8


# add() takes each answer's time; timeout_us(tries) is the wait after that many repeats.
#
# Karn: the answer to a question that was sent twice says nothing, as nobody knows to which one it is. But where
# a line has become slower than the estimate, every question is sent twice: of eight in a row the quickest counts, from its
# first sending. One alone may have been lost, and its time would be our own waiting.
class RoundTrip:
    def __init__(self):
        self.smooth_us = None
        self.spread_us = 0
        self._ambiguous = []

    def add(self, way_us, tries):
        if tries:
            self._ambiguous.append(way_us)
            if len(self._ambiguous) < AMBIGUOUS_MAX:
                return
            way_us = min(self._ambiguous)
        self._ambiguous.clear()
        if self.smooth_us is None:
            self.smooth_us, self.spread_us = way_us, way_us >> 1
            return
        error_us = way_us - self.smooth_us
        self.smooth_us += error_us >> 3
        self.spread_us += abs(error_us) - self.spread_us >> 2

    def timeout_us(self, tries=0):
        first_us = RTO_FIRST_US
        if self.smooth_us is not None:
            first_us = min(max(self.smooth_us + 4 * self.spread_us, RTO_MIN_US), RTO_MAX_US)
        return min(first_us << min(tries, 8), max(first_us, BACKOFF_MAX_US))
