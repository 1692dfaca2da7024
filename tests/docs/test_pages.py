# Every page: what it names exists, what it links to is there, what it tells to type is a command.

import re

import pytest

from tests.docs.pages import FILE, PLACE, TEST, defined, page, pages
from tests.house.tree import PROJECT

ALL = pages()


@pytest.mark.parametrize("name", ALL)
def test_every_file_that_a_page_names_exists(name):
    missing = [file for file in FILE.findall(page(name)) if not (PROJECT / file).exists()]
    assert not missing, missing


@pytest.mark.parametrize("name", ALL)
def test_every_place_that_a_page_names_exists(name):
    places = PLACE.findall(page(name)) + TEST.findall(page(name))
    missing = [f"{file}:{what}" for file, what in places if not (PROJECT / file).exists() or not defined(file, what)]
    assert not missing, missing


@pytest.mark.parametrize("name", ALL)
def test_every_link_leads_somewhere(name):
    text = page(name)
    headings = {re.sub(r"[^\w -]", "", h.lower()).strip().replace(" ", "-") for h in re.findall(r"^#+ (.*)$", text, re.M)}
    broken = []
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if target.startswith("#"):
            if target[1:] not in headings:
                broken.append(target)
        elif "://" not in target and not (PROJECT / name).parent.joinpath(target.split("#")[0]).exists():
            broken.append(target)
    assert not broken, broken


def test_every_target_of_make_that_a_page_names_is_there():
    targets = set(re.findall(r"^([a-z]+):", (PROJECT / "Makefile").read_text(), re.M))
    for name in ALL:
        named = set(re.findall(r"(?:^|`)make ([a-z]+)", page(name), re.M))
        assert named <= targets, f"{name}: {named - targets}"


def test_every_subcommand_that_a_page_names_is_there():
    from host_tools.cli import SUBCOMMANDS

    for name in ALL:
        named = set(re.findall(r"(?:^|`|bin/)host_tools ([a-z][a-z-]+)", page(name), re.M))
        assert named <= set(SUBCOMMANDS), f"{name}: {named - set(SUBCOMMANDS)}"


def test_every_module_that_a_page_runs_is_there():
    for name in ALL:
        for module in re.findall(r"python -m ([\w.]+)", page(name)):
            if module.split(".")[0] in ("venv", "pip", "pytest"):
                continue
            base = PROJECT.joinpath(*module.split("."))
            assert base.with_suffix(".py").exists() or (base / "__main__.py").exists(), f"{name}: python -m {module}"
