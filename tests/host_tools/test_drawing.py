"""The mounting drawing: every sensor of the configuration is where its bearing says."""

import math
import re
import xml.etree.ElementTree as ElementTree

import pytest

from host_tools import cli, robot_drawing

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture
def shipped():
    return robot_drawing.read_robot(robot_drawing.shipped_robot())


def test_every_sensor_is_drawn_where_it_is_mounted(shipped):
    root = ElementTree.fromstring(robot_drawing.svg(shipped))
    circles = [(float(c.get("cx")), float(c.get("cy")), float(c.get("r"))) for c in root.iter(SVG + "circle")]
    (x0, y0, body), = [c for c in circles if c[2] > 20]
    assert body == pytest.approx(shipped["radius_m"] * 1000)
    sensors = [c for c in circles if c[2] < 20]
    assert len(sensors) == len(shipped["sensors"]) == 10
    for (x, y, _), sensor in zip(sensors, shipped["sensors"]):
        radius = math.hypot(x - x0, y - y0)
        assert radius == pytest.approx(sensor["radius_m"] * 1000, abs=0.2)
        if radius > 1:      # ahead is up, left is left
            bearing = math.degrees(math.atan2(x0 - x, y0 - y))
            assert (bearing - sensor["bearing_deg"] + 180) % 360 - 180 == pytest.approx(0, abs=0.1)
    texts = [text.text for text in root.iter(SVG + "text")]
    assert set("I1 I2 I3 I4 I5 I6 I7 I8 U1 R1".split()) <= set(texts)
    assert any("track 235 mm" in text for text in texts)


def test_the_drawing_in_the_docs_is_not_stale(project, capsys):
    assert cli.main(["robot-drawing", "--check", str(project / "docs" / "robot.svg")]) == 0


def test_another_configuration_gives_another_drawing(tmp_path, capsys):
    with open(robot_drawing.shipped_robot(), encoding="utf-8") as file:
        text = file.read()
    other = tmp_path / "robot.toml"
    other.write_text(re.sub(r"bearing_deg = 60\b", "bearing_deg = 75", text))
    drawing = tmp_path / "pictures" / "robot.svg"
    assert cli.main(["robot-drawing", "--robot", str(other), "--out", str(drawing)]) == 0
    assert "bearing +75°" in drawing.read_text()
    assert cli.main(["robot-drawing", "--check", str(drawing)]) == 1
    assert "is stale: run `host_tools robot-drawing" in capsys.readouterr().err


@pytest.mark.parametrize("change, sentence", [
    (lambda text: text.replace("track_m", "trakc_m"), "track_m in [drive] is missing or not a number"),
    (lambda text: text.replace("[body]", "[body"), "is not TOML"),
    (lambda text: text.replace("[[sensor]]", "[[sensors]]"), "[[sensor]] is missing"),
    (lambda text: text.replace("bearing_deg = 60", "bearing_deg = 'left'"), "bearing_deg in [sensor[1]] is missing or not a number"),
])
def test_a_bad_configuration_is_one_sentence(tmp_path, capsys, change, sentence):
    with open(robot_drawing.shipped_robot(), encoding="utf-8") as file:
        text = file.read()
    bad = tmp_path / "robot.toml"
    bad.write_text(change(text))
    assert cli.main(["robot-drawing", "--robot", str(bad), "--out", str(tmp_path / "r.svg")]) == 2
    err = capsys.readouterr().err
    assert sentence in err and err.count("\n") == 1
    assert not (tmp_path / "r.svg").exists()


def test_files_that_are_not_there(tmp_path, capsys):
    assert cli.main(["robot-drawing", "--robot", str(tmp_path / "no.toml")]) == 2
    assert cli.main(["robot-drawing", "--check", str(tmp_path / "no.svg")]) == 2
    assert cli.main(["robot-drawing", "--out", "/proc/no/r.svg"]) == 2
    assert capsys.readouterr().err.count("no such file") == 3
