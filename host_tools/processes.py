"""Child processes that never outlive us: not after Ctrl-C, not after a crash, not after kill -9.

Each child gets a session of its own, so that Ctrl-C in the terminal reaches only us and we end
the children in order. On Linux the kernel kills a child whose parent died (PR_SET_PDEATHSIG).
"""

import collections
import contextlib
import ctypes
import os
import signal
import subprocess
import sys
import threading

TAIL_LINES = 200
PR_SET_PDEATHSIG = 1
_LIBC = ctypes.CDLL(None) if sys.platform.startswith("linux") else None


# One child with its output. Contract: `lines` keeps the last 200 lines of stdout and stderr
# together; `on_line(text)`, where given, gets each line of stdout instead, from a thread of its own.
# `session=False`: only a process group of its own, as a session's leader takes the first pty it opens for its terminal.
class Child:
    def __init__(self, name, argv, on_line=None, cwd=None, env=None, session=True, pass_fds=()):
        self.name = name
        self.lines = collections.deque(maxlen=TAIL_LINES)
        parent = os.getpid()
        self.popen = subprocess.Popen(
            argv, cwd=cwd, env=env, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            start_new_session=session, process_group=None if session else 0, preexec_fn=lambda: _die_with(parent),
            pass_fds=pass_fds, text=True, errors="replace")
        self._readers = [
            threading.Thread(target=_drain, args=(self.popen.stdout, on_line or self.lines.append), daemon=True),
            threading.Thread(target=_drain, args=(self.popen.stderr, self.lines.append), daemon=True)]
        for reader in self._readers:
            reader.start()

    def poll(self):
        return self.popen.poll()

    def wait(self, timeout_s):
        """Exit code, or None if it still runs after the time."""
        try:
            return self.popen.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return None

    def text(self):
        """What it said, complete once it has ended."""
        if self.poll() is not None:
            for reader in self._readers:
                reader.join(1.0)
        return "\n".join(line.rstrip() for line in list(self.lines) if line.strip())

    def stop(self, patience_s=3.0):
        """Ask, ask firmly, end it; returns the exit code."""
        for request in (signal.SIGINT, signal.SIGTERM):
            if self.poll() is not None:
                break
            self._signal(request)
            if self.wait(patience_s) is not None:
                break
        self.kill()
        return self.popen.returncode

    def kill(self):
        if self.poll() is None:
            self._signal(signal.SIGKILL)
        self.popen.wait()
        for reader in self._readers:
            reader.join(1.0)

    def _signal(self, number):
        with contextlib.suppress(ProcessLookupError):
            self.popen.send_signal(number)


# All the children of one mission. Contract: whatever happens inside `with`, none is left after it.
class Children:
    def __init__(self):
        self.children = []

    def start(self, name, argv, **options):
        child = Child(name, argv, **options)
        self.children.append(child)
        return child

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        try:
            for child in self.children:
                child.stop(patience_s=1.0)
        finally:
            # A second Ctrl-C during the polite part ends here: no waiting any more.
            for child in self.children:
                child.kill()


@contextlib.contextmanager
def signals_as_interrupt():
    """SIGTERM and SIGHUP end a mission like Ctrl-C: children stopped, results of what there is."""
    def interrupt(number, frame):
        if number == signal.SIGHUP:
            signal.signal(number, signal.SIG_IGN)  # a terminal that is closed says so twice: by itself, and by its shell
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    old = {number: signal.signal(number, interrupt) for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)}
    try:
        yield
    finally:
        for number, handler in old.items():
            signal.signal(number, handler)


def _die_with(parent):
    if _LIBC is not None:
        _LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # it died between fork and here
            os._exit(1)


def _drain(stream, on_line):
    with stream:
        for line in stream:
            on_line(line)
