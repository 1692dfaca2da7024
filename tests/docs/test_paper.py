# docs/paper.md against the code: its flags, its equations, its citations.

import math
import re
from fractions import Fraction

from protocol.parameters import FLAGS, PARAMETERS
from tests.docs.pages import PLACE, page, rows
from tests.house.tree import PROJECT, python_files

PAGE = "docs/paper.md"


def test_the_flags_are_those_of_the_parameters():
    assert [tuple(row) for row in rows(PAGE, "flag")] == [(name, "on" if on else "off", text) for name, on, text in FLAGS]
    default = next(row[5] for row in PARAMETERS if row[0] == "flags")
    assert default == sum(on << bit for bit, (_, on, _) in enumerate(FLAGS))


def test_every_flag_stands_beside_the_departure_that_it_switches():
    departures = [" ".join(row) for row in rows(PAGE, "paper")] + re.findall(r"^\| .* \| .* \| .* \|$", page(PAGE), re.M)
    for name, _, _ in FLAGS:
        assert any(f"`{name}`" in row for row in departures), name


def test_every_equation_that_the_code_cites_has_its_place():
    cited = set()
    for path in python_files("firmware_py"):
        for found in re.findall(r"Paper eq\. (\d)(?: and (\d))?", path.read_text()):
            cited |= {int(n) for n in found if n}
    placed = {int(n) for first, place, *_ in rows(PAGE, "paper") if ".py:" in place for n in re.findall(r"eq\. (\d)", first)}
    assert cited and cited <= placed, cited - placed


def test_every_file_that_cites_an_equation_is_named_for_it():
    named = {file for file, _ in PLACE.findall(page(PAGE))}
    for path in python_files("firmware_py/collection", "firmware_py/storage", "firmware_py/building"):
        if re.match(r"#.*\(Paper (?:eq|Table)", path.read_text()):
            assert str(path.relative_to(PROJECT)) in named, path.name


def test_what_the_page_says_of_pi():
    assert round(float(abs(Fraction(355, 113) / Fraction(math.pi) - 1)) * 1e6, 1) == 0.1  # micrometres in a metre
    assert "(0.1 um in a metre)" in page(PAGE)
