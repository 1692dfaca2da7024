# What the fuzzer begins with, and everything it ever found, through the same targets, without it.

import subprocess
import sys
from pathlib import Path

import pytest

from tests.fuzz.__main__ import NAMES
from tests.fuzz.targets import TARGETS

FOUND = Path(__file__).with_name("found")


@pytest.mark.parametrize("name", NAMES)
def test_what_was_found_once_and_every_seed_is_survived(name):
    run, seeds = TARGETS[name]
    inputs = [*seeds(), *(path.read_bytes() for path in sorted(FOUND.glob(name + "/*")))]
    assert len(inputs) > 5
    for data in inputs:
        run(data)


def test_every_target_is_named():
    assert set(NAMES) == set(TARGETS)
    assert {path.name for path in FOUND.glob("*")} <= set(NAMES)


def test_without_the_fuzzer_it_says_how_to_get_it(project):
    hidden = ("import sys, runpy; sys.modules['atheris'] = None; sys.argv = ['fuzz', 'faults']; "
              "runpy.run_module('tests.fuzz', run_name='__main__')")
    done = subprocess.run([sys.executable, "-c", hidden], cwd=project, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2 and "pip install 'tvslam[fuzz]'" in done.stderr and done.stderr.count("\n") == 1
