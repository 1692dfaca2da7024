# Home files: what is read, and one clear sentence for everything that is wrong.

import json
import os

import numpy as np
import pytest
from shapely.geometry import LinearRing, Point

from sim_device.home import HomeError, home_names, load_home

GOOD = {
    "name": "good", "units": "m", "outline": [[0, 0], [4, 0], [4, 3], [0, 3]], "obstacles": [[[2, 1], [3, 1], [3, 2], [2, 2]]],
    "rooms": [{"name": "hall", "centre": [2, 1.5], "polygon": [[0, 0], [4, 0], [4, 3]]}], "start": [1, 1],
}


def write(tmp_path, **changes):
    data = {key: value for key, value in {**GOOD, **changes}.items() if value is not None}
    path = tmp_path / "home.json"
    path.write_text(json.dumps(data))
    return path


def test_a_good_home_is_read(tmp_path):
    home = load_home(write(tmp_path))
    assert (home.name, home.start, len(home.segments)) == ("good", (1.0, 1.0), 8)
    assert home.free.area == pytest.approx(11)
    assert [room.name for room in home.rooms] == ["hall"]


@pytest.mark.parametrize("turned", [False, True])
def test_the_free_space_is_left_of_every_segment_however_the_file_turns(tmp_path, turned):
    outline, obstacle = GOOD["outline"], GOOD["obstacles"][0]
    home = load_home(write(tmp_path, outline=outline[::-1] if turned else outline, obstacles=[obstacle[::-1] if turned else obstacle]))
    assert LinearRing(home.outline).is_ccw and not LinearRing(home.obstacles[0]).is_ccw
    start, end = home.segments[:, :2], home.segments[:, 2:]
    along = end - start
    left = (start + end) / 2 + 0.01 * np.stack((-along[:, 1], along[:, 0]), axis=1) / np.linalg.norm(along, axis=1)[:, None]
    assert all(home.free.contains(Point(p)) for p in left)


def test_an_outline_closed_explicitly_is_the_same_home(tmp_path):
    home = load_home(write(tmp_path, outline=GOOD["outline"] + [[0, 0]]))
    assert len(home.outline) == 4


BAD = {
    # key changed: (changes, words that the sentence must hold)
    "name missing": ({"name": None}, ["'name'", "missing"]),
    "units missing": ({"units": None}, ["'units'", "missing"]),
    "outline missing": ({"outline": None}, ["'outline'", "missing"]),
    "obstacles missing": ({"obstacles": None}, ["'obstacles'", "missing"]),
    "rooms missing": ({"rooms": None}, ["'rooms'", "missing"]),
    "start missing": ({"start": None}, ["'start'", "missing"]),
    "feet": ({"units": "ft"}, ["'units'", "'ft'", "metres"]),
    "name a number": ({"name": 7}, ["'name'", "text"]),
    "outline a text": ({"outline": "square"}, ["'outline'", "list"]),
    "outline crosses": ({"outline": [[0, 0], [4, 3], [4, 0], [0, 3]]}, ["'outline'", "crosses", "Self-intersection"]),
    "two vertices": ({"outline": [[0, 0], [4, 0]]}, ["'outline'", "2 different vertices", "at least 3"]),
    "vertex twice": ({"outline": [[0, 0], [4, 0], [4, 0], [4, 3], [0, 3]]}, ["'outline'", "repeats", "[4.0, 0.0]"]),
    "flat outline": ({"outline": [[0, 0], [4, 0], [2, 0]]}, ["'outline'"]),
    "three numbers": ({"outline": [[0, 0, 0], [4, 0], [4, 3]]}, ["'outline[0]'", "pair of numbers"]),
    "true is no number": ({"start": [True, 1]}, ["'start'", "pair of numbers"]),
    "infinite": ({"outline": [[0, 0], [float("inf"), 0], [4, 3]]}, ["'outline[1]'", "not finite"]),
    "nan": ({"start": [float("nan"), 1]}, ["'start'", "not finite"]),
    "huge integer": ({"start": [10**400, 1]}, ["'start'", "not finite"]),
    "millimetres": ({"outline": [[0, 0], [4000, 0], [4000, 3000]]}, ["'outline[1]'", "500 m"]),
    "obstacle outside": ({"obstacles": [[[5, 1], [6, 1], [6, 2]]]}, ["'obstacles[0]'", "outside"]),
    "obstacle through the wall": ({"obstacles": [[[3, 1], [5, 1], [5, 2]]]}, ["'obstacles[0]'", "through the outline"]),
    "obstacles overlap": ({"obstacles": [[[2, 1], [3, 1], [3, 2]], [[2.5, 1], [3.5, 1], [3, 1.9]]]},
                          ["'obstacles[0]'", "overlaps obstacles[1]"]),
    "obstacle on the wall": ({"obstacles": [[[3, 1], [4, 1], [4, 2], [3, 2]]]}, ["'obstacles'", "touch"]),
    "obstacle crosses itself": ({"obstacles": [[[2, 1], [3, 2], [3, 1], [2, 2]]]}, ["'obstacles[0]'", "crosses"]),
    "start in an obstacle": ({"start": [2.5, 1.5]}, ["'start'", "inside a wall"]),
    "start outside": ({"start": [9, 9]}, ["'start'", "outside the home"]),
    "start too near": ({"start": [0.16, 1]}, ["'start'", "0.160 m", "0.17 m"]),
    "room a number": ({"rooms": [3]}, ["'rooms[0]'", "object"]),
    "room without centre": ({"rooms": [{"name": "a", "polygon": []}]}, ["'rooms[0].centre'", "missing"]),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_wrong_is_said_in_one_sentence(tmp_path, case):
    changes, words = BAD[case]
    path = write(tmp_path, **changes)
    expect_sentence(path, path, words)


def expect_sentence(given, names, words):
    with pytest.raises(HomeError) as caught:
        load_home(given)
    sentence = str(caught.value)
    assert sentence.startswith(str(names)), sentence
    assert sentence.endswith(".") and "\n" not in sentence
    for word in words:
        assert word in sentence, sentence


@pytest.mark.parametrize("text, words", [
    ("{", ["not JSON", "line 1"]), ("", ["not JSON"]), ("[1, 2]", ["list", "object"]), ("[" * 100000, ["not JSON"]),
    ("null", ["null", "object"])])
def test_a_file_that_is_no_home(tmp_path, text, words):
    path = tmp_path / "home.json"
    path.write_text(text)
    expect_sentence(path, path, words)


def test_a_file_that_is_not_text(tmp_path):
    path = tmp_path / "home.json"
    path.write_bytes(b"\xff\xfe\x00\x9f")
    expect_sentence(path, path, ["not UTF-8"])


def test_a_mark_of_the_byte_order_is_no_fault(tmp_path):
    path = write(tmp_path)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert load_home(path).name == "good"


@pytest.mark.parametrize("name", ["", "two\nlines", "\x1b[31mred", "\ud800", "n" * 101, 7])
def test_a_name_that_no_table_can_show_is_refused(tmp_path, name):
    path = write(tmp_path, name=name)
    expect_sentence(path, path, ["'name'"])
    path = write(tmp_path, rooms=[{**GOOD["rooms"][0], "name": name}])
    expect_sentence(path, path, ["rooms[0].name"])
    assert load_home(write(tmp_path, name="Küche 家 🏠")).name == "Küche 家 🏠"


def test_a_number_without_end_does_not_fill_the_sentence(tmp_path):
    path = write(tmp_path, start=[10 ** 400, 1])
    with pytest.raises(HomeError) as caught:
        load_home(path)
    assert len(str(caught.value)) < 200 + len(str(path)) and "start" in str(caught.value)


def test_a_name_that_no_file_can_have(tmp_path):
    with pytest.raises(HomeError, match="too long"):
        load_home("n" * 5000)
    with pytest.raises(HomeError, match="empty"):
        load_home("")
    os.mkfifo(tmp_path / "pipe.json")
    expect_sentence(tmp_path / "pipe.json", tmp_path / "pipe.json", ["no regular file"])


def test_a_file_that_is_not_there(tmp_path):
    path = tmp_path / "no_such.json"
    expect_sentence(path, path, ["no such file", *home_names()])
    expect_sentence(tmp_path, tmp_path, ["folder"])


def test_an_unknown_name_lists_the_shipped_homes():
    assert home_names(), "the product ships homes"
    expect_sentence("no_such_home", "no_such_home", home_names())


@pytest.mark.parametrize("name", home_names())
def test_every_shipped_home_loads_by_its_name(name):
    home = load_home(name)
    assert home.free.is_valid and home.free.area > 1
    assert home.name == name


def test_every_real_home_loads(real_homes):
    files = sorted(real_homes.glob("*.json"))
    assert len(files) >= 10
    for path in files:
        home = load_home(path)
        data = json.loads(path.read_text())
        assert len(home.segments) == data["segments_total"], path.name
        assert home.free.area == pytest.approx(data["free_area_m2"], rel=0.01), path.name
