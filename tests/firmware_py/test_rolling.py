# The machine code that a port may put in the follower's place agrees with it to the last bit.

import pytest

from tests.upy import run


@pytest.mark.parametrize("seed", [1, 77, 4242])
def test_the_machine_code_agrees(seed):
    printed = run.script("tests.upy.rolling_same", str(seed), "400", heap="192k")
    assert "rounds 400 differed 0" in printed
