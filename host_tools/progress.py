"""Progress while a mission runs: one line rewritten on a terminal, a plain line now and then elsewhere."""

import errno
import os
import shutil
import sys
import time


PLAIN_EVERY_S = 5.0


def say(text, stream=None, end="\n"):
    """Print it. Whoever reads may have gone (head, a closed terminal): that ends no mission, and changes no exit code."""
    stream = stream or sys.stdout
    try:
        print(text, file=stream, end=end, flush=True)
    except OSError as error:
        if error.errno not in (errno.EPIPE, errno.EIO):
            raise
        hush(stream)


def hush(stream):
    """From here on it goes nowhere: Python would complain once more at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


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
            say("\r\x1b[K" + text[:width], self.stream, end="")
            self._shown = True
        elif now >= self._next_s:
            self._next_s = now + PLAIN_EVERY_S
            say(text, self.stream)

    def note(self, text):
        """A line of its own that stays."""
        self.clear()
        say(text, self.stream)

    def clear(self):
        if self._shown:
            say("\r\x1b[K", self.stream, end="")
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
