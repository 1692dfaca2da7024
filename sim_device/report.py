# What a mission tells while it runs: JSON lines for programs, short lines for people.

import json
import sys
import time

PLAIN_EVERY_S = 5.0
_END = ("%(verdict)s: %(reason)s (%(state)s). %(robot_s).1f s of robot time, %(path_m).1f m, %(contacts)d contacts; "
        "%(steps)d steps in %(wall_s).1f s, %(real_time_factor)s times real time; %(frames)d frames, %(resent)d sent again")


class ReaderGone(Exception):
    """Whoever read our events has gone away."""


# Events as JSON lines on stdout, each flushed: {"event": name, ...}.
class JsonReport:
    def event(self, name, **fields):
        try:
            print(json.dumps({"event": name, **fields}, separators=(",", ":")), flush=True)
        except BrokenPipeError:
            raise ReaderGone from None

    def error(self, sentence, code, **known):
        print("sim_device: " + sentence, file=sys.stderr)
        try:
            self.event("error", sentence=sentence, exit=code, **known)
        except ReaderGone:
            pass


# The same for people, on stderr: one line rewritten on a terminal, a line every 5 s elsewhere.
class PlainReport:
    def __init__(self):
        self._stream = sys.stderr
        self._live = self._stream.isatty()
        self._open = False
        self._next_s = time.monotonic() + PLAIN_EVERY_S

    def event(self, name, **fields):
        if name == "progress":
            self._progress(fields)
        elif name == "ready":
            self._say("waiting for the core on %s" % fields["link"])
        elif name == "start":
            self._say("the core has %d bytes of heap, %d used; the mission starts" % (
                fields["hello"]["heap_bytes"], fields["hello"]["heap_used_bytes"]))
            for sentence in fields["storage"]:
                self._say(sentence)
        elif name in ("schema", "degraded"):
            self._say(fields["text"])
        elif name == "reset":
            self._say(fields["text"] + ("" if fields["here"] else " Start the core anew."))
        elif name == "restart":
            self._say("the core has started anew at step %d, where the robot stands" % fields["step"])
        elif name == "end":
            said = {**fields, "verdict": "finished" if fields["finished"] else "not finished"}
            self._say(_END % said)
            for item in fields["missed"]:
                self._say("--faults %s never came: the mission was over before." % item)
            if fields["incomplete"]:
                self._say("sim_device: " + fields["incomplete"])

    def error(self, sentence, code, incomplete="", **known):
        for said in filter(None, (sentence, incomplete)):
            self._say("sim_device: " + said)

    def _progress(self, fields):
        now_s = time.monotonic()
        if not self._live and now_s < self._next_s:
            return
        self._next_s = now_s + PLAIN_EVERY_S
        counted = "  ".join("%s %d" % (key, fields[key]) for key in ("points", "vectors") if fields[key] is not None)
        line = "robot %7.1f s  path %6.1f m  %-13s %s" % (fields["robot_s"], fields["path_m"], fields["state"], counted)
        if self._live:
            self._stream.write("\r\x1b[K" + line)
            self._stream.flush()
            self._open = True
        else:
            self._say(line)

    def _say(self, line):
        if self._open:
            self._stream.write("\r\x1b[K")
            self._open = False
        print(line, file=self._stream, flush=True)
