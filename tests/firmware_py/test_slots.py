# What outlives a loss of power: the last whole record, bit by bit, whatever is cut off at whatever byte.

import itertools
import random
import zlib

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from firmware_py.limits import CORNERS_MAX
from firmware_py.pipeline import Tvslam
from firmware_py.storage import slots as slots_file
from protocol import schema
from sim_device.nvm import SIZE, Nvm
from tests.firmware_py.core_run import WatchedTvslam
from tests.firmware_py.kept import Served, booted, core_with, fill_of, filled, kept, state
from tests.firmware_py.puppet import NUMBERS
from tests.strategies import examples

HEAD = 18
DATA_AT = schema.NVM_PIECE


def blank_state():
    return state(Tvslam())


@settings(max_examples=examples(25))
@given(filled(), filled(), st.integers(0, 5))
def test_a_record_is_loaded_as_it_was_kept(first, second, again):
    served = kept(first, kind=WatchedTvslam)
    for _ in range(again):
        assert served.save()
    second(served.core)
    assert served.save() and served.core.slots.kept & schema.NVM_KEPT
    loaded = booted(served.nvm, WatchedTvslam).core
    assert loaded.slots.found and loaded.slots.ready and state(loaded) == state(served.core)
    assert bool(loaded.slots.kept & schema.NVM_EXPLORED) == bool(served.core.reason)
    assert not loaded.slots.kept & (schema.NVM_DAMAGED | schema.NVM_FOREIGN)


def cells(core):
    return list(core.search.seen[2 * CORNERS_MAX:])


@pytest.mark.parametrize("refused", [False, True])
def test_of_a_record_that_is_not_loaded_to_its_end_nothing_stays(refused):
    # The host breaks off and begins the mission, or the memory refuses to be read, when half of the cells are there.
    def fill(core):
        fill_of(3, 40)(core)
        core.search.cell_mm, core.search.columns, core.search.rows = 370, 64, 64
        for i in range(256):
            core.search.seen[2 * CORNERS_MAX + i] = 0x5555
    served = Served(core_with(kept(fill).nvm), kept(fill).nvm)
    core, blank = served.core, cells(Tvslam())
    while cells(core) == blank:
        served.exchange()
    served.exchange()
    if refused:
        served.done = (served.done[0], 1, b"")
        assert not served.exchange()
    core.begin()
    for _ in range(99):
        served.exchange()
        assert not core.slots.found and not core.slots.ready and core.slots.lost()
        assert cells(core) == blank and core.vectors.used == 0 and core.search.cell_mm == 0 and core.record.news() is False


def test_the_largest_record_fits_into_the_memory_of_the_robot():
    def fill(core):
        fill_of(1, len(core.vectors.xs))(core)
        core.vectors.chains = len(core.vectors.kinds)
        core.search.barriers.used = len(core.search.barriers.xs)
        core.search.cell_mm, core.search.columns, core.search.rows = 370, 64, 128
    served = kept(fill)
    assert served.core.slots.kept & schema.NVM_KEPT and not served.core.slots.lost()
    assert SIZE // 2 - schema.NVM_UNIT < DATA_AT + served.core.record.size <= SIZE // 2


def slot_of(nvm):
    """The slot that was written last."""
    heads = [bytes(nvm.read(at, HEAD)[1]) for at in (0, nvm.size // 2)]
    sequences = [int.from_bytes(head[6:8], "little") if head[:4] == b"TVNV" else -1 for head in heads]
    return sequences.index(max(sequences)) * nvm.size // 2


def memory_with(records):
    """A memory in which so many records were kept one after the other."""
    served = booted(Nvm(4096))
    for number in range(records):
        fill_of(number, 23 + number)(served.core)
        assert served.save()
    return bytes(served.nvm._bytes)


@pytest.mark.parametrize("before, every", [(0, 13), (1, 1), (2, 5)])
def test_power_lost_at_every_byte_of_a_write(before, every):
    # The torn byte, or the torn unit, is random. What is there afterwards is the old record or the new one, and a write after it is whole.
    memory, found, whole = memory_with(before), [], False
    for number in itertools.count(step=every):
        nvm = Nvm(4096, power=[number], seed=number)
        nvm._bytes[:] = memory
        served = booted(nvm)
        old = state(served.core)
        fill_of(9, 31, explored=1)(served.core)
        whole = served.save()
        loaded = booted(nvm)
        now, new = state(loaded.core), state(served.core)
        assert now == new if whole else now in (old, new), number
        if whole:
            break
        found.append(now == new)
        if number % 16 == 0:
            fill_of(number, 5)(loaded.core)
            assert loaded.save() and state(booted(nvm).core) == state(loaded.core), number
    last = 1024 + served.core.record.size + HEAD - 1
    assert last < number <= last + every and not any(found[:-1])  # of the very last byte all bits may have come


def commit_first(monkeypatch):
    """The commit record before the data, and data that nobody checks."""
    real = slots_file.Slots._take

    def take(self, values):
        before = self._phase
        real(self, values)
        if before == slots_file._ERASE and self._phase == slots_file._DATA:
            self._seal()
            self._phase = slots_file._COMMIT
        elif before == slots_file._COMMIT:
            self._phase = slots_file._DATA
        elif before == slots_file._DATA and self._phase == slots_file._COMMIT:
            self._phase = slots_file._IDLE

    def load(self, values):
        for i in range(min(values[2], self._piece())):
            self._record.put(self._at + i, values[3 + i])
        self._at += min(values[2], self._piece())
        if self._at >= self._record.size:
            self._record.apply()
            self._phase, self.found, self.ready = slots_file._IDLE, True, True
    monkeypatch.setattr(slots_file.Slots, "_take", take)
    monkeypatch.setattr(slots_file.Slots, "_load", load)


def one_slot(monkeypatch):
    """The slot that is in force is written again."""
    real = slots_file.Slots.save

    def save(self):
        if self._phase == slots_file._IDLE and not self._ticks and self.kept:
            self._slot = 1 - self._slot
        return real(self)
    monkeypatch.setattr(slots_file.Slots, "save", save)


@pytest.mark.parametrize("broken", [commit_first, one_slot])
def test_a_write_in_another_order_is_found_out(monkeypatch, broken):
    broken(monkeypatch)
    with pytest.raises((AssertionError, IndexError)):
        test_power_lost_at_every_byte_of_a_write(1, 1)


@given(st.integers(0, 2**31), st.integers(1, 255))
@example(0, 255)
def test_a_byte_that_went_bad_costs_its_record_and_no_more(place, flip):
    served = kept(fill_of(1, 40))
    old = state(served.core)
    fill_of(2, 50)(served.core)
    assert served.save()
    nvm, slot = served.nvm, slot_of(served.nvm)
    size = DATA_AT + served.core.record.size
    at = place % (size - DATA_AT + HEAD)
    nvm._bytes[slot + (at if at < HEAD else at - HEAD + DATA_AT)] ^= flip
    loaded = booted(nvm).core
    assert state(loaded) == old and loaded.slots.kept & (schema.NVM_DAMAGED | schema.NVM_FOREIGN) == schema.NVM_DAMAGED
    nvm._bytes[nvm.size // 2 - slot:nvm.size // 2 - slot + size] = b"\0" * size
    loaded = booted(nvm).core
    assert state(loaded) == blank_state() and not loaded.slots.found and loaded.slots.ready


@settings(max_examples=examples(30))
@given(st.integers(0, 2**32), st.booleans())
def test_any_memory_is_survived(seed, headed):
    nvm, data = Nvm(4096), random.Random(seed).randbytes(4096)
    nvm._bytes[:] = data
    if headed:  # as if everything before it were right
        size = data[8] | data[9] << 8
        with_head(nvm, size % 1900, data)
    core = booted(nvm, WatchedTvslam).core
    assert not core.slots.found and state(core) == blank_state()
    fill_of(1, 20)(core)


def with_head(nvm, size, data, layout=1, sequence=7):
    head = b"TVNV" + layout.to_bytes(2, "little") + sequence.to_bytes(2, "little") + size.to_bytes(2, "little") + data[10:14]
    nvm._bytes[:HEAD] = head + zlib.crc32(head).to_bytes(4, "little")


@pytest.mark.parametrize("change, bit", [({"layout": 2}, schema.NVM_FOREIGN), ({"size": 9000}, schema.NVM_FOREIGN)])
def test_another_firmwares_record_is_passed_over_and_said(change, bit):
    nvm = Nvm(4096)
    with_head(nvm, **{"size": 100, "data": bytes(20), **change})
    served = booted(nvm)
    assert served.core.slots.kept == bit and not served.core.slots.found
    fill_of(1, 20)(served.core)
    assert served.save() and booted(nvm).core.slots.found


def test_a_record_of_larger_stores_is_passed_over():
    nvm = kept(fill_of(1, 40)).nvm
    served = Served(core_with(nvm), nvm)
    served.core.record._fits = lambda: False
    served.begin()
    assert served.core.slots.kept == schema.NVM_FOREIGN and state(served.core) == blank_state()


def test_the_newest_counts_also_where_its_number_begins_anew():
    served = kept(fill_of(1, 3))
    served.core.slots._sequence = 65533
    for number in range(6):
        fill_of(number, 4 + number)(served.core)
        assert served.save()
        if number:  # the first one came after no other
            assert booted(served.nvm).core.vectors.used == 4 + number
            assert booted(served.nvm).core.slots._sequence == 65534 + number & 65535


def test_what_does_not_fit_is_counted_and_the_old_record_stays():
    served = kept(fill_of(1, 40), Nvm(2048))
    old = state(served.core)
    fill_of(2, 400)(served.core)
    erased = served.nvm.erases
    assert served.save() and served.core.slots.lost() and served.core.slots.kept & schema.NVM_TOO_SMALL
    assert served.nvm.erases == erased and state(booted(served.nvm).core) == old
    fill_of(3, 20)(served.core)
    assert served.save() and not served.core.slots.lost()


def test_a_memory_that_refuses_is_given_up():
    served = kept(fill_of(1, 40))
    served.nvm.program = lambda address, data: 2
    assert served.save() and served.core.slots.lost() and not served.core.slots.ready
    assert booted(served.nvm).core.vectors.used == 40


def test_a_memory_that_nobody_serves_is_given_up():
    served = kept(fill_of(1, 40))
    ticks = 0
    while not served.core.slots.save():
        ticks += 1
    assert ticks == 2001 and served.core.slots.lost()


def test_without_a_memory_nothing_is_asked():
    core = Tvslam()
    served = Served(core, Nvm())
    served.begin()
    assert served.operations == [(0, 0, 0)] and not core.slots.ready
    core = core_with(Nvm(), Tvslam)
    core.begin()
    served = Served(core, Nvm())
    served.begin()
    assert served.operations == [(0, 0, 0)] and not core.slots.ready, "it is too late to load a map"


def test_what_is_asked_again_is_told_again_and_done_once():
    # In a new epoch of the link the same NVM_DONE may come twice, also long after.
    plain = kept(fill_of(1, 60))
    served = booted(Nvm())
    fill_of(1, 60)(served.core)
    draw = random.Random(3)
    while not served.core.slots.save():
        before = served.done
        served.exchange()
        if draw.random() < 0.5:
            now, operation = served.done, served.operations[-1]
            served.done = draw.choice([before, (0, 0, b"")])
            if operation[0] and served.done[0] != now[0]:
                said = bytes(served.values)
                served.nvm, nvm = Nvm(), served.nvm   # nothing is written twice
                served.exchange()
                served.nvm = nvm
                assert served.operations.pop() == operation and bytes(served.values) == said
            served.done = now
    assert served.nvm._bytes == plain.nvm._bytes


def test_the_mission_goes_on_from_it():
    nvm = kept(fill_of(1, 40)).nvm
    core = booted(nvm, Tvslam).core
    core.set_parameter(NUMBERS["dock_x"], 0, 1000000)
    core.begin()
    assert core.explorer.inside and core.outline.whole and core.explorer.state == 8 and core.vectors.used == 40
    other = booted(kept(fill_of(1, 40, explored=1)).nvm, Tvslam).core
    other.begin()
    assert other.explorer.state == 12 and (other.tally.lo, other.tally.hi) != (core.tally.lo, core.tally.hi)
