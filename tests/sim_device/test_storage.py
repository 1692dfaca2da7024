# Missions whose core stores its map: interrupted wherever, they come to the same end.

import functools
import os
import zlib

import pytest

from protocol import schema
from sim_device.links.map_pull import MapPull
from sim_device.links.peer_errors import PeerError, Refused, Restarted
from sim_device.nvm import Nvm
from tests.sim_device.faulty_mission import mission, spec

CELL = os.path.join(os.path.dirname(__file__), "cell.json")
STEPS = 6000        # more than it takes, also where it begins again


def cell(faults="", nvm=None, **more):
    nvm = nvm or (None if "power" in faults else Nvm())
    return mission(CELL, faults=faults, steps=STEPS, nvm=nvm, **more)


@functools.lru_cache(None)
def calm():
    """Without a fault."""
    return cell()


def end_of(outcome):
    return outcome.session.storage.figures()


def loaded(outcome):
    return [one["loaded"] for one in end_of(outcome)["found"]]


def steps_of(outcome):
    return outcome.session.step


def test_a_mission_stores_its_outline_and_then_the_explored_home():
    figures = end_of(calm())
    assert calm().session.status.finished and figures["kept"] == "explored"
    assert (figures["erases"], loaded(calm())) == (2, [None])
    without = mission(CELL, steps=STEPS)
    assert without.session.status.finished and end_of(without) is None
    assert 0 < steps_of(calm()) - steps_of(without) < 40


def test_a_bad_line_changes_nothing_of_it():
    for seed in (1, 2):
        got = cell(spec(seed), fault_seed=seed)
        assert got.same_as(calm()) and end_of(got) == end_of(calm()), seed


def test_a_new_mission_goes_on_from_what_was_stored():
    nvm = Nvm()
    first = cell(nvm=nvm)
    again = cell(nvm=nvm)
    assert loaded(again) == ["explored"] and again.map_bytes == first.map_bytes and steps_of(again) < 50
    assert again.session.map_bytes and again.session.status.finished and end_of(again)["erases"] == 2
    assert (first.session.status.closure_before_mm, first.session.status.closure_after_mm) == (
        again.session.status.closure_before_mm, again.session.status.closure_after_mm)


def explored():
    """A memory that holds the explored cell."""
    nvm = Nvm()
    nvm._bytes[:] = calm().session.storage.nvm._bytes
    return nvm


def test_a_reset_at_every_frame_of_the_end_costs_no_map():
    # While the map is loaded, while it is built, when that is done, and while it is read.
    places, undisturbed = [], cell(nvm=explored())
    for number in range(1, 999):
        got = cell("reset@down=%d" % number, nvm=explored())
        if not got.done:
            break
        assert got.map_bytes == calm().map_bytes and got.session.status.finished and set(loaded(got)) == {"explored"}, number
        places += got.restarts
    assert got.same_as(undisturbed)
    assert set(places) >= set(range(2, steps_of(undisturbed) + 1)), "at every step"
    assert places.count(steps_of(undisturbed)) >= 4, "and while it is asked how it ended, and for the map"


def test_a_reset_when_the_robot_has_come_to_its_end():
    for back in (8, 0):
        got = cell("reset@step=%d" % (steps_of(calm()) - back))
        assert got.map_bytes == calm().map_bytes and loaded(got) == [None, "explored"]


def test_a_reset_in_the_search_goes_on_with_the_outline():
    saved = cell("power@byte=0").restarts[0]  # the outline is closed
    for ahead in (20, 80):
        got = cell("reset@step=%d" % (saved + ahead))
        assert loaded(got) == [None, "outline"] and got.session.status.finished
        assert steps_of(got) < steps_of(calm()) + 300, "the outline was not walked again"


@pytest.mark.parametrize("faults, found", [
    ("power@byte=500", [None, None]), ("power@byte=1060", [None, None]), ("power@byte=1300", [None, "outline"]),
    ("power@byte=2230", [None, "outline"]), ("power@byte=700,power@byte=1500,power@byte=2900", [None, None, None, "outline"]),
])
def test_power_lost_while_it_is_written(faults, found):
    got = cell(faults)
    assert loaded(got) == found and got.session.status.finished and end_of(got)["kept"] == "explored"
    assert got.restarts == sorted(got.restarts) and len(got.restarts) == faults.count("power")
    again = cell(nvm=got.session.storage.nvm)
    assert loaded(again)[-1] == "explored" and again.map_bytes == got.map_bytes


@pytest.mark.parametrize("number", [5, 30, 45])
def test_a_reset_before_the_first_step_is_counted_too(number):
    got = mission(CELL, steps=20, nvm=Nvm(), faults="reset@down=%d" % number)
    assert got.done and got.session.restarts == 1 and got.session.step == 20 and got.restarts[0] <= 20


def test_without_a_memory_a_reset_at_the_end_is_said():
    frames = mission(CELL, steps=STEPS).session.peer.link.counters[2]
    with pytest.raises(PeerError, match="before its map was read, and had not stored it"):
        mission(CELL, faults="reset@down=%d" % frames, steps=STEPS)


def test_a_memory_that_is_too_small_is_said():
    nvm = Nvm(2048)
    assert not cell(nvm=nvm).session.status.degraded
    nvm = Nvm(2048)
    nvm.size = 2047  # slots of nothing
    got = cell(nvm=nvm)
    assert end_of(got)["kept"] is None and got.map_bytes and not end_of(got)["erases"]


# A core that has a map of `size` bytes, and starts anew after so many pieces.
class Core:
    def __init__(self, size, breaks=(), changes=()):
        self.generation = 3
        self.data = self.made(size)
        self.reads, self.breaks, self.changes = [], list(breaks), list(changes)

    def made(self, size):
        data = bytes((self.generation * k * 7 + k * k) & 255 for k in range(size - 4))
        return data + zlib.crc32(data).to_bytes(4, "little")

    def ask(self, question, kind, fits=lambda message: True, dead_s=3.0):
        if question.NAME == "MAP_INFO":
            crc = zlib.crc32(self.data[:-4])
            return kind(self.generation, len(self.data), crc & 0xFFFF, crc >> 16)
        self.reads.append(question.offset)
        if self.breaks and len(self.reads) == self.breaks[0]:
            del self.breaks[0]
            raise Restarted(None)
        if self.changes and len(self.reads) == self.changes[0]:
            del self.changes[0]
            self.generation += 1
            self.data = self.made(len(self.data) - 30)
        if question.generation != self.generation:
            raise Refused("stale", schema.ERROR_STALE)
        answer = kind(self.generation, question.offset, self.data[question.offset:question.offset + 88])
        assert fits(answer), answer
        return answer

    def each_answer(self, questions, dead_s):
        for question, kind, fits in questions:
            yield self.ask(question, kind, fits, dead_s)


def pulled(core):
    pull = MapPull()
    while True:
        try:
            return pull.pull(core, 3.0), pull
        except Restarted:
            pass


@pytest.mark.parametrize("size", [4, 5, 88, 89, 1000])
def test_a_map_comes_whole_and_each_piece_once(size):
    core = Core(size)
    data, pull = pulled(core)
    assert data == core.data and core.reads == list(range(0, size, 88)) and pull.resumed == 0


def test_what_came_of_a_map_is_not_asked_for_again():
    core = Core(1000, breaks=[1, 4, 9])
    data, pull = pulled(core)
    assert data == core.data and pull.resumed == 2
    assert [at for at in sorted(set(core.reads)) if core.reads.count(at) > 1] == [0, 176, 528]  # those that were cut off


def test_a_map_that_changes_is_read_anew():
    core = Core(1000, changes=[5])
    data, pull = pulled(core)
    assert data == core.data and core.generation == 4 and pull.resumed == 0
    with pytest.raises(PeerError, match="changed 5 times"):
        MapPull().pull(Core(1000, changes=range(2, 100)), 3.0)


def test_another_map_of_the_same_number_is_told_by_its_sum():
    core, pull = Core(1000, breaks=[5]), MapPull()
    with pytest.raises(Restarted):
        pull.pull(core, 3.0)
    core.data = core.made(999) + core.data[999:]
    core.data = core.data[:-4] + zlib.crc32(core.data[:-4]).to_bytes(4, "little")
    assert pull.pull(core, 3.0) == core.data and pull.resumed == 0
