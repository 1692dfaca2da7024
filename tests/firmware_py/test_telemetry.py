# What a viewer hears: every vector and point in the end, whenever it began to listen.

from protocol import states
from tests.firmware_py.device_story import Story
from tests.firmware_py.puppet import NUMBERS


def heard(story, first, steps):
    for number in range(first, first + steps):
        story.step(number)
    told, story.telemetry = story.telemetry, []
    return [m for m in told if type(m).__name__ == "VECTOR"], [m for m in told if type(m).__name__ == "POINT"]


def with_vectors(story, count):
    store = story.core.vectors
    for i in range(count):
        store.append(i, -i, i & 63, 0)


def test_each_vector_is_told_once_soon_and_again_in_turn():
    story = Story()
    story.core.vectors.open_chain(1)
    with_vectors(story, 21)
    vectors, _ = heard(story, 1, 105)
    assert sorted({v.index for v in vectors}) == list(range(20))
    first = vectors[3]
    assert (first.x, first.y, first.x_end, first.y_end, first.sigma_mm, first.kind, first.chain) == (3, -3, 4, -4, 3, 1, 0)
    late, _ = heard(story, 106, 25 * 21)
    assert {v.index for v in late} == set(range(20))  # who comes late sees them all
    with_vectors(story, 1)
    new, _ = heard(story, 631, 5)
    assert [v.index for v in new] == [20]


def test_a_map_that_was_dropped_is_told_anew():
    story = Story()
    story.core.vectors.open_chain(0)
    with_vectors(story, 9)
    heard(story, 1, 60)
    story.core.vectors.drop(3, 9)
    vectors, _ = heard(story, 61, 20)
    assert [v.index for v in vectors][:2] == [0, 1]


def test_every_point_is_told_once_and_lost_ones_are_passed_over():
    story = Story()
    for i in range(5):
        story.core.points.add(i, 2 * i, 3 * i, i % 3)
    _, points = heard(story, 1, 60)
    assert [(p.order, p.kind, p.x, p.y, p.heading_bam) for p in points] == [(i, i % 3, i, 2 * i, 3 * i) for i in range(5)]
    for i in range(5, 105):
        story.core.points.add(i, 0, 0, 0)
    _, points = heard(story, 61, 330)
    assert [p.order for p in points] == list(range(73, 105))
    assert heard(story, 391, 20)[1] == []


def test_the_pose_says_where_the_mission_is():
    story = Story()
    story.one("PARAM_SET", NUMBERS["dock_x"], 0, 1_234_000)
    for number in range(1, 100):
        story.step(number, 6, 6)
    pose = [m for m in story.telemetry if type(m).__name__ == "POSE"][-1]
    o = story.core.odometry
    assert pose.step == 99 and pose.state == story.core.state == states.FIND_WALL
    assert (pose.odometry_x_um, pose.odometry_y_um, pose.path_mm) == (o.x_um, o.y_um, o.path_mm)
    assert abs(pose.x_um - pose.odometry_x_um) < 1000 and pose.x_um > 1_400_000
