"""`host_tools homes`: the table agrees with the files, and the pictures with the walls."""

import json

import pytest

from host_tools import cli, homes
from sim_device.home import home_names, load_home

SQUARE = {"name": "square", "units": "m", "outline": [[0, 0], [4, 0], [4, 3], [0, 3]],
          "obstacles": [[[2, 1], [3, 1], [3, 2], [2, 2]]],
          "rooms": [{"name": "all", "centre": [1, 1], "polygon": [[0, 0], [4, 0], [4, 3], [0, 3]]}], "start": [1, 1.5]}


@pytest.fixture
def square(tmp_path):
    path = tmp_path / "square.json"
    path.write_text(json.dumps(SQUARE))
    return path


def test_the_table_lists_every_shipped_home(capsys):
    assert cli.main(["homes"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ["home", *home_names()]


def test_the_table_of_a_file(square, capsys):
    assert cli.main(["homes", str(square)]) == 0
    assert capsys.readouterr().out.splitlines()[1].split() == ["square", "11.0", "4.0", "x", "3.0", "8", "1", "1", "1.00,", "1.50"]


def test_the_sketch_shows_walls_and_the_start(square):
    lines = homes.sketch(load_home(str(square)), 40, 15)
    assert {len(line) for line in lines} == {40} and len(lines) == 15
    blank = chr(0x2800)
    row, = (line for line in lines if "◉" in line)
    dots = [i for i, cell in enumerate(row) if cell not in (blank, "◉")]
    # From the left: outer wall, the start a quarter of the way, the obstacle's two sides, outer wall.
    width = dots[-1] - dots[0]
    assert abs((row.index("◉") - dots[0]) / width - 0.25) < 0.06
    assert any(abs((i - dots[0]) / width - 0.5) < 0.06 for i in dots)


def test_pictures_are_written(square, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    assert cli.main(["homes", str(square), "studio", "--draw", str(tmp_path / "new" / "pictures")]) == 0
    for name in ("square", "studio"):
        assert (tmp_path / "new" / "pictures" / (name + ".png")).read_bytes().startswith(b"\x89PNG")


def test_a_folder_that_cannot_be_written(square, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    (tmp_path / "file").write_text("")
    assert cli.main(["homes", str(square), "--draw", str(tmp_path / "file")]) == 2
    assert "cannot be written: file exists" in capsys.readouterr().err


@pytest.mark.parametrize("change, sentence", [
    ({"start": [2.5, 1.5]}, "'start'"),
    ({"outline": [[0, 0], [4, 3], [4, 0], [0, 3]]}, "'outline'"),
])
def test_a_bad_home_is_one_sentence_and_the_good_ones_are_still_shown(tmp_path, capsys, change, sentence):
    path = tmp_path / "bad.json"
    path.write_text(json.dumps(dict(SQUARE, **change)))
    assert cli.main(["homes", str(path), "studio"]) == 2
    told = capsys.readouterr()
    assert sentence in told.err and told.err.count("\n") == 1
    assert "studio" in told.out


def test_the_real_homes_can_all_be_listed(real_homes, capsys):
    files = sorted(str(path) for path in real_homes.glob("*.json"))
    assert cli.main(["homes", *files]) == 0
    out = capsys.readouterr().out
    assert all(load_home(path).name in out for path in files)
