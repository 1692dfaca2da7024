# How long to wait for an answer before asking again: Jacobson's estimate in integers of microseconds.
# Host only: the core never waits for anything (link.py).

RTO_FIRST_US = 100_000      # nothing is known yet
RTO_MIN_US = 3_000
RTO_MAX_US = 1_000_000
PATIENCE_US = 20_000        # at first
BACKOFF_MAX_US = 50_000     # repeats do not lie further apart, unless the line itself is that slow
AMBIGUOUS_MAX = 8


# add() takes each answer's time; timeout_us(tries) is the wait after that many repeats.
#
# Karn: the answer to a question that was sent twice says nothing, as nobody knows to which one it is. But where
# a line has become slower than the estimate, every question is sent twice: after eight in a row each one waits twice as long
# as the one before, until one is answered that was sent once. Their own times would not do: our waiting is in them.
#
# A line may answer in 30 us and its far end be descheduled for 10 ms all the same. What a repeat was worth tells the
# two apart: needed() makes the shortest wait shorter, needless() longer.
class RoundTrip:
    def __init__(self):
        self.smooth_us = None
        self.spread_us = 0
        self.patience_us = PATIENCE_US
        self._ambiguous = 0     # answers in a row

    def add(self, way_us, tries):
        if tries:
            self._ambiguous += 1
            return
        self._ambiguous = 0
        if self.smooth_us is None:
            self.smooth_us, self.spread_us = way_us, way_us >> 1
            return
        error_us = way_us - self.smooth_us
        self.smooth_us += error_us >> 3
        self.spread_us += abs(error_us) - self.spread_us >> 2

    def needed(self):
        self.patience_us = max(self.patience_us - (self.patience_us >> 2), RTO_MIN_US)

    def needless(self):
        self.patience_us = min(self.patience_us + (self.patience_us >> 3), BACKOFF_MAX_US)

    def timeout_us(self, tries=0):
        first_us = RTO_FIRST_US
        if self.smooth_us is not None:
            first_us = max(self.smooth_us + 4 * self.spread_us, self.patience_us)
        first_us = min(first_us << max(0, min(self._ambiguous - AMBIGUOUS_MAX, 9)), RTO_MAX_US)
        return min(first_us << min(tries, 8), max(first_us, BACKOFF_MAX_US))
