# What shall go wrong: the text of --faults, read into a plan. docs/protocol.md has the whole of it.
#
#   drop=0.1 flip=0.01 dup=0.05 reorder=0.05        of each frame and direction, a probability
#   delay=20ms  delay=20ms:0.3                      every frame, or with that probability
#   drop@down=12  flip@up=40:97  delay@up=7:20ms    the 12th frame down; of the 40th up bit 97
#   cut@step=500:2s  reset@step=900                 when that step is sent; also @down, @up
#   loss=0.01  full=0.01  busy=0.5                  of CAN frames, on --link slcan
#   busoff@step=300:50ms  full@step=300:100ms       of CAN controllers
#   power@byte=7000                                 when that byte of the non-volatile memory is written
#   uwb=off  infrared=stuck@step=300:200            a sensor, from step 300 on for 200 steps
#
# Items are separated by commas or ends of line; after # stands a comment; @FILE is the file of that name.

import os
import re
from dataclasses import dataclass, field

CHANCES = ("drop", "flip", "dup", "reorder", "delay")
BUS_CHANCES = ("loss", "full", "busy")
BUS_EVENTS = ("busoff", "full")
EVENTS = ("cut", "reset", *BUS_EVENTS)
BUSY_MAX = 0.95
WAYS = ("down", "up")
SENSORS = ("encoder", "infrared", "ultrasonic", "uwb")
KINDS = ("off", "stuck", "garbage", "wrong", "slow", "delayed", "intermittent")
BITS_MAX = 8 * 108
STEP_MAX = (1 << 30) - 1
FOR_EVER = STEP_MAX + 1
FILE_MAX = 1 << 20
ITEM_MAX = 60
_TIME = re.compile(r"([0-9]{1,6}(?:\.[0-9]{1,6})?)(ms|s)")
_WAY_OUT = "give items like drop=0.1, delay=20ms, flip@up=40:97, cut@step=500:2s, reset@step=900 or uwb=off@step=300:200"


class FaultError(Exception):
    """One sentence: which item, what is wrong with it."""


# `kind` of SENSORS' KINDS, from step `first` on, before step `end`.
@dataclass
class SensorFault:
    sensor: str
    kind: str
    first: int = 0
    end: int = FOR_EVER


# chances: {kind: probability}; bus: those of CAN frames. frames: {(way, number): [(kind, bit or seconds)]}, numbers from 1.
# events: {(where, number): [(kind, seconds)]}, where one of step, down, up. power: [byte numbers].
@dataclass
class Plan:
    chances: dict = field(default_factory=dict)
    delay_s: float = 0.0
    bus: dict = field(default_factory=dict)
    frames: dict = field(default_factory=dict)
    events: dict = field(default_factory=dict)
    sensors: list = field(default_factory=list)
    power: list = field(default_factory=list)

    @property
    def of_the_link(self):
        return bool(any(self.chances.values()) or self.frames or self.events or self.power)

    @property
    def of_the_bus(self):
        return bool(self.bus) or any(kind in BUS_EVENTS for events in self.events.values() for kind, _ in events)


def parse(text):
    """The Plan that this text means. FaultError otherwise."""
    if text.startswith("@"):
        text = _file(text[1:])
    plan = Plan()
    for line in text.splitlines():
        for item in line.partition("#")[0].split(","):
            item = item.strip()
            if len(item) > ITEM_MAX or not item.isprintable():
                raise FaultError("--faults %r%s is no item of a list of faults; %s" % (item[:40], "..." * (len(item) > 40), _WAY_OUT))
            if item:
                _add(plan, item)
    return plan


def plain(number):
    """As _add() reads it."""
    return ("%.6f" % number).rstrip("0").rstrip(".")


def _file(path):
    try:
        if os.path.getsize(path) > FILE_MAX:
            raise FaultError("--faults @%s: it is larger than %d bytes; give a list of faults" % (path, FILE_MAX))
        with open(path, encoding="utf-8") as file:
            return file.read()
    except (OSError, UnicodeDecodeError) as error:
        raise FaultError("--faults @%s cannot be read (%s); give a file of faults" % (
            path, getattr(error, "strerror", None) or "it is no text")) from None


def _add(plan, item):
    name, equals, value = item.partition("=")
    kind, at, where = name.partition("@")
    if equals and kind in SENSORS and not at:
        plan.sensors.append(_sensor(item, kind, value))
    elif equals and kind in CHANCES and not at:
        _chance(plan, item, kind, value)
    elif equals and kind in BUS_CHANCES and not at:
        plan.bus[kind] = _probability(item, value, BUSY_MAX if kind == "busy" else 1)
    elif equals and kind in CHANCES and where in WAYS:
        number, _, detail = value.partition(":")
        plan.frames.setdefault((where, _number(item, number, STEP_MAX, 1)), []).append((kind, _detail(item, kind, detail)))
    elif equals and kind in EVENTS and where in ("step", *WAYS):
        number, _, detail = value.partition(":")
        plan.events.setdefault((where, _number(item, number, STEP_MAX, where in WAYS)), []).append((kind, _detail(item, kind, detail)))
    elif equals and name == "power@byte":
        plan.power.append(_number(item, value, STEP_MAX))
    else:
        raise FaultError("--faults %s is unknown; %s" % (item, _WAY_OUT))


def _chance(plan, item, kind, value):
    if kind == "delay":
        length, _, value = value.partition(":")
        plan.delay_s = _seconds(item, length)
        value = value or "1"
    plan.chances[kind] = _probability(item, value)


def _probability(item, text, largest=1):
    if not re.fullmatch(r"[01]|[01]?\.[0-9]{1,6}", text) or float(text) > largest:
        raise FaultError("--faults %s: %s is no probability from 0 to %g; give one like 0.1" % (item, text or "nothing", largest))
    return float(text)


def _detail(item, kind, text):
    if kind == "flip":
        return _number(item, text, BITS_MAX - 1)
    if kind in ("delay", "cut", "full") or kind == "busoff" and text:
        return _seconds(item, text)
    if text:
        raise FaultError("--faults %s: %s takes nothing after its number; leave out :%s" % (item, kind, text))
    return None


def _sensor(item, sensor, value):
    kind, at, when = value.partition("@step=")
    if kind not in KINDS:
        raise FaultError("--faults %s: %s is no fault of a sensor; there are %s" % (item, kind or "nothing", ", ".join(KINDS)))
    fault = SensorFault(sensor, kind)
    if at:
        first, colon, length = when.partition(":")
        fault.first = _number(item, first, STEP_MAX)
        fault.end = fault.first + _number(item, length, STEP_MAX, 1) if colon else FOR_EVER
    return fault


def _number(item, text, largest, least=0):
    if not re.fullmatch(r"[0-9]{1,10}", text) or not least <= int(text) <= largest:
        raise FaultError("--faults %s: %s is no whole number from %d to %d" % (item, text or "nothing", least, largest))
    return int(text)


def _seconds(item, text):
    found = _TIME.fullmatch(text)
    if not found:
        raise FaultError("--faults %s: %s is no time; give one like 20ms or 2s" % (item, text or "nothing"))
    return float(found[1]) * (0.001 if found[2] == "ms" else 1)
