# Sensor streams for the core, from the plausible to the absurd, and parameters
# within and beyond their ranges. A stream is a list of segments, each expanded by
# a seeded generator: hypothesis shrinks the segments, not thousands of numbers.

import random
from dataclasses import dataclass

from hypothesis import settings
from hypothesis import strategies as st

from protocol.parameters import PARAMETERS

EXAMPLES = 60   # of a property in `make test`

# The STEP layout: values[0] = step, 1 = left, 2 = right, 3..10 = infrared,
# 11 = ultrasonic_mm, 12 = bump, 13 = number of UWB records, then anchor, strength_cdb, range_mm each.
HEAD = 14
UWB_RECORDS_MAX = 15
VALUES = HEAD + 3 * UWB_RECORDS_MAX

IR_FAR = 60      # counts with nothing in reach
IR_WALL = 330    # about 11 cm in front of the sensor: the wall beside the robot


def examples(count):
    """So many in `make test`, and as much more often in `make soak` as others: for a property that takes its time."""
    return count * settings().max_examples // EXAMPLES


# So many ticks of one kind of nonsense; `seed` decides the details.
@dataclass(frozen=True)
class Segment:
    kind: str
    ticks: int
    seed: int


def _noise(rng, values, _tick):
    values[1] = rng.randint(-32768, 32767)
    values[2] = rng.randint(-32768, 32767)
    for i in range(3, 11):
        values[i] = rng.randint(0, 1023)
    values[11] = rng.randint(0, 65535)
    values[12] = rng.randint(0, 255)
    _uwb(rng, values, rng.randint(0, UWB_RECORDS_MAX), wild=True)


def _extremes(rng, values, _tick):
    values[1] = rng.choice((-32768, 32767, 0))
    values[2] = rng.choice((-32768, 32767, 0))
    for i in range(3, 11):
        values[i] = rng.choice((0, 1023))
    values[11] = rng.choice((0, 1, 65534, 65535))
    values[12] = rng.choice((0, 255))
    _uwb(rng, values, rng.choice((0, UWB_RECORDS_MAX)), wild=True)


def _along_a_wall(rng, values, tick):
    # straight on at 0.3 m/s with a wall to the right
    values[1] = 13 + (tick & 1)
    values[2] = 13 + (tick & 1)
    for i in range(3, 11):
        values[i] = IR_FAR + rng.randint(-3, 3)
    values[8] = IR_WALL + rng.randint(-3, 3)
    values[7] = IR_WALL - 40 + rng.randint(-3, 3)
    if tick % 5 == 0:
        _uwb(rng, values, 4, wild=False)


def _in_the_open(rng, values, tick):
    values[1] = values[2] = 13
    for i in range(3, 11):
        values[i] = IR_FAR + rng.randint(-3, 3)
    values[11] = 65535 if tick % 3 == 0 else 0


def _spin(rng, values, _tick):
    turn = rng.choice((5, 10, 60))
    values[1] = -turn
    values[2] = turn
    for i in range(3, 11):
        values[i] = rng.randint(100, 500)


def _walls_all_round(rng, values, _tick):
    for i in range(3, 11):
        values[i] = 600 + rng.randint(-40, 40)
    values[12] = rng.randint(0, 255)


def _pushed(_rng, values, _tick):
    values[1] = values[2] = 13
    values[12] = 1


def _wander(rng, values, tick):
    # driven in curves past things that come and go: many points, vectors and fixes
    turn = rng.randint(-6, 6) if tick % 40 < 8 else 0
    values[1] = 10 - turn
    values[2] = 10 + turn
    for i in range(3, 11):
        values[i] = rng.choice((IR_FAR, IR_FAR, 200, 300, 400)) + rng.randint(-3, 3)
    values[12] = 1 if rng.random() < 0.02 else 0
    if tick % 5 == 0:
        _uwb(rng, values, rng.randint(0, 6), wild=False)


def _uwb(rng, values, count, wild):
    values[13] = count
    for k in range(count):
        values[HEAD + 3 * k] = rng.randint(0, 255) if wild else k
        values[HEAD + 3 * k + 1] = rng.randint(-32768, 32767) if wild else rng.randint(-7500, -4700)
        values[HEAD + 3 * k + 2] = rng.randint(0, 65535) if wild else rng.randint(1500, 9000)


KINDS = {
    "noise": _noise, "extremes": _extremes, "along_a_wall": _along_a_wall, "in_the_open": _in_the_open,
    "spin": _spin, "walls_all_round": _walls_all_round, "pushed": _pushed, "wander": _wander,
}  # fmt: skip


def ticks_of(segments):
    """The stream itself: lists of VALUES ints, numbered from 1 without a gap."""
    step = 0
    for segment in segments:
        rng = random.Random(f"{segment.kind} {segment.seed}")
        fill = KINDS[segment.kind]
        for tick in range(segment.ticks):
            step += 1
            values = [0] * VALUES
            values[0] = step
            fill(rng, values, tick)
            yield values


def streams(max_segments=8, max_ticks=400):
    segment = st.builds(Segment, st.sampled_from(sorted(KINDS)), st.integers(1, max_ticks), st.integers(0, 9999))
    return st.lists(segment, min_size=1, max_size=max_segments)


@st.composite
def settings_of_a_robot(draw, changes=12):
    """Legal parameters: [(id, index, value)], a few of them changed from their defaults, ends of ranges among them."""
    chosen = []
    for _ in range(draw(st.integers(0, changes))):
        number = draw(st.integers(0, len(PARAMETERS) - 1))
        _name, _unit, count, minimum, maximum, _default = PARAMETERS[number]
        value = draw(st.one_of(st.sampled_from((minimum, maximum)), st.integers(minimum, maximum)))
        chosen.append((number, draw(st.integers(0, count - 1)), value))
    return chosen
