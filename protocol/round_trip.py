# How long to wait for an answer before asking again: Jacobson's estimate in integers of microseconds.
# Host only: the core never waits for anything (link.py).

RTO_FIRST_US = 100_000      # nothing is known yet
RTO_MIN_US = 3_000
RTO_MAX_US = 1_000_000
PATIENCE_US = 20_000        # at first
PATIENCE_MAX_US = 200_000
BACKOFF_MAX_US = 50_000     # repeats do not lie further apart, unless the line itself is that slow


# add() takes each answer's time; timeout_us(tries) is the wait after that many repeats.
#
# Karn: the answer to a question that was sent twice says nothing, as nobody knows to which one it is.
#
# A line may answer in 30 us and its far end be descheduled for 10 ms all the same, or become slower than
# the estimate and never be measured again. What a repeat was worth tells: needless() makes the shortest wait longer, needed()
# shorter. In balance five of seven are needless: where a line doubles and swaps frames, many seem so.
class RoundTrip:
    def __init__(self):
        self.smooth_us = None
        self.spread_us = 0
        self.patience_us = PATIENCE_US

    def add(self, way_us, tries):
        if tries:
            return
        if self.smooth_us is None:
            self.smooth_us, self.spread_us = way_us, way_us >> 1
            return
        error_us = way_us - self.smooth_us
        self.smooth_us += error_us >> 3
        self.spread_us += abs(error_us) - self.spread_us >> 2

    def needed(self):
        self.patience_us = max(self.patience_us - (self.patience_us >> 2), RTO_MIN_US)

    def needless(self):
        self.patience_us = min(self.patience_us + (self.patience_us >> 3), PATIENCE_MAX_US)

    def timeout_us(self, tries=0):
        first_us = RTO_FIRST_US
        if self.smooth_us is not None:
            first_us = min(self.smooth_us + 4 * self.spread_us, RTO_MAX_US)
        first_us = max(first_us, self.patience_us)
        return min(first_us << min(tries, 8), max(first_us, BACKOFF_MAX_US))
