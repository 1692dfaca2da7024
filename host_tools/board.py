"""A board with MicroPython at a serial port: asked and told over its REPL, by mpremote's transport."""

import ast
import contextlib
import hashlib
import io
import os
import struct
import termios
import time
import zlib

import serial

from host_tools.core_session import BOOT_S
from host_tools.terminal_port import STOP
from protocol.host_link import HostLink

ANSWER_S = 4.0
ENTER_S = 8.0       # to stop what runs there and to be answered by the REPL
WORK_S = 60.0       # for a file, or all digests, on a slow flash
CHUNK_BYTES = 512   # of a file at once: as text it is up to four times as long, and lies in the board's heap
ENOSPC, EROFS = 28, 30
NO_MICROPYTHON = "press its reset button, close what else uses the port, and make sure that it is the board's."

# A write that was broken off (mpremote's f and w) left its file open. Closed when its memory is next needed, it
# would put back what it held over what is written until then.
FORGET = "import gc\nf = w = None\ngc.collect()"

# Runs on the board: prints (path, size, digest) of each file below the folders asked for, size -1 for a folder.
# The digest is sha256 as text, else crc32 as a number, else None: not every board has the first, or even the second.
LISTING = """
import os
try:
 from hashlib import sha256 as h
except ImportError:
 h = None
try:
 from binascii import hexlify
 from binascii import crc32 as c
except ImportError:
 c = None
b = bytearray(512)
m = memoryview(b)
def d(p):
 if not h and not c:
  return None
 s = h() if h else 0
 with open(p, "rb") as f:
  while 1:
   n = f.readinto(b)
   if not n:
    break
   if h:
    s.update(m[:n])
   else:
    s = c(m[:n], s)
 return hexlify(s.digest()).decode() if h else s
def w(p):
 try:
  t = os.stat(p)
  if not t[0] & 0x4000:
   print((p, t[6], d(p)))
   return
  l = list(os.ilistdir(p))
 except OSError:
  return
 print((p, -1, None))
 for e in l:
  w(p + "/" + e[0])
"""


class BoardError(Exception):
    """One sentence about the board, to be put behind its port's name: what is wrong, and the way out."""

    code = 3


class PortMissing(BoardError):
    """There is no board at the port asked for: bad arguments."""

    code = 2


# One board, its program stopped and its REPL ours from __enter__ on. Every method raises BoardError, with the cause,
# where the board does not do what it should, or does not answer in time.
class Board:
    def __init__(self, device):
        self.device = device
        self.machine = ""
        self.mpy = 0
        self._transport = None

    def __enter__(self):
        try:
            from mpremote.transport_serial import SerialTransport  # here: it is an extra, and nothing else needs it
        except ImportError:
            raise BoardError("mpremote is not installed; pip install 'tvslam[board]'.") from None
        _check(self.device)
        with self._asking():
            self._transport = SerialTransport(self.device, timeout=ANSWER_S)
        try:
            with self._asking(ENTER_S):
                self._transport.serial.write_timeout = ANSWER_S
                self._enter()
                self._transport.exec(FORGET)
                self.machine, self.mpy = self._ask("import sys\nprint((getattr(sys.implementation, '_machine', sys.platform), "
                                                   "getattr(sys.implementation, '_mpy', 0)))")
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        with contextlib.suppress(OSError, termios.error):
            self._transport.close()

    def _enter(self):
        """Into the raw REPL, whatever runs there: a core of ours needs a moment to end."""
        for _ in range(2):
            self._transport.serial.write(STOP)
            time.sleep(0.2)
        self._transport.serial.reset_input_buffer()
        self._transport.enter_raw_repl(soft_reset=False, timeout_overall=ANSWER_S)

    def files(self, *paths):
        """{path: (size, digest)} of all files at and below these paths, {folders}."""
        with self._asking():
            self._transport.exec(LISTING)
            lines = self._transport.exec("\n".join("w(%r)" % path for path in paths)).decode().splitlines()
            found = [_literal(line) for line in lines]
            return ({path: (size, digest) for path, size, digest in found if size >= 0},
                    {path for path, size, _ in found if size < 0})

    def folders(self, path):
        """Those right below `path`, a folder that is there."""
        with self._asking():
            return {path.rstrip("/") + "/" + entry.name for entry in self._transport.fs_listdir(path) if entry.st_mode & 0x4000}

    def holds(self, path, digest, content):
        """Whether a file whose digest files() gave is this content."""
        if digest is None:
            with self._asking():
                return bytes(self._transport.fs_readfile(path, chunk_size=CHUNK_BYTES)) == content
        return digest == (hashlib.sha256(content).hexdigest() if isinstance(digest, str) else zlib.crc32(content))

    def read(self, path):
        with self._asking():
            return bytes(self._transport.fs_readfile(path, chunk_size=CHUNK_BYTES))

    def write(self, path, content):
        with self._asking():
            self._transport.fs_writefile(path, content, chunk_size=CHUNK_BYTES)

    def make_folder(self, path):
        with self._asking():
            self._transport.fs_mkdir(path)

    def remove(self, path):
        with self._asking():
            self._transport.fs_rmfile(path)

    def remove_folder(self, path):
        with self._asking():
            self._transport.fs_rmdir(path)

    def free_bytes(self):
        with self._asking():
            return self._ask("import os\ns = os.statvfs('/')\nprint(s[0] * s[4])")

    def restart(self):
        """A soft reset, which runs main.py; -> the HELLO of the core that it starts."""
        with self._asking():
            self._transport.exit_raw_repl()
            time.sleep(0.1)
            self._transport.serial.reset_input_buffer()
            self._transport.serial.write(b"\x04")
            return self._await_hello()

    def _await_hello(self):
        link, said = HostLink(), b""
        limit = time.monotonic() + BOOT_S
        while time.monotonic() < limit:
            data = self._transport.serial.read(max(1, self._transport.serial.in_waiting))
            said = (said + data)[-2000:]
            for message in link.feed(data):
                if message.NAME == "HELLO":
                    return message
            if b"Error" in said and said.rstrip().endswith(b">>>"):
                break  # main.py has ended in a traceback, and the REPL is back
        lines = [line.strip() for line in said.decode("utf-8", "replace").splitlines() if "Error" in line]
        raise BoardError("the core does not start on it (%s); its REPL tells more." % (
            lines[-1] if lines else "nothing came for %g s" % BOOT_S))

    def _ask(self, code):
        return _literal(self._transport.exec(code).decode())

    @contextlib.contextmanager
    def _asking(self, seconds=WORK_S):
        """mpremote's failures as sentences. It prints what it could not make sense of: not to our stdout."""
        from mpremote.transport import TransportError, TransportExecError
        try:
            with contextlib.redirect_stdout(io.StringIO()), self._at_most(seconds):
                yield
        except TransportExecError as error:
            said = error.error_output.strip().splitlines()
            raise BoardError("it ended a question with %s." % (said[-1] if said else "an error without a word")) from None
        except (TransportError, struct.error, ValueError, termios.error, serial.SerialTimeoutException):
            raise BoardError("it does not answer as a MicroPython does; " + NO_MICROPYTHON) from None
        except OSError as error:
            if isinstance(error, serial.SerialException) or not os.path.exists(self.device):
                raise BoardError("it was unplugged while in use; plug it in again and repeat the command, which goes on where it "
                                 "was.") from None
            raise BoardError(_file_error(error)) from None

    @contextlib.contextmanager
    def _at_most(self, seconds):
        """mpremote goes on reading for as long as bytes come: another baud rate's, say, without end."""
        if self._transport is None:
            yield
            return
        port, limit = self._transport.serial, time.monotonic() + seconds

        def read(size=1):
            if time.monotonic() > limit:
                raise BoardError("it talks on without an answer; " + NO_MICROPYTHON)
            return type(port).read(port, size)

        port.read = read
        try:
            yield
        finally:
            del port.read


def _literal(text):
    try:
        return ast.literal_eval(text.strip())
    except SyntaxError:
        raise ValueError(text) from None


def _check(device):
    if not os.path.exists(device):
        raise PortMissing("there is no such port; plug the board in, or give the port that it has.")
    try:
        fd = os.open(device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError as error:
        raise PortMissing("the port cannot be opened (%s); close what else uses it, or let yourself into the group that may."
                         % (error.strerror or str(error)).lower()) from None
    with os.fdopen(fd, "rb", buffering=0):
        if not os.isatty(fd):
            raise PortMissing("this is not a terminal; give a serial port.")


def _file_error(error):
    if error.errno == ENOSPC:
        return "its flash is full; remove files of yours from it, or take a board with more."
    if error.errno == EROFS:
        return "its filesystem is read-only; make it writable in its boot.py."
    return "a file could not be handled there: %s (%s)." % (error.strerror or "errno %s" % error.errno, error.filename or error.args[-1])
