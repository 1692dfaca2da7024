# robot.toml: the values that the house is built on, and one sentence for every mistake.

import pytest

from protocol.parameters import PARAMETERS
from sim_device.config import DEFAULT, RobotError, load_robot

TEXT = DEFAULT.read_text()


def test_the_shipped_robot_is_the_one_of_the_design():
    robot = load_robot()
    assert (robot.radius_m, robot.wheel_diameter_m, robot.track_m, robot.pulses_per_turn) == (0.17, 0.072, 0.235, 508)
    assert [s.bearing_deg for s in robot.of_kind("infrared")] == [0, 60, -18, -40, -65, -90, -120, 180]
    assert {s.radius_m for s in robot.of_kind("infrared")} == {0.12}


def test_the_parameters_it_sets_are_known_and_in_range():
    told = load_robot().parameters()
    table = {name: (count, low, high) for name, _, count, low, high, _ in PARAMETERS}
    for name, values in told.items():
        count, low, high = table[name]
        assert len(values) == count and all(type(v) is int and low <= v <= high for v in values), name
    assert told["wheel_diameter"] == [72000] and told["track"] == [235000] and told["turn_max"] == [2000]
    assert told["ir_bearing"][1] == round(60 / 360 * 65536) and told["ir_bearing"][7] == -32768


BAD = {
    # (text replaced, by what, words that the sentence must hold)
    "no TOML": ("[body]", "[body", ["not TOML"]),
    "table missing": ("[limits]", "[limit]", ["'limits'", "missing"]),
    "table a number": ("[body]\nradius_m = 0.17", "", ["'body'", "missing"]),
    "key missing": ("track_m = 0.235", "", ["'drive.track_m'", "missing"]),
    "name missing": ('name = "reference robot"', "", ["'name'", "missing"]),
    "text for a number": ("radius_m = 0.17", 'radius_m = "0.17"', ["'body.radius_m'", "number"]),
    "true for a number": ("radius_m = 0.17", "radius_m = true", ["'body.radius_m'", "number"]),
    "fraction of a pulse": ("= 508", "= 508.5", ["'drive.pulses_per_turn'", "whole number"]),
    "not finite": ("radius_m = 0.17", "radius_m = nan", ["'body.radius_m'", "finite"]),
    "wheel too large": ("= 0.072", "= 0.72", ["'drive.wheel_diameter_m'", "720000", "200000"]),
    "too many pulses": ("= 508", "= 9000", ["'drive.pulses_per_turn'", "4096"]),
    "too fast": ("speed_m_s = 0.30", "speed_m_s = 3", ["'limits.speed_m_s'", "1000"]),
    "too slow in turning": ("turn_rad_s = 2.0", "turn_rad_s = 0.1", ["'limits.turn_rad_s'", "200"]),
    "motor": ("= 0.020", "= -1", ["'drive.motor_time_constant_s'", "0 to 1 s"]),
    "sensor out of the body": ("radius_m = 0.15", "radius_m = 0.2", ["'sensor'", "U1", "outside"]),
    "one infrared sensor elsewhere": ('part = "Sharp', 'x = 1\nradius_m = 0.1\npart = "Sharp', ["not TOML"]),
    "kind unknown": ('kind = "uwb"', 'kind = "lidar"', ["'sensor[9].kind'", "'lidar'", "infrared"]),
    "sensor short of one": ('kind = "ultrasonic"', 'kind = "uwb"', ["'sensor'", "0 of kind ultrasonic"]),
    "bearing": ("bearing_deg = 60", "bearing_deg = 460", ["'sensor[1].bearing_deg'", "460"]),
    "order": ('name = "I3"', 'name = "I9"', ["'I9'", "in order"]),
    "no sensors": ("[[sensor]]", "[[sensors]]", ["'sensor'", "missing"]),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_wrong_is_said_in_one_sentence(tmp_path, case):
    old, new, words = BAD[case]
    assert old in TEXT
    path = tmp_path / "robot.toml"
    path.write_text(TEXT.replace(old, new))
    expect_sentence(path, words)


def test_infrared_sensors_must_share_one_radius(tmp_path):
    path = tmp_path / "robot.toml"
    path.write_text(TEXT.replace("bearing_deg = -65\nradius_m = 0.12", "bearing_deg = -65\nradius_m = 0.11"))
    expect_sentence(path, ["I5", "one radius"])


def test_a_file_that_is_not_there_or_not_text(tmp_path):
    expect_sentence(tmp_path / "none.toml", ["cannot be read"])
    expect_sentence(tmp_path, ["cannot be read"])
    path = tmp_path / "robot.toml"
    path.write_bytes(b"\xff\xfe\x00")
    expect_sentence(path, ["not TOML"])


def expect_sentence(path, words):
    with pytest.raises(RobotError) as caught:
        load_robot(path)
    sentence = str(caught.value)
    assert sentence.startswith(str(path)) and sentence.endswith(".") and "\n" not in sentence, sentence
    for word in words:
        assert word in sentence, sentence
