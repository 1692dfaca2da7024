# Seven ways to fail, four sensors: the map is sound all the same, or the core says that it may not be. Where nothing fails it says
# nothing.

import pytest

from sim_device.faults import KINDS, SENSORS
from tests.stories.failing_sensors import drive, is_honest

SHORT_S = 70
WHILE_DRIVING = "@step=1000"

# What is told within a minute; what else fails is told later, or errs within bounds.
SAID = {
    "encoder=off": "encoder", "encoder=garbage": "encoder", "encoder=slow": "encoder", "encoder=wrong": "encoder",
    "encoder=intermittent": "encoder", "infrared=off": "infrared", "infrared=stuck": "infrared", "infrared=garbage": "infrared",
    "ultrasonic=off": "ultrasonic", "ultrasonic=stuck": "ultrasonic", "ultrasonic=garbage": "ultrasonic", "uwb=off": "uwb",
}


@pytest.mark.parametrize("fault", SAID)
def test_a_sensor_that_fails_is_named(fault):
    outcome = drive("studio", fault + WHILE_DRIVING, max_robot_s=SHORT_S)
    assert SAID[fault] in outcome.said, str(outcome)


@pytest.mark.parametrize("uwb", ["paper", "tof_nlos", "none"])
def test_a_sound_one_is_not(uwb):
    outcome = drive("studio", uwb=uwb, odometry="poor", max_robot_s=SHORT_S)
    assert outcome.said == []


def test_what_failed_for_a_while_stays_said():
    outcome = drive("studio", "infrared=off@step=500:600", max_robot_s=SHORT_S)
    assert outcome.said == ["infrared"]


@pytest.mark.soak
@pytest.mark.parametrize("home", ["studio", "flat"])
@pytest.mark.parametrize("sensor", SENSORS)
def test_no_failing_sensor_spoils_the_map_unsaid(home, sensor, record_count):
    for kind in KINDS:
        for when in ("", WHILE_DRIVING):
            outcome = drive(home, "%s=%s%s" % (sensor, kind, when))
            print("%-8s %-11s %-13s %-11s %s" % (home, sensor, kind, when, outcome))
            record_count("missions with a failing sensor (silently spoilt)", 1, not is_honest(outcome))
            assert is_honest(outcome), (kind, when, str(outcome))


SENSORS_SAID = set(SENSORS)


@pytest.mark.soak
@pytest.mark.parametrize("uwb, odometry", [
    ("paper", "calibrated"), ("tof", "poor"), ("tof_nlos", "poor"), ("rssi_real", "poor"), ("none", "poor")])
def test_no_sound_sensor_is_accused_in_real_homes(real_homes, uwb, odometry, record_count):
    for path in sorted(real_homes.glob("*.json")):
        outcome = drive(str(path), seed=3, uwb=uwb, odometry=odometry)
        record_count("missions with sound sensors (one accused)", 1, bool(SENSORS_SAID & set(outcome.said)))
        assert not SENSORS_SAID & set(outcome.said), (path.name, str(outcome))
