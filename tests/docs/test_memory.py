# docs/memory.md against a core that runs: every store, every buffer, every sum.

import re
from array import array

import pytest

from firmware_py.device import Device
from firmware_py.inventory import STORES
from firmware_py.limits import RX_BYTES, UNIX_HEAP_BYTES
from host_tools.budget import PAPER_BYTES
from tests.docs.pages import page, rows
from tests.firmware_py.core_run import objects_of

PAGE = "docs/memory.md"


# A port with nobody at its far end.
class DeadEnd:
    heap_bytes = heap_code_bytes = heap_boot_bytes = locked = 0

    def write(self, buf, size):
        pass

    def heap_used(self):
        return 0

    def ticks_ms(self):
        return 0


@pytest.fixture(scope="module")
def device():
    return Device(DeadEnd(), 1)


def inventory(device):
    """[(name, records, bytes each)] as the core tells them."""
    told = []
    for index in range(STORES):
        device.inventory.fill(index)
        out = device.link.out
        told.append((bytes(list(out[1:13])).rstrip(b"\0").decode(), out[14], out[15]))
    return told


def test_the_table_is_what_the_core_tells(device):
    table = [(name, int(records), int(each)) for name, records, each, *_ in rows(PAGE, "name")]
    assert table == inventory(device)
    for name, records, each, total, *_ in rows(PAGE, "name"):
        assert int(records) * int(each) == int(total), name


def test_the_sums_are_right(device):
    stores = sum(records * each for _, records, each in inventory(device))
    small = sum(int(size) for _, size in rows(PAGE, "array"))
    assert [int(n) for n in re.findall(r"Sum: (\d+) bytes", page(PAGE))] == [stores, small]
    assert f"together are {stores} bytes, {100 * stores / PAPER_BYTES:.1f} % of {PAPER_BYTES:,}." in page(PAGE)
    of_map = sum(records * each for name, records, each in inventory(device) if name in ("vectors", "chains"))
    assert f"is {of_map} of them" in page(PAGE) and f"takes {458 * 6} and its chains" in page(PAGE)


def test_every_array_of_the_core_is_in_one_of_the_two_tables(device):
    arrays = [thing for thing in objects_of(device).values() if isinstance(thing, (array, bytearray))]
    there = sum(len(memoryview(thing).cast("B")) for thing in arrays) + RX_BYTES  # main.py's own buffer
    told = sum(records * each for _, records, each in inventory(device)) + sum(int(size) for _, size in rows(PAGE, "array"))
    assert there == told, f"the core has {there - told} bytes of arrays that docs/memory.md does not tell: add a line to one of its tables"


def test_the_heaps_are_those_of_the_code():
    assert f"it boots from {UNIX_HEAP_BYTES // 1024} KiB up" in page(PAGE)
