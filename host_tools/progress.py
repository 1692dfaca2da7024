"""Progress while a mission runs: one line rewritten on a terminal, a plain line now and then elsewhere."""

import shutil
import sys
import time


PLAIN_EVERY_S = 5.0


class Progress:
    def __init__(self, stream=None):
        self.stream = stream or sys.stderr
        self.live = self.stream.isatty()
        self._shown = False
        self._next_s = 0.0

    def show(self, event):
        """One "progress" event of the virtual robot."""
        self.text(line(event))

    def text(self, text):
        """How far it is, which takes the place of what was said before."""
        now = time.monotonic()
        if self.live:
            width = max(shutil.get_terminal_size().columns - 1, 20)
            self.stream.write("\r\x1b[K" + text[:width])
            self.stream.flush()
            self._shown = True
        elif now >= self._next_s:
            self._next_s = now + PLAIN_EVERY_S
            print(text, file=self.stream, flush=True)

    def note(self, text):
        """A line of its own that stays."""
        self.clear()
        print(text, file=self.stream, flush=True)

    def clear(self):
        if self._shown:
            self.stream.write("\r\x1b[K")
            self.stream.flush()
            self._shown = False


def line(event):
    parts = ["robot %7.1f s" % event.get("robot_s", 0), "path %6.1f m" % event.get("path_m", 0), "%-13s" % event.get("state")]
    parts += ["%s %s" % (key, event[key]) for key in ("points", "vectors") if event.get(key) is not None]
    if event.get("memory") is not None:
        parts.append("memory %s" % memory(event["memory"]))
    return "  ".join(parts)


def memory(value):
    if isinstance(value, dict):
        used, total = value.get("used"), value.get("total")
        return "%s/%s B" % (used, total) if total else "%s B" % used
    return "%s B" % value
