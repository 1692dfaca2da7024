# The text of --faults: what it means, and one sentence for what means nothing; the sensors that fail.

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.host_link import HostLink
from protocol.messages import BY_NAME
from sim_device import cli
from sim_device.faults import KINDS, SENSORS, FaultError, SensorFault, parse
from sim_device.links.faulty import FaultyLink
from sim_device.links.memory import MemoryLink
from sim_device.sensors.faulty import FaultySensors
from tests.sim_device.faulty_mission import CORE, Outcome, calm, mission

FULL = """drop=0.1,flip=0.01,dup=0.05   # of each frame
reorder=0.05, delay=20ms:0.5, drop@down=12, flip@up=40:97
cut@step=500:2s, reset@step=900, delay@up=7:1.5ms
uwb=off@step=300:200, infrared=stuck, encoder=slow@step=7
loss=0.01, full=0.02, busy=0.5, busoff@down=9, busoff@step=500:50ms, full@step=900:100ms
"""


def test_every_item_is_read(tmp_path):
    (tmp_path / "f").write_text(FULL)
    for text in (FULL, "@%s" % (tmp_path / "f")):
        plan = parse(text)
        assert plan.chances == {"drop": 0.1, "flip": 0.01, "dup": 0.05, "reorder": 0.05, "delay": 0.5} and plan.delay_s == 0.02
        assert plan.frames == {("down", 12): [("drop", None)], ("up", 40): [("flip", 97)], ("up", 7): [("delay", 0.0015)]}
        assert plan.events == {("step", 500): [("cut", 2.0), ("busoff", 0.05)], ("step", 900): [("reset", None), ("full", 0.1)],
                               ("down", 9): [("busoff", None)]}
        assert plan.bus == {"loss": 0.01, "full": 0.02, "busy": 0.5} and plan.of_the_bus
        assert plan.sensors == [SensorFault("uwb", "off", 300, 500), SensorFault("infrared", "stuck"), SensorFault("encoder", "slow", 7)]
        assert plan.of_the_link
    again = parse("drop=0.1,drop=0,dup=0,dup=0.2")
    assert again.chances == {"drop": 0, "dup": 0.2}, "the last one wins"
    assert not parse("uwb=off").of_the_link and not parse("drop=0").of_the_link and not parse("drop=0.1,cut@step=3:1s").of_the_bus
    assert parse("busoff@step=3").of_the_bus and parse("loss=0.1").of_the_bus and not parse("loss=0.1").of_the_link


@pytest.mark.parametrize("text, words", [
    ("drop=2", "drop=2: 2 is no probability"), ("drop=", "nothing is no probability"), ("drop=-0.1", "no probability"),
    ("flip", "flip is unknown; give items like"), ("shake=0.1", "is unknown"), ("drop@left=3", "is unknown"), ("cut=2s", "is unknown"),
    ("delay=20", "20 is no time; give one like 20ms"), ("delay=20ms:2", "no probability"), ("cut@step=5", "nothing is no time"),
    ("flip@up=3:9999", "9999 is no whole number from 0 to 863"), ("drop@up=3:4", "leave out :4"), ("reset@step=x", "x is no whole number"),
    ("reset@step=9999999999", "no whole number"), ("uwb=loud", "loud is no fault of a sensor; there are off, stuck"),
    ("uwb=off@step=", "nothing is no whole number"), ("uwb=off@step=3:x", "x is no whole number"), ("sonar=off", "is unknown"),
    ("busy=1", "busy=1: 1 is no probability from 0 to 0.95"), ("loss=0.1,full@step=9", "full@step=9: nothing is no time"),
    ("loss@step=9", "is unknown"), ("busoff=0.1", "is unknown"), ("busoff@step=9:soon", "soon is no time"),
    ("drop@down=0", "0 is no whole number from 1 to"), ("reset@up=0", "0 is no whole number from 1 to"),
    ("uwb=off@step=5:0", "0 is no whole number from 1 to"),
    ("power@byte=", "nothing is no whole number"), ("power@step=9", "is unknown"),
    ("@/nowhere/f", "cannot be read"), ("@/", "cannot be read"),
])
def test_what_means_nothing_is_said_in_one_sentence(text, words, capsys):
    with pytest.raises(FaultError, match="--faults"):
        parse(text)
    assert cli.main(["studio", "--core", CORE, "--faults", text]) == cli.EXIT_BAD_INPUT
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1 and words in said[0]


@pytest.mark.parametrize("text", ["loss=0.1", "full=0.1", "busy=0.1", "busoff@step=9", "full@down=9:10ms"])
def test_a_fault_of_a_can_bus_needs_one(text, capsys):
    assert cli.main(["studio", "--core", CORE, "--faults", text]) == cli.EXIT_BAD_INPUT
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1 and "faults of a CAN bus, and %s is none; use hil --link slcan" % CORE in said[0]


def test_power_is_not_lost_at_a_memory_that_is_not_there(capsys):
    assert cli.main(["studio", "--core", CORE, "--nvm", "none", "--faults", "power@byte=7"]) == cli.EXIT_BAD_INPUT
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1 and "power@byte=7: there is no memory to write with --nvm none" in said[0]


def test_what_never_came_is_said(capsys):
    never = ["reset@step=77", "cut@down=9999", "drop@up=9998", "uwb=off@step=51", "power@byte=9997"]
    faults = "reset@step=5,drop@up=3,infrared=stuck@step=50:9," + ",".join("%s:1s" % item if "cut" in item else item for item in never)
    assert cli.main(["studio", "--core", CORE, "--max-robot-s", "1", "--faults", faults]) == cli.EXIT_NOT_FINISHED
    said = capsys.readouterr().err.splitlines()
    for item in never:
        assert "--faults %s never came: the mission was over before." % item in said
    assert sum("never came" in line for line in said) == len(never)
    assert "Fault: the core is reset at step 5." in said and "The core had stored nothing yet: its mission begins again." in said


@pytest.mark.parametrize("text", ["delay@up=3:0.01ms", "cut@step=3:123456.7s", "delay@down=2:0.000123s"])
def test_what_a_mission_met_is_kept_as_it_was(text):
    plan, done = parse(text), []
    link = FaultyLink(MemoryLink(CORE), plan, 1, None)
    (place, faults), = (plan.frames or plan.events).items()
    link._note = done.append
    link._noted(faults[0][0], *place, faults[0][1])
    again = parse(done[0])
    assert (again.frames, again.events) == (plan.frames, plan.events)


def test_a_core_that_has_lost_its_power_says_nothing_more():
    link = FaultyLink(MemoryLink(CORE), parse("power@byte=0"), 1, lambda byte: None)
    assert link.read() and link.read() == b""   # its HELLO
    link._link.write(HostLink().encode(BY_NAME["IDENTIFY"](0, 0)))
    link.lose_power(0)
    assert link._link._out and link.read() == b"", "it was on its way"
    link._link.restart()
    assert link.read(), "a new one's HELLO"


@given(st.text(max_size=40))
def test_no_text_is_a_traceback(text):
    try:
        parse(text.removeprefix("@"))
    except FaultError as error:
        assert "--faults" in str(error)


def test_a_file_that_is_no_text_is_refused(tmp_path):
    (tmp_path / "f").write_bytes(b"\xff\xfe\0\x80")
    with pytest.raises(FaultError, match="it is no text"):
        parse("@%s" % (tmp_path / "f"))


# A robot that counts: every sensor says its tick.
class Counting:
    anchors = [(0, 0, 0)] * 3

    def sense(self, values):
        tick = values[0]
        values[1:3] = values_of(values, [tick % 20, tick % 20])
        values[3:11] = values_of(values, [tick % 1000] * 8)
        values[11] = 100 + tick % 1000 if tick % 3 == 0 else 0
        values[13:17] = values_of(values, [1, 2, -5000 - tick, 1000 + tick] if tick % 5 == 0 else [0, 0, 0, 0])


def values_of(values, numbers):
    return type(values)(numbers)


def sensed(faults, ticks=100):
    robot = FaultySensors(Counting(), parse(faults).sensors, 1)
    rows = []
    for tick in range(1, ticks + 1):
        values = [tick] + [0] * 95
        robot.sense(values)
        rows.append(values)
    return rows


TRUE = sensed("")
PLACES = {"encoder": slice(1, 3), "infrared": slice(3, 11), "ultrasonic": slice(11, 12), "uwb": slice(13, 17)}


@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize("kind", KINDS)
def test_each_fault_of_each_sensor_spoils_that_one_in_its_time(sensor, kind):
    rows = sensed("%s=%s@step=31:40" % (sensor, kind))
    place = PLACES[sensor]
    for row, true in zip(rows, TRUE):
        for other in SENSORS:
            if other != sensor or not 31 <= row[0] < (81 if (sensor, kind) == ("encoder", "delayed") else 71):
                assert row[PLACES[other]] == true[PLACES[other]]
    got, true = [row[place] for row in rows[30:70]], [row[place] for row in TRUE[30:70]]
    assert got != true
    said = [value for value in got if value[0]]
    if kind == "off":
        assert not said
    elif kind == "stuck":
        assert len({tuple(value) for value in said}) == 1
    elif kind == "delayed":
        assert got[10:] == true[:30]
    elif kind == "slow":
        assert len({tuple(value) for value in said}) <= 9
    elif kind == "intermittent":
        assert all(value in (same, [0] * len(same)) for value, same in zip(got, true))
    assert sensed("%s=%s@step=31:40" % (sensor, kind)) == rows, "it is seeded"


@pytest.mark.parametrize("fault", ["slow@step=1:100", "slow@step=11:32", "delayed@step=11:32", "delayed@step=11:3"])
def test_what_slow_and_late_wheels_turn_is_told_later_and_none_of_it_is_lost(fault):
    rows = sensed("encoder=" + fault)
    for side in (1, 2):
        assert sum(row[side] for row in rows) == sum(row[side] for row in TRUE)


@pytest.mark.timeout(300)
@pytest.mark.parametrize("sensor", SENSORS)
def test_with_any_sensor_failing_the_core_goes_on(sensor):
    for kind in KINDS:
        got = mission(faults="%s=%s@step=50:100" % (sensor, kind), steps=300)
        assert isinstance(got, Outcome) and got.session.step == 300 and got.session.status.heap_locked == 0
    assert not mission(faults="encoder=wrong", steps=300).same_as(calm(steps=300))
