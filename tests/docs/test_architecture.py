# docs/architecture.md against the code: the rooms, the states and what a mission really does, the numbers, the drawing.

import ast
import importlib
import random
import re
import runpy
from array import array

import pytest

from firmware_py.pipeline import Tvslam
from protocol import states
from sim_device.config import load_robot
from sim_device.home import load_home
from sim_device.nvm import Nvm
from sim_device.virtual_robot import VirtualRobot
from tests.docs.pages import page, rows
from tests.firmware_py.kept import booted
from tests.firmware_py.puppet import NUMBERS
from tests.house.tree import PACKAGES, PROJECT, name_of, parsed, python_files
from tests.stories.mission import drive_mission
from tests.strategies import KINDS, VALUES, Segment, ticks_of

PAGE = "docs/architecture.md"
ANY = "any of INIT to SWEEP"
DRIVING = ("INIT", "FIND_WALL", "ALIGN", "FOLLOW", "CORNER_IN", "CORNER_OUT", "CLOSE_CHECK", "SELECT", "GOTO", "SWEEP")


def table():
    """{state: the states that its row leads to}, the row for any state spread over those it is for."""
    leads = {}
    for state, _, guards in rows(PAGE, "state"):
        for one in DRIVING if state == ANY else state.split(", "):
            leads.setdefault(one, set()).update(re.findall(r"-> ([A-Z_]+)", guards))
    return leads


def test_each_file_of_the_packages_has_its_line():
    files = [name_of(p) for p in python_files(*PACKAGES) if p.name != "__init__.py"]
    missing = [file for file in files if not re.search(rf"^\| `{re.escape(file)}` \| \S", page(PAGE), re.M)]
    assert not missing, missing


def test_the_table_names_states_that_exist_and_the_code_enters_just_those():
    leads = table()
    named = set(leads) | set().union(*leads.values())
    assert named <= set(states.NAMES)
    not_entered = set(re.findall(r"[A-Z_]{4,}", re.search(r"Not entered yet: (.*)\.", page(PAGE))[1]))
    assert not_entered == set(states.NAMES) - named
    assert entered_by_the_code() == named - {"BOOT"}


def entered_by_the_code():
    """Every state that explorer.py, pipeline.py or search.py assigns to `state`, or ends with."""
    found = set()
    for file in ("firmware_py/collection/explorer.py", "firmware_py/pipeline.py", "firmware_py/collection/search.py"):
        for node in ast.walk(parsed(PROJECT / file)):
            values = []
            if isinstance(node, ast.Assign) and any(getattr(t, "attr", getattr(t, "id", "")) in ("state", "_resume") for t in node.targets):
                values = [node.value]
            elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "end":
                values = node.args
            found |= {n.id for value in values for n in ast.walk(value) if isinstance(n, ast.Name)}
    return found & set(states.NAMES)


@pytest.mark.parametrize("home, options", [
    ("studio", {}),
    ("studio", {"uwb": "none"}),
    ("fig3_barriers", {"start": (0.7, 3.75)}),     # meets an island first
])  # fmt: skip
def test_a_mission_takes_only_the_ways_of_the_table(home, options):
    leads = table()
    entered = [states.NAMES[state] for state in drive_mission(home, **options).states]
    strange = {f"{a} -> {b}" for a, b in zip(entered, entered[1:]) if b not in leads.get(a, ())}
    assert not strange, strange
    assert entered[-1] == "DONE" and len(set(entered)) >= 8


def test_nor_does_one_that_stores_what_it_maps():
    # From nothing; then, in a new core, from what is stored: first the outline alone, then the explored home.
    leads, nvm, stored = table(), Nvm(), []
    for begins in ("BOOT INIT", "BOOT SELECT", "BOOT BUILD"):
        robot = VirtualRobot(load_home("tests/sim_device/cell.json"), load_robot(), 1)
        served = booted(nvm)
        for name, values in robot.parameters().items():
            for index, value in enumerate(values):
                served.core.set_parameter(NUMBERS[name], index, value)
        served.core.begin()
        values, entered = array("i", bytes(4 * VALUES)), ["BOOT"]
        while entered[-1] != "DONE" and robot.tick < 4000:
            robot.sense(values)
            served.core.step(values)
            if states.NAMES[served.core.state] != entered[-1]:
                entered.append(states.NAMES[served.core.state])
            if entered[-1] == "SAVE" and not served.exchange():
                stored.append(bytes(nvm._bytes))
            robot.drive(served.core.left_mm_s, served.core.right_mm_s)
        strange = {f"{a} -> {b}" for a, b in zip(entered, entered[1:]) if b not in leads.get(a, ())}
        assert not strange and entered[-1] == "DONE" and " ".join(entered[:2]) == begins, entered
        nvm = Nvm()
        nvm._bytes[:] = stored[0 if begins == "BOOT INIT" else -1]


@pytest.mark.parametrize("seed", range(12))
def test_nor_does_nonsense_find_another_way(seed):
    leads = table()
    rng = random.Random(seed)
    core = Tvslam()
    core.begin()
    values = array("i", bytes(4 * VALUES))
    for tick in ticks_of([Segment(rng.choice(sorted(KINDS)), rng.randint(50, 300), rng.randint(0, 9999)) for _ in range(6)]):
        before = states.NAMES[core.state]
        values[:] = array("i", tick)
        core.step(values)
        after = states.NAMES[core.state]
        assert after == before or after in leads.get(before, ()), f"{before} -> {after}"


def test_the_numbers_are_the_codes():
    for name, file, value in rows(PAGE, "constant"):
        module = importlib.import_module(file.strip("`").removesuffix(".py").replace("/", "."))
        assert getattr(module, name) == int(re.match(r"-?\d+", value)[0]), f"{name} in {file}"


def test_what_the_words_beside_the_numbers_say():
    told = {name: value for name, _, value in rows(PAGE, "constant")}
    for name, value in told.items():
        number = int(re.match(r"\d+", value)[0])
        if found := re.search(r": (\d+) degrees$", value):
            assert round(number * 360 / 65536) == int(found[1]), name
        elif found := re.search(r": (\d+) s$", value):
            assert number * 0.02 == int(found[1]), name
    assert round(int(told["LINEAR"].split()[0]) * 10 * 360 / 65536) == 6
    assert 1000 / int(told["_DRIFT"].split(":")[0]) == 4


def test_the_drawing_of_the_follower_is_what_the_follower_decides():
    drawn = runpy.run_path(str(PROJECT / "examples" / "follower_drawing.py"))["drawing"]()
    stale = "docs/follower.svg is stale: run python examples/follower_drawing.py"
    assert (PROJECT / "docs" / "follower.svg").read_text(encoding="utf-8") == drawn, stale
