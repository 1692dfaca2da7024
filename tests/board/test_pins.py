# The drivers of firmware_py/ports/pins.py on a fake `machine`, and a whole mission of a robot that has no host: the
# program in examples/, real core, every reading through pins.

import json
import runpy

import pytest

from host_tools.score import HomeTruth, score_map
from protocol import states
from sim_device.config import load_robot
from sim_device.home import load_home
from sim_device.virtual_robot import VirtualRobot
from tests.board import fake_machine
from tests.board.fake_machine import ADC, PWM, Pin, Wiring, turn
from tests.host_tools.test_hil_mission import SMALL
from tests.stories.mission import NUMBERS, map_of

ROBOT_MAIN = "examples/robot_main.py"
TICK_MS = 20


@pytest.fixture
def board(monkeypatch):
    return fake_machine.load(monkeypatch)


# The link of a robot that drives alone: nobody is there. While the core waits, the world goes on, tick by tick.
class NobodyThere:
    heap_code_bytes = heap_bytes = heap_boot_bytes = locked = 0
    is_repl = True

    def __init__(self, clock, live, max_ticks):
        self.clock, self.live, self.left = clock, live, max_ticks
        self.sent = 0

    def open(self, stream, buf):
        assert stream is None and len(buf)

    def read(self, wait_ms):
        self.clock.now_us += wait_ms * 1000
        self.left -= 1
        return 0 if self.left > 0 and self.live() else -1

    def write(self, buf, size):
        self.sent += size

    def ticks_ms(self):
        return self.clock.ticks_ms() & 0x3FFFFFF

    def random(self):
        return 7

    def heap_used(self):
        return 0

    def lock(self):
        pass

    unlock = close = restart = lock


def run_robot(board, project, monkeypatch, live, max_ticks):
    """examples/robot_main.py with live(the core) between its ticks; -> its Device."""
    main_board, _, clock = board
    devices = []

    class Device(main_board.Device):
        def __init__(self, port, boot_id):
            super().__init__(port, boot_id)
            devices.append(self)

    monkeypatch.setattr(main_board, "Device", Device)
    monkeypatch.setattr(main_board, "Port", lambda: NobodyThere(clock, lambda: live(devices[0].core), max_ticks))
    runpy.run_path(str(project / ROBOT_MAIN))
    return devices[0]


def test_a_robot_maps_a_room_by_its_own_sensors(board, project, monkeypatch, tmp_path):
    path = tmp_path / "small.json"
    path.write_text(json.dumps(SMALL))
    home = load_home(str(path))
    virtual = VirtualRobot(home, load_robot(), 1, "none", "calibrated")
    world = []

    def live(core):
        if not world:
            world.append(Wiring(virtual, board[2], full_mm_s=500))   # weaker than the program has it
            Pin.board[18].level = 0     # the button
            for name, metres in zip(("dock_x", "dock_y"), home.start):  # so that map and truth have one origin
                assert core.set_parameter(NUMBERS[name], 0, round(metres * 1e6)) == 0
        else:
            Pin.board[18].level = 1
            world[0].drive()
            world[0].sense()
        return core.state not in (states.DONE, states.FAILED)

    device = run_robot(board, project, monkeypatch, live, 20000)
    assert device.core.state == states.DONE and device.core.finished, states.NAMES[device.core.state]
    score = score_map(HomeTruth(home), map_of(device.core))
    assert score["outline_precision_5cm"] > 0.9 and score["outline_recall_5cm"] > 0.9, score
    assert device.port.sent > 20 * device.step_number   # a monitor would have seen it
    assert all(pwm.duty == 0 for pwm in PWM.board.values())


def test_it_stands_until_the_button_is_pressed(board, project, monkeypatch):
    def live(core):
        assert core.state == states.BOOT and all(pwm.duty == 0 for pwm in PWM.board.values())
        return True
    assert run_robot(board, project, monkeypatch, live, 200).step_number == 0


def test_its_wheels_stop_when_the_core_fails(board, project, monkeypatch):
    def live(core):
        PWM.board[6].duty = 30000
        raise RuntimeError
    with pytest.raises(RuntimeError):
        run_robot(board, project, monkeypatch, live, 9)
    assert all(pwm.duty == 0 for pwm in PWM.board.values())


def test_the_example_is_the_reference_robot(board, project, monkeypatch):
    device = run_robot(board, project, monkeypatch, lambda core: True, 1)
    table = device.core.parameters
    for name, values in load_robot().parameters().items():
        first = table.first(name)
        assert list(table.values[first:first + len(values)]) == values, name


def test_a_parameter_that_cannot_be_is_named(board):
    class Core:
        set_parameter = staticmethod(lambda number, index, value: 2)
    with pytest.raises(ValueError, match="parameter track cannot be 5"):
        board[0].tell(Core, {"track": (5,)})


@pytest.mark.parametrize("steps", [(5,), (-7,), (3, -3, 4), (1000,), (0,)])
def test_an_encoder_counts_both_ways(board, steps):
    a, b = Pin(2), Pin(3)
    encoder = board[1].Encoder(a, b)
    at = 0
    for pulses in steps:
        at = turn(a, b, at, pulses)
        assert encoder.read() == pulses
    assert encoder.read() == 0


def test_an_encoder_on_a_port_without_hard_interrupts(board, monkeypatch):
    def irq(pin, handler, trigger):
        pin.handler = handler
    monkeypatch.setattr(Pin, "irq", irq)
    a, b = Pin(2), Pin(3)
    encoder = board[1].Encoder(a, b)
    turn(a, b, 0, 4)
    assert encoder.read() == 4


def test_infrared_by_eight_adcs_or_through_a_multiplexer(board):
    ADC.source = lambda number: number * 1000
    values = [0] * 12
    board[1].Infrared([ADC(Pin(i)) for i in range(8)]).read_into(values, 3)
    assert values == [0, 0, 0, *(i * 1000 >> 6 for i in range(8)), 0]
    select = [Pin(20 + bit) for bit in range(3)]
    ADC.source = lambda number: 65535 - sum(pin.level << bit for bit, pin in enumerate(select))*1000
    board[1].Infrared([ADC(Pin(26))], select).read_into(values, 3)
    assert values[3:11] == [65535 - i * 1000 >> 6 for i in range(8)]
    with pytest.raises(ValueError, match="eight ADCs, or one ADC and three select pins"):
        board[1].Infrared([ADC(Pin(26))])


@pytest.mark.parametrize("mm, expected", [(500, 500), (1200, 1200), (5, 20), (2900, 2900), (3200, 65535), (7000, 65535), (None, 65535)])
def test_ultrasonic(board, mm, expected):
    _, pins, clock = board
    trigger, echo = Pin(13), Pin(14)

    def hear():
        if mm:
            echo.put(1)
            clock.now_us += round(mm / 0.1715)
            echo.put(0)
    trigger.on_rise = hear
    clock.now_us = (1 << 30) - 2000     # ticks_us wraps on the way
    sonar = pins.Ultrasonic(trigger, echo)
    readings = [sonar.read() for _ in range(9)]
    assert readings[:2] == [0, 0] and readings[3:5] == [0, 0] and readings[2] == 65535   # nothing was sent before the first
    for reading in (readings[5], readings[8]):
        assert reading == pytest.approx(expected, abs=8)


@pytest.mark.parametrize("wanted", [250, -250, 60, 0])
@pytest.mark.parametrize("full_mm_s", [400, 600, 800])
def test_a_wheel_keeps_its_speed_with_a_motor_unlike_its_data_sheet(board, wanted, full_mm_s):
    a, b, forward, backward = Pin(2), Pin(3), PWM(Pin(6), 1, 0), PWM(Pin(7), 1, 0)
    wheel = board[1].Wheel(board[1].Encoder(a, b), forward, backward, 445, 600)
    at, way_um, ways = 0, 0, []
    for _ in range(200):
        speed = (forward.duty - backward.duty) * full_mm_s / 65535
        way_um += speed * TICK_MS
        ways.append(way_um)
        at = turn(a, b, at, int(way_um // 445) - at // 2)
        wheel.read()
        wheel.drive(wanted)
        assert forward.duty == 0 or backward.duty == 0
    assert (ways[-1] - ways[100]) / 99 / TICK_MS == pytest.approx(wanted, abs=8)
