# The core in a test: made, told its parameters, fed a stream, measured, replayed
# in another interpreter. No assertion lives here.

import subprocess
import sys
from array import array

from tests.house.integer_guard import guarded_core
from tests.house.tree import PROJECT
from tests.strategies import VALUES, ticks_of

with guarded_core() as _core:
    WatchedTvslam = _core("firmware_py.pipeline").Tvslam  # every number checked against 2**30

REPLAY = "tests/upy/replay.py"
PLAIN = (int, bool, str, bytes, type(None))


def booted(kind, parameters=()):
    core = kind()
    for number, index, value in parameters:
        core.set_parameter(number, index, value)
    core.begin()
    return core


def feed(core, segments):
    values = array("i", bytes(4 * VALUES))
    for tick in ticks_of(segments):
        for i, value in enumerate(tick):
            values[i] = value
        core.step(values)
        yield core


def objects_of(core):
    """Everything that belongs to the core: {path: object}, through attributes, lists and tuples."""
    found = {}
    seen = set()
    todo = [("core", core)]
    while todo:
        path, thing = todo.pop()
        if isinstance(thing, PLAIN) or id(thing) in seen or callable(thing) or isinstance(thing, type(sys)):
            continue
        seen.add(id(thing))
        found[path] = thing
        if isinstance(thing, (list, tuple)):
            todo.extend((f"{path}[{i}]", item) for i, item in enumerate(thing))
        elif hasattr(thing, "__dict__"):
            todo.extend((f"{path}.{name}", item) for name, item in vars(thing).items())
    return found


def storage_of(core):
    """What must not change while the core runs: each buffer's and container's identity and size, each object's attributes."""
    sizes = {}
    for path, thing in objects_of(core).items():
        if isinstance(thing, (array, bytearray, memoryview)):
            sizes[path] = (id(thing), len(thing), sys.getsizeof(thing))
        elif isinstance(thing, (list, tuple, dict, set)):
            sizes[path] = (id(thing), len(thing))
        else:
            sizes[path] = (id(thing), tuple(vars(thing)))
    return sizes


def stores_of(core):
    """The objects that count records: they say how many they hold, how many fit, how many were lost."""
    return {path: thing for path, thing in objects_of(core).items() if hasattr(thing, "used") and hasattr(thing, "CAPACITY")}


def hashes_here(parameters, segments):
    core = booted(WatchedTvslam, parameters)
    return [(core.hash_lo, core.hash_hi) for _ in feed(core, segments)]


def write_stream(path, parameters, segments):
    stream = list(ticks_of(segments))
    data = array("i", [len(parameters), len(stream), VALUES])
    for triple in parameters:
        data.extend(triple)
    for tick in stream:
        data.extend(tick)
    path.write_bytes(data.tobytes())


def hashes_of(command, folder, parameters, segments, script=REPLAY):
    """Runs tests/upy/replay.py, or what was made of it, under an interpreter. Returns (hashes, its last line)."""
    write_stream(folder / "stream", parameters, segments)
    run = subprocess.run(
        [*command, script, str(folder / "stream"), str(folder / "hashes")],
        cwd=PROJECT, capture_output=True, text=True, timeout=100,
    )  # fmt: skip
    if run.returncode:
        raise AssertionError(f"{command[0]} ended with {run.returncode}:\n{run.stdout}{run.stderr}")
    halves = array("H", (folder / "hashes").read_bytes())
    return list(zip(halves[0::2], halves[1::2])), run.stdout.strip().splitlines()[-1]
