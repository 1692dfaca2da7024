# The guard must see what it is for; otherwise the properties that use it say nothing.

import sys

import pytest

from tests.house.integer_guard import IntegerTooBig, _checked, guarded_core, watched


def run(source, **names):
    space = {"_checked": _checked, **names}
    exec(watched(source, "example.py"), space)
    return space


@pytest.mark.parametrize("source", [
    "y = x * x >> 4",                 # the product, though the result is small
    "y = (1 << 30) - 1",
    "y = -x * 40000",
    "y = ~(x << 15)",
    "x *= 40000",
    "a[0] += 2**29 + 2**29 - 1",
    "y = sum(a)",
    "y = int.from_bytes(b'\\xff\\xff\\xff\\xff', 'little') & 1",
    "y = x / 3",
])  # fmt: skip
def test_it_catches(source):
    with pytest.raises(IntegerTooBig, match="example.py:1"):
        run(source, x=32769, a=[2**29, 2**29])


@pytest.mark.parametrize("source, y", [
    ("y = x * 32767", 32769 * 32767),
    ("y = x\ny += 1", 32770),
    ("a[1] <<= 3\ny = a[1]", 8),
    ("y = b'ab' + b'c'", b"abc"),
    ("y = 'step %d' % x", "step 32769"),
])  # fmt: skip
def test_it_changes_nothing_else(source, y):
    assert run(source, x=32769, a=[0, 1])["y"] == y


def test_the_ordinary_modules_come_back():
    import protocol.schema

    with guarded_core() as core:
        watched_schema = core("protocol.schema")
        assert watched_schema is not protocol.schema
        assert watched_schema.MESSAGES == protocol.schema.MESSAGES
    assert sys.modules["protocol.schema"] is protocol.schema
