# A fake `machine` on which firmware_py/ports/pins.py and examples/robot_main.py run here: pins, PWM and ADC wired to the
# virtual robot. What a robot's parts do is imitated edge by edge: encoders turn, the echo's line rises and falls.

import importlib
import sys
import types
from array import array

from protocol.schema import VALUES_MAX

OURS = ("firmware_py.ports.machine", "firmware_py.ports.pins", "firmware_py.main_board")
QUADRATURE = ((0, 0), (1, 0), (1, 1), (0, 1))   # A leads B: forward


class Pin:
    IN, OUT, PULL_UP, IRQ_RISING, IRQ_FALLING = 0, 1, 2, 1, 2
    board = {}      # number: Pin

    def __init__(self, number, mode=IN, pull=None):
        self.number = number
        self.level = 1 if pull == Pin.PULL_UP else 0
        self.handler = self.on_rise = None
        Pin.board[number] = self

    def irq(self, handler, trigger, hard=False):
        assert trigger == Pin.IRQ_RISING | Pin.IRQ_FALLING
        self.handler = handler

    def value(self, level=None):
        if level is None:
            return self.level
        rose, self.level = level and not self.level, level
        if rose and self.on_rise:
            self.on_rise()

    def put(self, level):
        """From outside: its interrupt comes."""
        if level != self.level:
            self.level = level
            if self.handler:
                self.handler(self)


class PWM:
    board = {}

    def __init__(self, pin, freq, duty_u16):
        PWM.board[pin.number] = self
        self.duty = duty_u16

    def duty_u16(self, duty):
        assert 0 <= duty <= 65535
        self.duty = duty


class ADC:
    source = None   # the pin's number -> 0..65535

    def __init__(self, pin):
        self.number = pin.number

    def read_u16(self):
        return ADC.source(self.number)


# Time as the core and the drivers see it; nothing passes by itself.
class Clock:
    def __init__(self):
        self.now_us = 0

    def ticks_us(self):
        return self.now_us & 0x3FFFFFFF

    def ticks_ms(self):
        return self.now_us // 1000 & 0x3FFFFFFF

    def ticks_diff(self, a, b):
        return (a - b + 0x20000000 & 0x3FFFFFFF) - 0x20000000

    def sleep_us(self, us):
        self.now_us += us

    def sleep_ms(self, ms):
        self.now_us += ms * 1000


def load(monkeypatch):
    """The board's modules of the core, on the fake ones: (main_board, pins, clock). `machine` stays until the test ends."""
    importlib.import_module("firmware_py.device")   # before there is a micropython that has no emitter
    clock = Clock()
    modules = {name: types.ModuleType(name) for name in ("machine", "micropython", "gc", "time")}
    modules["machine"].Pin, modules["machine"].PWM, modules["machine"].ADC = Pin, PWM, ADC
    modules["gc"].collect = modules["gc"].mem_alloc = modules["gc"].mem_free = lambda: 0
    for name in ("ticks_us", "ticks_ms", "ticks_diff", "sleep_us", "sleep_ms"):
        setattr(modules["time"], name, getattr(clock, name))
    Pin.board.clear()
    PWM.board.clear()
    with monkeypatch.context() as patch:
        for name, module in modules.items():
            patch.setitem(sys.modules, name, module)
        patch.setitem(sys.modules, "firmware_py.ports.rolling_viper", None)     # no emitter
        for name in OURS:
            patch.delitem(sys.modules, name, raising=False)
        loaded = [importlib.import_module(name) for name in OURS]
    for name, module in zip(OURS, loaded):
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setitem(sys.modules, "machine", modules["machine"])
    return loaded[2], loaded[1], clock


# The wires of examples/robot_main.py between the fake pins and a virtual robot. The quadrature is walked through edge
# by edge; the wheels' speeds follow the duty of their PWMs, at full duty `full_mm_s`.
class Wiring:
    def __init__(self, robot, clock, full_mm_s):
        self.robot, self.clock, self.full_mm_s = robot, clock, full_mm_s
        self.values = array("i", bytes(4 * VALUES_MAX))
        self.turned = [0, 0]
        self.heard_mm = 0
        for number in (2, 3, 4, 5):
            Pin.board[number].level = 0
        ADC.source = lambda _: self.values[3 + sum(Pin.board[10 + bit].level << bit for bit in range(3))] << 6
        Pin.board[13].on_rise = self._echo
        self.sense()

    def _echo(self):
        now_us = self.clock.now_us
        Pin.board[14].put(1)
        self.clock.now_us += 38000 if self.heard_mm == 65535 else round(self.heard_mm / 0.1715)
        Pin.board[14].put(0)
        self.clock.now_us = now_us

    def sense(self):
        self.robot.sense(self.values)
        self.heard_mm = self.values[11] or self.heard_mm
        for side, (a, b) in enumerate(((2, 3), (4, 5))):
            self.turned[side] = turn(Pin.board[a], Pin.board[b], self.turned[side], self.values[1 + side])
        Pin.board[16].put(0 if self.values[12] & 0b00000011 else 1)
        Pin.board[17].put(0 if self.values[12] & 0b10000001 else 1)

    def drive(self):
        self.robot.drive(self._speed(6, 7), self._speed(8, 9))

    def _speed(self, forward, backward):
        return (PWM.board[forward].duty - PWM.board[backward].duty) * self.full_mm_s // 65535


def turn(a, b, at, pulses):
    """Turn a wheel's two channels by so many pulses, two edges each; -> where it stands then."""
    for _ in range(2 * abs(pulses)):
        at += 1 if pulses > 0 else -1
        level_a, level_b = QUADRATURE[at % 4]
        a.put(level_a)
        b.put(level_b)
    return at
