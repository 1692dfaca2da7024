"""What QEMU itself can tell of the emulated part: its RAM, read from outside while the core knows nothing of it."""

import contextlib
import json
import re
import socket

ANSWER_S = 2.0      # a core that waits in a semihosting call stops the whole emulator, its monitor too
CHUNK_WORDS = 1024
WORD_BYTES = 4


# One QMP connection over a socket pair: no name in any folder. `arguments` and `fds` go to QEMU's start, then started()
# says that it has its end. A question that QEMU does not answer in time gives None, and so does every later one.
class Monitor:
    def __init__(self):
        self._ours, self._theirs = socket.socketpair()
        self._ours.settimeout(ANSWER_S)
        self._file = self._ours.makefile("r", encoding="utf-8")
        self._greeted = False

    @property
    def arguments(self):
        return ("-chardev", "socket,id=monitor,fd=%d" % self._theirs.fileno(), "-mon", "chardev=monitor,mode=control")

    @property
    def fds(self):
        return (self._theirs.fileno(),)

    def started(self):
        self._theirs.close()

    def high_water(self, bottom, top):
        """Bytes of a stack that has grown from `top` towards `bottom` in RAM that was 0 before."""
        for address in range(bottom, top, CHUNK_WORDS * WORD_BYTES):
            words = self._words(address, min(CHUNK_WORDS, (top - address) // WORD_BYTES))
            if words is None:
                return None
            used = next((i for i, word in enumerate(words) if word), None)
            if used is not None:
                return top - address - used * WORD_BYTES
        return 0

    def close(self):
        for end in (self._file, self._ours, self._theirs):
            end.close()

    def _words(self, address, count):
        said = self._ask("human-monitor-command", **{"command-line": "xp /%dxw 0x%x" % (count, address)})
        words = [int(word, 16) for word in re.findall(r" 0x([0-9a-f]{8})", said or "")]
        return words if len(words) == count else None

    def _ask(self, command, **arguments):
        with contextlib.suppress(OSError, ValueError, KeyError):  # gone, or silent: there is no answer
            if not self._greeted:
                self._greeted = True
                self._answer({"execute": "qmp_capabilities"})
            return self._answer({"execute": command, "arguments": arguments})
        self._ours.close()
        return None

    def _answer(self, question):
        self._ours.sendall(json.dumps(question).encode() + b"\n")
        while True:
            line = json.loads(self._file.readline())  # "" from a QEMU that is gone: a ValueError
            if "error" in line:
                raise ValueError(line["error"])
            if "return" in line:
                return line["return"]
