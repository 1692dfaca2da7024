# The machine code that a port may put in the place of the innermost loops agrees with it to the last bit.

import pytest

from tests.upy import run


@pytest.mark.parametrize("seed", [1, 77, 4242])
def test_the_machine_code_agrees(seed):
    printed = run.script("tests.upy.rolling_same", str(seed), "400", heap="192k")
    rounds, differed, *seen = [int(word) for word in printed.split()[1::2]]
    assert (rounds, differed) == (400, 0) and min(seen) > 20, printed  # seen: rays through a hit, ranges used, outliers
