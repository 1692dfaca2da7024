# Missions as stories: a home, a robot, and what must have come of it.

import pytest

from host_tools.map_file import KIND_BARRIER
from protocol import states
from sim_device.home import home_names, load_home
from tests.stories.mission import drive_mission

BUMPS_MAX = 5      # for each barrier that was followed
SHARE_MIN = 0.93


def expect_outline(mission, share_min=SHARE_MIN):
    assert mission.finished, f"ended in {states.NAMES[mission.core.state]} after {mission.robot_s:.0f} s"
    assert mission.score["outline_precision_5cm"] >= share_min, mission.score
    assert mission.score["outline_recall_5cm"] >= share_min, mission.score
    followed = 1 + sum(chain.kind == KIND_BARRIER for chain in mission.vector_map.chains)
    assert mission.robot.contacts <= BUMPS_MAX * followed


LONG = {"office_458": pytest.mark.soak}  # two hours of robot time


@pytest.mark.parametrize("home", [pytest.param(name, marks=LONG.get(name, ())) for name in home_names()])
def test_every_shipped_home_gets_its_outline(home):
    expect_outline(drive_mission(home))


@pytest.mark.parametrize("seed", [2, 3, 4])
def test_the_studio_is_mapped_whatever_the_noise(seed):
    expect_outline(drive_mission("studio", seed=seed), share_min=0.9)


def test_the_mission_goes_through_the_papers_states():
    entered = drive_mission("studio").states
    assert entered[-2:] == [states.BUILD, states.DONE]
    assert entered[:4] == [states.BOOT, states.INIT, states.FIND_WALL, states.ALIGN], [states.NAMES[s] for s in entered[:8]]
    assert states.CORNER_IN in entered and states.CORNER_OUT in entered


def test_dead_reckoning_alone_closes_the_outline_too():
    mission = drive_mission("studio", uwb="none")
    assert mission.finished and mission.core.vectors.used > 10


@pytest.mark.parametrize("barrier", range(4), ids=["triangle", "rectangle", "polygon", "circle"])
def test_a_robot_that_meets_a_barrier_of_fig_3_first_records_it_and_goes_on(barrier):
    """Paper Fig. 3: started in front of the barrier, it goes round it clockwise, keeps it, and still maps the outline."""
    home = load_home("fig3_barriers")
    ring = home.obstacles[barrier]
    left = min(x for x, _ in ring)
    middle = (min(y for _, y in ring) + max(y for _, y in ring)) / 2
    mission = drive_mission("fig3_barriers", start=(round(left - 0.5, 3), round(middle, 3)))
    expect_outline(mission)
    kept = [chain for chain in mission.vector_map.chains if chain.kind == KIND_BARRIER and chain.searched]
    assert kept, "no inside barrier was kept"
    size = max(max(x for x, _ in ring) - left, 0.1)
    near = [c for c in kept if abs(c.xy[:, 0].min() - left) < 0.1 and abs(c.xy[:, 0].max() - left - size) < 0.1]
    assert near, [(c.xy.min(0), c.xy.max(0)) for c in kept]


def test_a_mission_is_the_same_each_time():
    first, second = drive_mission("studio", seed=4), drive_mission.__wrapped__("studio", seed=4)
    assert (first.core.hash_lo, first.core.hash_hi) == (second.core.hash_lo, second.core.hash_hi)
    assert (first.robot.x_m, first.robot.y_m) == (second.robot.x_m, second.robot.y_m)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("home", ["vac_flat_d", "tb3_house", "giraff_c", "arch_flat_77"])
def test_real_homes_get_their_outline(real_homes, home, seed):
    expect_outline(drive_mission(str(real_homes / f"{home}.json"), seed=seed))
