# The bus: who sends first, what is refused and why, how long a frame keeps it.

from itertools import permutations

from hypothesis import given
from hypothesis import strategies as st
import pytest

from protocol.can_joiner import FRAME_MAX, CanJoiner
from sim_device.links.can_bus import BUS_OFF_S, CanBus
from sim_device.links.can_frame import bus_s, parse

BIT_S = 1 / 500_000


@pytest.fixture
def bus():
    bus = CanBus()
    for name in "abc":
        bus.attach(name).open = True
    return bus


def frame(text):
    found = parse(text.encode())
    assert found is not None, text
    return found


def carried(bus, now_s=0.0):
    lines = []
    while (passed := bus.transmit(now_s)) is not None:
        lines.append(passed[0].line.decode())
    return lines


@pytest.mark.parametrize("order", list(permutations(("t2410", "t2610", "t4600"))))
def test_the_lowest_id_goes_first_whoever_came_first(bus, order):
    for controller, line in zip(bus.controllers, order):
        assert bus.offer(controller, frame(line), 0)
    assert carried(bus) == ["t2410", "t2610", "t4600"]


def test_of_one_controller_the_order_is_kept_even_against_the_ids(bus):
    a, b, _ = bus.controllers
    for line in ("t7000", "t0010", "t0020"):
        bus.offer(a, frame(line), 0)
    bus.offer(b, frame("t1000"), 0)
    assert carried(bus) == ["t1000", "t7000", "t0010", "t0020"]


def test_a_short_id_wins_against_the_long_one_that_begins_with_it_and_loses_against_a_lower_one(bus):
    ours, long = frame("t2410"), frame("T090400000")
    assert 0x09040000 >> 18 == 0x241 and ours.rank < long.rank < frame("t2420").rank
    assert frame("T08FFFFFF0").rank < ours.rank


@given(lines=st.lists(st.tuples(st.integers(0, 2), st.integers(0, 0x7FF)), max_size=40))
def test_nothing_is_lost_doubled_or_reordered_between_two_controllers(lines):
    bus = CanBus()
    for name in "abc":
        bus.attach(name).open = True
    told = {0: [], 1: [], 2: []}
    for who, can_id in lines:
        if bus.offer(bus.controllers[who], frame("t%03X0" % can_id), 0):
            told[who].append("t%03X0" % can_id)
    seen = {0: [], 1: [], 2: []}
    while (passed := bus.transmit(0)) is not None:
        sent, sender, receivers = passed
        assert len(receivers) == 2 and sender not in receivers
        seen[bus.controllers.index(sender)].append(sent.line.decode())
    assert seen == told


def test_a_full_queue_refuses_and_takes_again_when_there_is_room(bus):
    a = bus.controllers[0]
    a.queue_max = 3
    assert [bus.offer(a, frame("t%03X0" % i), 0) for i in range(5)] == [True] * 3 + [False] * 2
    assert a.refused == 2
    assert carried(bus) == ["t0000", "t0010", "t0020"]
    assert bus.offer(a, frame("t0050"), 0)
    a.full_for = 2
    assert [bus.offer(a, frame("t0060"), 0) for _ in range(3)] == [False, False, True]
    assert bus.figures()["refused"] == 4


def test_bus_off_drops_hears_nothing_and_comes_back_by_itself(bus):
    a, b, c = bus.controllers
    bus.offer(a, frame("t1000"), 0)
    bus.bus_off(a, 10.0)
    assert not bus.offer(a, frame("t1010"), 10.0) and carried(bus, 10.0) == []
    bus.offer(b, frame("t2000"), 10.0)
    assert bus.transmit(10.0)[2] == [c]
    later_s = 10.0 + BUS_OFF_S
    assert bus.offer(a, frame("t1020"), later_s) and carried(bus, later_s) == ["t1020"]
    bus.offer(b, frame("t2010"), later_s)
    assert bus.transmit(later_s)[2] == [a, c]
    assert pytest.approx(128 * 11 * BIT_S) == BUS_OFF_S


def test_alone_on_the_bus_nobody_acknowledges(bus):
    a, b, c = bus.controllers
    b.open, c.listens_only = False, True
    bus.offer(a, frame("t1000"), 0)
    assert carried(bus) == [] and len(a.queue) == 1
    assert not bus.offer(c, frame("t1010"), 0), "it only listens"
    b.open = True
    assert carried(bus) == ["t1000"]


def test_a_lost_frame_has_kept_the_bus_and_reaches_nobody(bus):
    bus.faults.loss = 1.0
    bus.offer(bus.controllers[0], frame("t1008" + "00" * 8), 0)
    assert bus.transmit(0)[2] == [] and bus.lost == 1 and bus.busy_s > 0


def test_a_controller_told_to_be_full_is_so_for_that_long_and_bus_off_spares_who_asks(bus):
    a, b, c = bus.controllers
    assert bus.worsen(a, "jam", 0.1, 5.0) and [one.full_until_s for one in bus.controllers] == [5.1] * 3
    assert not bus.offer(b, frame("t1000"), 5.05) and bus.offer(b, frame("t1000"), 5.1)
    assert bus.worsen(a, "busoff", 0.0, 6.0)
    assert [one.off_until_s for one in bus.controllers] == [0.0, 6.0 + BUS_OFF_S, 6.0 + BUS_OFF_S] and not b.queue
    assert not bus.worsen(a, "loss", 1.5, 0) and not bus.worsen(a, "busy", 1.0, 0) and not bus.worsen(a, "heat", 0.1, 0)


@pytest.mark.parametrize("share", [0.2, 0.9])
def test_others_take_their_share_of_the_bus_with_ids_that_are_not_ours(bus, share):
    a, b, c = bus.controllers
    bus.worsen(a, "busy", share, 0)
    ours_s, others = 0.0, []
    for _ in range(300):
        bus.offer(a, frame("t2418" + "00" * 8), 0)
        while (passed := bus.transmit(0)) is not None:
            if passed[1] is a:
                ours_s += passed[0].bus_s
            else:
                assert passed[1] is None and passed[2] == [a, b, c]
                others.append(passed[0])
    assert (bus.busy_s - ours_s) / bus.busy_s == pytest.approx(share, abs=0.02)
    joiner = CanJoiner(bytearray(FRAME_MAX), 0)
    short = [int(one.line[1:4], 16) for one in others if one.line[:1] == b"t"]
    assert 0 < len(short) < len(others) and all(can_id >> 6 & 7 != 1 for can_id in short)
    assert not any(joiner.join(can_id, bytes(8), 8) for can_id in short) and joiner.broken == 0


def test_the_same_seed_brings_the_same_faults_about():
    def lost(seed):
        bus = CanBus()
        a, b = bus.attach("a"), bus.attach("b")
        a.open = b.open = True
        bus.worsen(a, "seed", seed, 0)
        bus.worsen(a, "loss", 0.3, 0)
        bus.worsen(a, "full", 0.3, 0)
        return [(bus.offer(a, frame("t1000"), 0), bool((bus.transmit(0) or ((), (), ()))[2])) for _ in range(200)]
    assert lost(1) == lost(1) != lost(2)
    assert 20 < sum(not taken for taken, _ in lost(1)) < 100 and 10 < sum(taken and not heard for taken, heard in lost(1)) < 100


def test_a_frame_keeps_the_bus_for_its_bits():
    # Davis, Burns and others, Controller Area Network schedulability analysis (2007): at most 55 + 10 bits a byte, 80 + 10.
    for size in range(9):
        assert bus_s(size, 0, 0, 0) == pytest.approx((55 + 10 * size) * BIT_S)
        assert bus_s(size, 1, 0, 0) == pytest.approx((80 + 10 * size) * BIT_S)
    whole = bus_s(64, 0, 1, 1)
    assert 0.25e-3 < whole < 0.45e-3 < bus_s(64, 0, 1, 0), "64 bytes at 2 Mbit/s, and at 500 kbit/s"
    assert bus_s(8, 0, 1, 1) < bus_s(8, 0, 0, 0)


@pytest.mark.parametrize("line, candump", [
    ("t2410", "241#"), ("t24121a2b", "241#1A2B"), ("T1ABCDEF01FF", "1ABCDEF0#FF"), ("r2414", "241#R"),
    ("b2419" + "ab" * 12, "241##1" + "AB" * 12), ("d2410", "241##0"),
])
def test_candump_lines(line, candump):
    assert frame(line).candump() == candump


@pytest.mark.parametrize("line", [
    "", "t", "t2411", "t8000", "t24191", "t2419" + "00" * 9, "t24100", "x2410", "t2G10", "T200000000", "d2419" + "00" * 9, "t241 0",
    "t2410\n", "\xff",
])
def test_what_is_no_frame(line):
    assert parse(line.encode("latin-1")) is None
