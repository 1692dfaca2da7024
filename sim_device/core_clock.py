# The core's clock as the host sees it: a line through PING and PONG, refitted with each pair.

import math
import statistics
from collections import deque

import numpy as np

WINDOW = 96             # pairs; at one each 100 ms the last ten seconds
WRAP_MS = 1 << 26       # the core's milliseconds begin anew there
JUMP_MS = 3.0           # beyond half the round trips of both, pair and line: that is no jitter
JUMP_PAIRS = 3          # so many in a row: the clock has jumped; fewer were stray
SLOPE_SLACK_MS2 = 900.0  # few pairs say little of the rate: a third of a millisecond of noise against 1 % of drift
STEP_MS = 1.0           # of what the core tells: a rate of few pairs may be as far off, and the line with it farther on


# The core's milliseconds go on here beyond their wrap. A pair is worth as much as its way was
# short: those of the slower half of the window are left out of the fit. The core tells whole
# milliseconds, so its moment is taken as the middle of one. Before the first add() there is no clock.
class CoreClock:
    def __init__(self):
        self.drift_ppm = 0.0      # how much faster than the host's clock
        self.residual_ms = None   # of the pairs from the line, root mean square
        self.jumps = 0
        self._pairs = deque(maxlen=WINDOW)  # (host's middle s, core's ms, there and back s)
        self._strays = []
        self._at_s = self._at_ms = 0.0      # the line's middle
        self._ms_per_s = 1000.0
        self._way_s = 0.0                   # the longest of the line's
        self._rate_doubt = 0.0              # ms a ms

    def add(self, sent_s, received_s, core_ms):
        """A PING sent, its PONG received, and what the core's ticks_ms was in between."""
        pair = ((sent_s + received_s) / 2, self._unwrapped(core_ms) + 0.5, received_s - sent_s)
        if self._pairs and abs(pair[1] - self.core_ms(pair[0])) > self._leeway_ms(pair):
            self._strays.append(pair)
            if len(self._strays) < JUMP_PAIRS:
                return
            self.jumps += 1
            self._pairs.clear()
            self._pairs.extend(self._strays)
        else:
            self._pairs.append(pair)
        self._strays = []
        self._fit()

    def core_ms(self, host_s):
        return self._at_ms + (host_s - self._at_s) * self._ms_per_s

    def host_s(self, core_ms):
        return self._at_s + (core_ms - self._at_ms) / self._ms_per_s

    @property
    def round_trip_s(self):
        """What nine of ten pairs stayed below."""
        ways = sorted(pair[2] for pair in self._pairs)
        return ways[len(ways) * 9 // 10]

    def _leeway_ms(self, pair):
        return JUMP_MS + 500 * (pair[2] + self._way_s) + 1000 * abs(pair[0] - self._at_s) * self._rate_doubt

    def _unwrapped(self, core_ms):
        if not self._pairs:
            return core_ms
        last_ms = int(self._pairs[-1][1])
        return last_ms + (core_ms - last_ms + WRAP_MS // 2) % WRAP_MS - WRAP_MS // 2

    def _fit(self):
        self._way_s = statistics.median(pair[2] for pair in self._pairs)
        host_s, core_ms = np.array([pair[:2] for pair in self._pairs if pair[2] <= self._way_s]).T
        self._at_s, self._at_ms = host_s.mean(), core_ms.mean()
        run_ms = (host_s - self._at_s) * 1000
        gained_ms = core_ms - self._at_ms - run_ms
        length_ms2 = float(run_ms @ run_ms) + SLOPE_SLACK_MS2
        drift = float(run_ms @ gained_ms) / length_ms2
        self._rate_doubt = STEP_MS / math.sqrt(length_ms2)
        self._ms_per_s = 1000 * (1 + drift)
        self.drift_ppm = drift * 1e6
        self.residual_ms = float(np.sqrt(np.mean((gained_ms - drift * run_ms) ** 2)))
