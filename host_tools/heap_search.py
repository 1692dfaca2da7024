"""`host_tools budget --target stm32 --search HOME...`: the smallest heap on which the core boots and maps these homes.

Each try is an image of its own with that heap, booted on the emulator: by bisection, as a core that boots
in some heap boots in every larger one. From then on nothing allocates, so the homes need no bisection:
their missions are run on what was found, to the end, and if one should run out of heap after all, on the next size.
"""

import argparse
import os
import tempfile

from host_tools import hil_options
from host_tools.core_process import CoreError, running_core
from host_tools.core_session import CoreSession
from host_tools.hil_options import STM32_HEAP_MAX, UsageError
from host_tools.mission_run import run_mission
from host_tools.processes import signals_as_interrupt
from host_tools.progress import Progress
from protocol.messages import BY_NAME
from sim_device.home import HomeError, load_home

STEP_BYTES = 256
BEGIN_BYTES = 64 << 10


class DoesNotFit(Exception):
    """One sentence: why no heap of this part will do."""


def search(homes, say):
    """-> ({home: how its mission ended}, heap in bytes). Raises UsageError, CoreError, DoesNotFit."""
    homes = [_loaded(home) for home in homes]
    heap = smallest_that_boots(say)
    say("smallest heap that boots: %s B (%.2f KiB)" % (format(heap, ","), heap / 1024))
    ended = {}
    while len(ended) < len(homes):
        home = homes[len(ended)]
        outcome = _mission(home, heap)
        if outcome.interrupted:
            raise DoesNotFit("Interrupted before the search had come to its end.")
        if outcome.exit_code == 3 and "out of heap" in outcome.sentence and heap + STEP_BYTES <= STM32_HEAP_MAX:
            say("%s: runs out of heap" % home.name)
            heap, ended = heap + STEP_BYTES, {}  # the homes before have not been seen on this one
            continue
        if not outcome.end.get("finished"):
            raise DoesNotFit("%s is not mapped in a heap of %s B: %s. That is not for want of heap: the core boots, and allocates "
                             "nothing after that." % (home.name, format(heap, ","), outcome.end.get("reason") or outcome.sentence))
        ended[home.name] = "%s after %.0f s of the robot" % (outcome.end["reason"], outcome.end["robot_s"])
        say("%s: mapped in %s B, %s" % (home.name, format(heap, ","), ended[home.name]))
    return ended, heap


def smallest_that_boots(say, boots=None):
    """By bisection between what the core holds once it is up, which is too little to come up in, and a heap that will do."""
    boots = boots or _used_after_boot
    low, high = 0, BEGIN_BYTES
    used = _tried(high, boots, say)
    if used is None:
        low, high = high, STM32_HEAP_MAX
        used = _tried(high, boots, say)
    if used is None:
        raise DoesNotFit("The core does not boot in %d KiB of heap, the most that this part has room for." % (high >> 10))
    low = max(low, used - used % STEP_BYTES)
    while high - low > STEP_BYTES:
        middle = (low + high) // 2
        middle -= middle % STEP_BYTES
        if _tried(middle, boots, say) is None:
            low = middle
        else:
            high = middle
    return high


def _tried(heap, boots, say):
    used = boots(heap)
    say("heap %7s B: %s" % (format(heap, ","), "does not boot" if used is None else "boots, %s B used" % format(used, ",")))
    return used


def _used_after_boot(heap):
    """Bytes, or None if the core has not come up for want of heap."""
    try:
        with running_core("stm32", str(heap)) as port:
            core = CoreSession(port)
            core.handshake()
            return core.ask(BY_NAME["STATUS"](flags=0), "STATUS_RSP").heap_used_bytes
    except CoreError as error:
        if "out of heap" in str(error):
            return None
        raise


def _loaded(home):
    try:
        return load_home(home)
    except HomeError as error:
        raise UsageError(str(error)) from None


def _mission(home, heap):
    parser = argparse.ArgumentParser()
    hil_options.add_arguments(parser)
    args = parser.parse_args([home.path, "--target", "stm32", "--link", "semihost", "--heap", str(heap)])
    hil_options.check(args)
    with signals_as_interrupt(), tempfile.TemporaryDirectory(prefix="tvslam-") as folder:
        log, truth = os.path.join(folder, "mission.log"), os.path.join(folder, "truth.bin")
        return run_mission(args, os.path.abspath(home.path), folder, log, truth, Progress())
