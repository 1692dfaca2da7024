# A board for tests: the Unix port of MicroPython behind a pty, with its real REPL and a real littlefs.

import contextlib
import os
import pty
import select
import signal
import subprocess
import termios
import threading
import time
import tty
from pathlib import Path

BOOT = Path(__file__).with_name("board_boot.py")
FLASH_BYTES = 512 * 1024


# Contract: with UnixBoard(...) as board: board.device is the port that the host opens. A soft reset (Ctrl-D) starts
# the VM anew on the same flash. `pull_after` bytes from the host its plug is pulled; plug_in() gives it another port.
class UnixBoard:
    def __init__(self, micropython, folder, flash_bytes=FLASH_BYTES, heap="512k", without=()):
        self.flash = folder / "flash.img"
        if not self.flash.exists():
            self.flash.write_bytes(bytes(flash_bytes))
        self._argv = [micropython, "-X", "heapsize=" + heap, "-i", str(BOOT), str(self.flash), *without]
        self.starts = 0
        self.pull_after = None
        self._host = self._host_end = -1
        self._stop, self._off = threading.Event(), threading.Event()
        self._lock = threading.Lock()
        self._vm = None

    def __enter__(self):
        self._board, self._board_end = pty.openpty()    # the VM's stdin and stdout
        tty.setraw(self._board_end)
        self.plug_in()
        self._thread = threading.Thread(target=self._pump, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._stop.set()
        self._thread.join()
        self._end()
        self._pull()
        for fd in (self._board, self._board_end):
            os.close(fd)

    def plug_in(self):
        self.pull_after = None
        host, self._host_end = pty.openpty()    # the host opens the second by its name
        tty.setraw(self._host_end)
        self.device = os.ttyname(self._host_end)
        self._start()
        self._host = host

    def while_off(self, code):
        """Code run on its filesystem by another VM, the board being without power meanwhile; what it prints."""
        with self._lock:
            self._off.set()
            self._end()
        script = self.flash.with_name("off.py")
        script.write_text(BOOT.read_text().split("boot(sys.argv")[0] + "boot(sys.argv[1])\n" + code)
        done = subprocess.run([self._argv[0], str(script), str(self.flash)], capture_output=True, text=True, timeout=30)
        assert done.returncode == 0, done.stdout + done.stderr
        self._off.clear()
        return done.stdout

    def _pull(self):
        for fd in (self._host, self._host_end):
            if fd >= 0:
                os.close(fd)
        self._host = self._host_end = -1

    def _start(self):
        self.starts += 1
        self._vm = subprocess.Popen(self._argv, stdin=self._board_end, stdout=self._board_end, stderr=subprocess.DEVNULL,
                                    start_new_session=True, cwd=self.flash.parent)

    def _end(self):
        with contextlib.suppress(ProcessLookupError):
            self._vm.send_signal(signal.SIGKILL)
        self._vm.wait()

    def _pump(self):
        while not self._stop.is_set():
            if self._host < 0 or self._off.is_set():
                time.sleep(0.01)
                continue
            with self._lock:
                if self._vm.poll() is not None and not self._off.is_set():
                    self._start()
            for fd in select.select([self._host, self._board], [], [], 0.05)[0]:
                data = os.read(fd, 4096)
                if fd == self._board:
                    os.write(self._host, data)
                    continue
                if self.pull_after is not None:
                    data = data[:self.pull_after]
                    self.pull_after -= len(data)
                os.write(self._board, data)
                if self.pull_after == 0:
                    self._end()
                    termios.tcflush(self._board, termios.TCIOFLUSH)
                    self._pull()
                    break
