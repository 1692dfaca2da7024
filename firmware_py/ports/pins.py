# The robot's own sensors and motors on the pins of a board: what the virtual robot is to a core at a host.
# It has been tried on a fake `machine` only (tests/board/fake_machine.py), not on silicon. docs/porting.md has the wiring.

import time

_TICK_PER_S = const(50)
_FULL = const(65535)            # of a PWM's duty
_SETTLE_US = const(20)          # a multiplexer's output after its inputs have changed
_SONAR_TICKS = const(3)         # 60 ms between two pulses, as the part asks for
_SONAR_MAX_MM = const(3000)
_SONAR_MIN_MM = const(20)
_SONAR_HELD_US = const(40000)   # no echo keeps the line up for about that long
_NO_ECHO = const(65535)         # as STEP has it
_INTEGRAL_MAX = const(3000)     # mm/s, summed over the ticks
_DUTY_PER_MM_S = const(40)      # of the speed's error, at once
_DUTY_PER_SUM = const(8)        # of its sum


class Encoder:
    # Two channels in quadrature, counted at both edges of A: pulses_per_turn is twice A's periods a wheel turn.
    # read() -> pulses since the last read, forward positive; swap A and B if it counts backwards.

    def __init__(self, a, b):
        self._a = a
        self._b = b
        self._count = 0
        self._read = 0
        edge = self._edge   # made once: a bound method is an object
        edges = a.IRQ_RISING | a.IRQ_FALLING
        try:
            a.irq(handler=edge, trigger=edges, hard=True)
        except TypeError:
            a.irq(handler=edge, trigger=edges)  # a port without hard interrupts

    def _edge(self, _pin):
        if self._a.value() == self._b.value():
            self._count -= 1
        else:
            self._count += 1

    def read(self):
        n = self._count
        pulses = n - self._read
        self._read = n
        return pulses


class Infrared:
    # Eight Sharp GP2Y0A41SK0F, I1 to I8: an ADC each, or one ADC behind an 8-to-1 multiplexer with the pins `select`,
    # lowest bit first. 1023 counts are 3.3 V at the sensor: the core's curve is for that.

    def __init__(self, adcs, select=()):
        if len(adcs) != (1 if len(select) else 8) or len(select) not in (0, 3):
            raise ValueError("give eight ADCs, or one ADC and three select pins")
        self._adcs = adcs
        self._select = select

    def read_into(self, values, first):
        for i in range(8):
            k = i
            if len(self._select):
                for bit in range(3):
                    self._select[bit].value(i >> bit & 1)
                time.sleep_us(_SETTLE_US)
                k = 0
            values[first + i] = self._adcs[k].read_u16() >> 6


class Ultrasonic:
    # HC-SR04 class. read(), once a tick -> mm, 0 between the pulses, 65535 without an echo; never waits for one.

    def __init__(self, trigger, echo):
        self._trigger = trigger
        self._echo = echo
        self._tick = 0
        self._rose_us = 0
        self._width_us = 0      # 0: no echo has ended yet
        trigger.value(0)
        echo.irq(handler=self._edge, trigger=echo.IRQ_RISING | echo.IRQ_FALLING)

    def _edge(self, _pin):
        if self._echo.value():
            self._rose_us = time.ticks_us()
        else:
            self._width_us = time.ticks_diff(time.ticks_us(), self._rose_us)

    def read(self):
        self._tick += 1
        if self._tick < _SONAR_TICKS:
            return 0
        self._tick = 0
        width_us = self._width_us
        self._width_us = 0
        self._trigger.value(1)
        time.sleep_us(10)
        self._trigger.value(0)
        if width_us <= 0 or width_us > _SONAR_HELD_US:
            return _NO_ECHO
        mm = width_us * 11 >> 6     # there and back at 343 m/s
        return _NO_ECHO if mm > _SONAR_MAX_MM else mm if mm > _SONAR_MIN_MM else _SONAR_MIN_MM


class Wheel:
    # An encoder and an H-bridge with two inputs, each a PWM (DRV8833 class). drive(mm_s) once a tick: the duty that
    # the speed needs without load, and what the encoder says is missing. um_per_pulse is the wheel's way for one pulse.

    def __init__(self, encoder, forward, backward, um_per_pulse, full_mm_s):
        self._encoder = encoder
        self._forward = forward
        self._backward = backward
        self._um_per_pulse = um_per_pulse
        self._full_mm_s = full_mm_s     # at full duty
        self._pulses = 0
        self._sum = 0

    def read(self):
        self._pulses = self._encoder.read()
        return self._pulses

    def drive(self, mm_s):
        if mm_s == 0:
            self._sum = 0
            self._put(0)
            return
        error = mm_s - self._pulses * self._um_per_pulse * _TICK_PER_S // 1000
        self._sum = min(max(self._sum + error, -_INTEGRAL_MAX), _INTEGRAL_MAX)
        self._put(mm_s * _FULL // self._full_mm_s + error * _DUTY_PER_MM_S + self._sum * _DUTY_PER_SUM)

    def _put(self, duty):
        self._forward.duty_u16(min(max(duty, 0), _FULL))
        self._backward.duty_u16(min(max(-duty, 0), _FULL))


class Robot:
    # left, right: Wheel. bumpers: pairs (pin, sectors), pressed is low; bit 0 of sectors is ahead, the next 45 degrees
    # to the left of it. start: the button, pressed is low. parameters: {name of protocol/parameters.py: values}.
    # sense(values) fills a STEP as the virtual robot does; there is no driver for UWB yet. Allocates in __init__ only.

    def __init__(self, left, right, infrared, ultrasonic, bumpers, start, parameters):
        self.parameters = parameters
        self._left = left
        self._right = right
        self._infrared = infrared
        self._ultrasonic = ultrasonic
        self._bumpers = bumpers
        self._start = start
        self._started = False

    def started(self):
        if not self._started and not self._start.value():
            self._started = True
            self._left.read()   # how it was carried to its place is no way that it drove
            self._right.read()
        return self._started

    def sense(self, values):
        values[1] = self._left.read()
        values[2] = self._right.read()
        self._infrared.read_into(values, 3)
        values[11] = self._ultrasonic.read()
        touched = 0
        for i in range(len(self._bumpers)):
            if not self._bumpers[i][0].value():
                touched |= self._bumpers[i][1]
        values[12] = touched
        values[13] = 0

    def drive(self, left_mm_s, right_mm_s):
        self._left.drive(left_mm_s)
        self._right.drive(right_mm_s)

    def stop(self):
        self.drive(0, 0)
