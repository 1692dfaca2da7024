# The core as the robot sees it, after a mission of a few steps in this process: what comes late, seldom, or from a core that is no more.

from array import array
from types import SimpleNamespace

from hypothesis import given
from hypothesis import strategies as st
import pytest

from protocol import schema
from protocol.messages import BY_NAME
from sim_device.free_run import FreeRun
from sim_device.links.peer_errors import PeerError, Refused, Restarted
from sim_device.links.telling_order import LATE, TellingOrder
from tests.sim_device.faulty_mission import mission

ERROR, PING, PONG, POSE, STEP_RSP = (BY_NAME[name] for name in ("ERROR", "PING", "PONG", "POSE", "STEP_RSP"))
BOOT_S = 9.0


@pytest.fixture
def peer():
    return mission(steps=6).session.peer


def say(peer, step):
    values = array("i", bytes(4 * schema.VALUES_MAX))
    values[0] = step
    peer.send(peer.link.encode_step(values))
    peer.take(0)


def test_in_the_free_run_an_old_copy_of_a_step_is_passed_over_and_one_out_of_turn_is_not(peer):
    say(peer, 7)
    say(peer, 8)
    say(peer, 7)
    assert peer.newest[ERROR].detail == 9 and peer.answer(8).step == 8 and peer.answer(9) is None
    say(peer, 9)
    del peer.newest[STEP_RSP]   # it was lost
    say(peer, 8)
    assert peer.newest[ERROR].detail == 10 and peer.answer(9) is None
    peer.newest[ERROR] = ERROR(schema.ERROR_STEP_ORDER, BY_NAME["STEP"].ID, 0)
    assert peer.answer(2**30 - 1) is None, "the numbers go round"
    say(peer, 7)
    with pytest.raises(Refused, match="it expects step 10"):
        peer.answer(8)


@pytest.mark.parametrize("resetting", [True, False])
def test_a_core_that_boots_is_waited_for_whatever_is_asked(peer, resetting):
    link, read = peer._pty, peer._pty.read
    back_s = link.clock() + BOOT_S
    link.resetting = resetting

    def slowly(timeout_ms=0):
        data = read(timeout_ms)
        return data if link.clock() > back_s else b""

    link.read = slowly
    if resetting:
        assert peer.ask(PING(1), PONG).token == 1 and link.clock() > back_s
    else:
        with pytest.raises(PeerError, match="has not answered PING with PONG for 3 s"):
            peer.ask(PING(1), PONG)


def test_what_a_core_has_said_does_not_outlive_it(peer):
    assert POSE in peer.newest and peer.stores
    peer._pty.restart()
    with pytest.raises(Restarted) as again:
        peer.take(0)
    peer.begin(again.value.hello)
    assert POSE not in peer.newest and STEP_RSP not in peer.newest and not peer.stores


@given(gap=st.integers(1, 255 - LATE), late=st.integers(1, LATE), begin=st.integers(0, 1000))
def test_of_each_kind_the_newest_wins_however_seldom_it_comes(gap, late, begin):
    order = TellingOrder()
    for number in range(1, begin + 1):
        assert order.takes("often", number & 255)
    last = begin
    for _ in range(4):
        last += gap
        assert order.takes("seldom", last & 255) and not order.takes("seldom", last & 255), "once"
        assert not order.takes("seldom", last - late & 255) or late >= gap, "it was overtaken"
    assert order.takes("another", last - late & 255), "the first of its kind"


def test_a_kind_that_comes_after_two_hundred_others_is_no_old_one(peer):
    peer._open(peer.link.reopen())
    for number in range(1, 1000):
        kind = PING if number % 200 == 0 else PONG
        peer._heard(kind(*[number] * len(kind._fields)), number & 255, 0)
        assert peer.newest[kind][0] == number


def test_what_was_late_counts_on_in_the_run_with_the_next_core():
    before = SimpleNamespace(late_answers=7, late_answer_ms=31.5, missed_ticks=2)
    after = FreeRun(None, None, before=before)
    assert (after.late_answers, after.late_answer_ms, after.missed_ticks) == (7, 31.5, 2)
