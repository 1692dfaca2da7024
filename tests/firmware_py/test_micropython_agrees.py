# The same streams through the real MicroPython VM: equal hashes at every tick, and
# nothing allocated, since the heap is locked from the first tick to the last.

import sys
import tempfile
from pathlib import Path

from hypothesis import example, given, settings

from tests.firmware_py.core_run import hashes_here, hashes_of
from tests.strategies import Segment, examples, settings_of_a_robot, streams

BUSY = [Segment("wander", 1500, 4), Segment("along_a_wall", 500, 5), Segment("extremes", 200, 6)]


@settings(max_examples=examples(30))
@given(settings_of_a_robot(), streams())
@example([], BUSY)
def test_micropython_gives_the_hashes_of_cpython_with_its_heap_locked(micropython, parameters, segments):
    with tempfile.TemporaryDirectory() as folder:
        there, last = hashes_of([micropython, "-X", "heapsize=512k"], Path(folder), parameters, segments)
    assert last == f"ticks {len(there)} allocated 0"
    here = hashes_here(parameters, segments)
    apart = [tick for tick, (a, b) in enumerate(zip(here, there), 1) if a != b]
    assert len(here) == len(there) and not apart, f"first apart at tick {apart[0]}"


def test_an_unwatched_cpython_gives_them_too(tmp_path):
    here, _ = hashes_of([sys.executable], tmp_path, [], BUSY)
    assert here == hashes_here([], BUSY)
