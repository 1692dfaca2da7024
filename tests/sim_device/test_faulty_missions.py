# Missions on a bad line, in this process on a virtual clock: whatever the line does and can be repaired, nothing of it is seen in the map.

import os

import pytest

from sim_device.links.peer import DEAD_S
from sim_device.links.peer_errors import PeerError
from tests.sim_device.faulty_mission import calm, campaign, mission, shrunk, spec

STEPS = 12
BACK_S = 1.0


@pytest.mark.timeout(300)
@pytest.mark.parametrize("missions, first_seed, steps", [(200, 1, 200), pytest.param(1000, 1001, 400, marks=pytest.mark.soak)])
def test_a_bad_line_leaves_the_mission_bit_identical(missions, first_seed, steps, record_count):
    counts = campaign(missions, ["studio", "flat"], steps, first_seed)
    print(counts)
    record_count("missions on a bad line (another map or hash)", missions, counts["different"])
    record_count("    faults in them", counts["faults"], 0)
    assert counts["different"] == 0, counts
    assert counts["faults"] > 300 * missions and counts["repeats"] > 100 * missions


def frames_down():
    return calm(steps=STEPS).session.peer.link.counters[2] + calm(steps=STEPS).session.peer.repeats


@pytest.mark.timeout(300)
@pytest.mark.parametrize("way, length_s, every", [("down", 0.3, 1), ("up", 0.3, 1), ("down", 2.0, 7), ("up", 1.9, 7),
                                                  *(pytest.param(way, k / 10, 1, marks=pytest.mark.soak)
                                                    for way in ("down", "up") for k in range(1, 20, 2))])
def test_the_cable_pulled_at_every_frame(way, length_s, every, record_count):
    # From the first word to the map's last piece: parameters, steps, status, map.
    states, bad = 0, []
    for number in range(1, 2 * frames_down(), every):
        got = mission(faults="cut@%s=%d:%gs" % (way, number, length_s), steps=STEPS)
        if not got.done:
            break  # beyond the mission's last frame
        states += 1
        late = got.link.clock() - calm(steps=STEPS).link.clock() > length_s + BACK_S
        bad += [number] * (late or not got.same_as(calm(steps=STEPS)))
    record_count("cable pulled (another map, or not back within 1 s)", states, len(bad))
    assert not bad
    assert states * every >= frames_down() - every


@pytest.mark.timeout(300)
def test_the_core_reset_at_every_frame(record_count):
    # While parameters are told and steps are taken it begins again; while the map is read it has nothing left to say.
    restarted = ended = 0
    bad = []
    for number in range(1, 2 * frames_down()):
        try:
            got = mission(faults="reset@down=%d" % number, steps=STEPS)
        except PeerError as error:
            assert "started anew before its map was read" in str(error), number
            ended += 1
            continue
        if not got.done:
            break
        restarted += got.session.restarts
        assert got.session.step == STEPS and got.session.status.step == STEPS and got.map_bytes
        bad += [number] * (not got.session.restarts and not got.same_as(calm(steps=STEPS)))  # before the first step nothing is lost
        assert got.link.clock() <= BACK_S
    record_count("core reset (something lost before the first step)", restarted + ended, len(bad))
    assert not bad
    assert restarted >= STEPS - 1 and ended >= 2


def test_a_reset_on_a_bad_line():
    for seed in range(1, 11):
        got = mission(faults="reset@step=60,reset@step=61,reset@step=130," + spec(seed), fault_seed=seed)
        assert got.session.restarts == 3 and got.session.step == 200, seed


def test_a_peer_that_is_gone_is_named_within_three_seconds():
    for faults, word in (("cut@step=30:60s", "STEP 30"), ("cut@down=9:60s", "PARAM_SET"), ("drop@down=1", None)):
        if word is None:
            assert mission(faults=faults, steps=STEPS).same_as(calm(steps=STEPS))
            continue
        with pytest.raises(PeerError, match="has not answered %s.* for 3 s" % word) as raised:
            mission(faults=faults)
        assert raised.value.done
    with pytest.raises(PeerError, match="nobody answered|no HELLO"):
        mission(faults="drop=1")
    assert DEAD_S == 3.0


def test_strays_of_256_questions_ago_cost_an_epoch_and_nothing_else():
    # Delays far beyond the time in which the numbers go round: an old frame comes when its number is due again.
    epochs = 0
    for seed in range(1, 7):
        got = mission(faults="dup=0.3,delay=%dms:0.02,drop=0.1" % (300 * seed), fault_seed=seed, steps=900)
        assert got.same_as(calm(steps=900)), seed
        epochs += got.session.peer.reopened
    print(epochs, "epochs")


def test_what_was_done_can_be_done_again(tmp_path):
    first = mission(faults=spec(5), fault_seed=5)
    path = tmp_path / "faults.txt"
    path.write_text("# as it was\n" + "\n".join(first.done) + "\n")
    again = mission(faults="@%s" % path, fault_seed=99)
    assert again.done == first.done and again.same_as(first)
    assert again.session.peer.frames == first.session.peer.frames


def test_a_schedule_shrinks_to_what_matters():
    items = ["drop@down=%d" % k for k in range(1, 60)] + ["cut@step=40:4s"] + ["dup@up=%d" % k for k in range(1, 60)]

    def fails(some):
        try:
            return not mission(faults=",".join(some), steps=50).same_as(calm(steps=50))
        except PeerError:
            return True
    assert shrunk(items, fails) == ["cut@step=40:4s"]


def test_nothing_is_left_behind():
    assert not [name for name in os.listdir() if name.startswith("faults-")]
