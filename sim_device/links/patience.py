# How long an answer is waited for.

RESET_S = 30.0          # for a core to boot that was reset


# over(now_s) is asked again and again, in the link's time: true once nothing came for `dead_s`, not counted while the core is reset.
class Patience:
    def __init__(self, link, dead_s, now_s):
        self._link = link
        self._dead_s = dead_s
        self._start_s = self._lost_s = now_s

    def over(self, now_s):
        if self._link.resetting and now_s - self._start_s < RESET_S:
            self._lost_s = now_s
        return now_s - self._lost_s > self._dead_s
