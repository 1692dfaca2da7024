# Sensors that fail: what the robot senses, made worse on its way into the STEP.
#
#   off           nothing: no pulses, no light back, no echo measured, no transmitter heard
#   stuck         what it said last before the fault, again and again
#   garbage       anything that its wires can carry
#   wrong         the truth, but off: wheels 10 % long, infrared 30 % bright, ultrasonic 0.2 m far, UWB 3 dB loud and 1 m far
#   slow          five times as seldom; pulses gather meanwhile
#   delayed       0.2 s late
#   intermittent  off in three ticks of ten, by chance

import random
from collections import deque

SLOW = 5
DELAY_TICKS = 10
OFF_CHANCE = 0.3
PULSES_MAX = 50         # of garbage, a tick: faster than the wheels can be
LEVELS_CDB = (-12000, 0)
RANGE_MAX_MM = 20000
RECORDS_MAX = 15
NO_ECHO = 65535

# by sensor the place in the values of STEP; UWB has a count and its records of three
_PLACES = {"encoder": (1, 3), "infrared": (3, 11), "ultrasonic": (11, 12), "uwb": (13, 14 + 3 * RECORDS_MAX)}


# One fault of one sensor. spoil(values, active) sees every tick, as what a sensor said before is its business, and changes
# the values while it is active. Pulses that an encoder holds back come later, also when the fault is over: none is lost but to off,
# stuck, garbage and intermittent.
class _Spoiled:
    def __init__(self, fault, anchors, seed):
        self.fault = fault
        self._first, self._end = _PLACES[fault.sensor]
        self._anchors = max(anchors, 1)
        self._random = random.Random("%d %s %s" % (seed, fault.sensor, fault.kind))
        self._last = None       # what it said when it last said something
        self._late = deque()
        self._ticks = 0
        self._gathered = [0, 0]

    def spoil(self, values, active):
        said = list(values[self._first:self._end])
        if not active:
            if self._speaks(said):
                self._last = said
            if self.fault.sensor == "encoder":
                self._catch_up(values)
            return
        spoilt = getattr(self, "_" + self.fault.kind)(said)
        for i, value in enumerate(spoilt):
            values[self._first + i] = value

    def _catch_up(self, values):
        """What is late comes a tick's worth at a time."""
        late = self._late.popleft() if self._late else (0, 0)
        for i in range(2):
            values[self._first + i] += late[i] + self._gathered[i]
        self._gathered = [0, 0]

    def _speaks(self, said):
        return self.fault.sensor in ("encoder", "infrared") or said[0] != 0

    def _off(self, said):
        return [0] * len(said)

    def _stuck(self, said):
        if not self._speaks(said):
            return said
        self._last = self._last or said
        return self._last

    def _garbage(self, said):
        if not self._speaks(said):
            return said
        draw = self._random.randint
        if self.fault.sensor == "encoder":
            return [draw(-PULSES_MAX, PULSES_MAX) for _ in said]
        if self.fault.sensor == "infrared":
            return [draw(0, 1023) for _ in said]
        if self.fault.sensor == "ultrasonic":
            return [draw(1, NO_ECHO)]
        count = draw(0, RECORDS_MAX)
        records = [value for _ in range(count) for value in (draw(0, self._anchors - 1), draw(*LEVELS_CDB), draw(0, RANGE_MAX_MM))]
        return ([count] + records + said)[:len(said)]

    def _wrong(self, said):
        if self.fault.sensor == "encoder":
            return [round(pulses * 1.1) for pulses in said]
        if self.fault.sensor == "infrared":
            return [min(round(counts * 1.3), 1023) for counts in said]
        if self.fault.sensor == "ultrasonic":
            return said if said[0] in (0, NO_ECHO) else [said[0] + 200]
        for at in range(1, 1 + 3 * said[0], 3):
            said[at + 1] = min(said[at + 1] + 300, 0)
            said[at + 2] = min(said[at + 2] + 1000, 65534) if said[at + 2] else 0
        return said

    def _slow(self, said):
        self._ticks += self._speaks(said)
        if self.fault.sensor == "encoder":
            self._gathered = [held + pulses for held, pulses in zip(self._gathered, said)]
            if self._ticks % SLOW:
                return [0, 0]
            said, self._gathered = self._gathered, [0, 0]
            return said
        if self._ticks % SLOW == 0 and self._speaks(said) or self._last is None:
            self._last = said
            return said
        return self._last if self.fault.sensor == "infrared" else [0] * len(said)

    def _delayed(self, said):
        self._late.append(said)
        return self._late.popleft() if len(self._late) > DELAY_TICKS else [0] * len(said)

    def _intermittent(self, said):
        return self._off(said) if self._random.random() < OFF_CHANCE else said


# Stands in for the robot that it wraps: sense() with faults, all else as it is.
class FaultySensors:
    def __init__(self, robot, faults, seed):
        self._robot = robot
        self._spoiled = [_Spoiled(fault, len(robot.anchors), seed) for fault in faults]
        self._step = 0

    def __getattr__(self, name):
        return getattr(self._robot, name)

    def sense(self, values):
        """As the robot's; values[0] is the step's number."""
        self._robot.sense(values)
        self._step = values[0]
        for spoiled in self._spoiled:
            spoiled.spoil(values, spoiled.fault.first <= values[0] < spoiled.fault.end)

    def missed(self):
        """Items of the plan whose first step never came."""
        faults = [spoiled.fault for spoiled in self._spoiled]
        return ["%s=%s@step=%d" % (fault.sensor, fault.kind, fault.first) for fault in faults if fault.first > self._step]
