"""What is said of a core on the emulator that ended, without an emulator: the words by what it printed."""

import pytest

from host_tools.hil_options import STM32_HEAP_ENOUGH, STM32_HEAP_MAX
from host_tools.qemu import Emulator

RAN_OUT = 'Traceback (most recent call last):\n  File "<stdin>", line 2, in <module>\n  File "tvslam.py", line 7, in main\n' \
          "MemoryError: memory allocation failed, allocating 512 bytes\n"


# A process that runs on, as the emulator's does when the script on it has ended.
class Running:
    def poll(self):
        return None

    def text(self):
        return ""


def ended(printed):
    """What is said of a core whose script ended with that, as the raw REPL frames it."""
    emulator = Emulator(None, "firmware.elf")
    emulator._child, emulator._started_s = Running(), 0.0
    emulator._text = "OK%s\x04>" % printed.replace("Traceback", "\x04Traceback")
    assert emulator.poll() == 3
    return emulator.sentence()


def test_a_heap_too_small_to_boot_in_is_told_with_one_that_will_do():
    said = ended("tvslam: linking\n" + RAN_OUT)
    assert said.startswith("the core ran out of heap on the emulated STM32; give --heap %dk or more." % (STM32_HEAP_ENOUGH // 1024))
    assert "MemoryError: memory allocation failed, allocating 512 bytes" in said and "tvslam: linking" in said
    assert "Traceback" not in said and "File" not in said
    assert STM32_HEAP_ENOUGH < STM32_HEAP_MAX


def test_heap_asked_for_after_boot_is_a_bug_of_the_core():
    said = ended("tvslam: up\n" + RAN_OUT)
    assert "ran out of heap" in said and "after boot" in said and "a bug of the core, please report" in said
    assert "--heap" not in said and "Traceback" not in said


@pytest.mark.parametrize("up", ["", "tvslam: up\n"])
def test_another_traceback_is_shown(up):
    said = ended(up + RAN_OUT.replace("MemoryError", "ValueError"))
    assert "ended before the mission did" in said and "Traceback" in said and "heap" not in said
