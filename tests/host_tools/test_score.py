"""Every figure of the map against a case that was worked out by hand."""

import math

import numpy as np
import pytest
from shapely.geometry import LineString, Point

from host_tools.lines import distances, sample, share, weighted_percentile
from host_tools.lower_bound import connecting_tree_m, lower_bound_s, turns_rad
from host_tools.map_file import KIND_BARRIER
from host_tools.score import HomeTruth, enclosed_area, iou_free, score_map
from tests.host_tools.score_cases import chain, home, rectangle, vector_map

ROOM = rectangle(0, 0, 4, 3)
TABLE = rectangle(1.5, 1, 2.5, 2)
# The disc's centre stays 0.18 m from both walls of a corner: what lies over 0.23 m from there, either wall's last 3.7 cm, is not asked for.
CORNER = 0.18 - math.sqrt(0.23 ** 2 - 0.18 ** 2)
ROOM_ASKED = 14 - 8 * CORNER


def scored(the_home, the_map):
    return score_map(HomeTruth(the_home), the_map)


def test_the_true_map_scores_full_marks_everywhere():
    figures = scored(home(ROOM, [TABLE], (0.5, 0.5)), vector_map(chain(ROOM), chain(TABLE, KIND_BARRIER)))
    for key in ("precision_5cm", "recall_5cm", "outline_precision_5cm", "outline_recall_5cm", "iou_free"):
        assert figures[key] == pytest.approx(1.0, abs=1e-6), key
    assert figures["hausdorff_p95_cm"] == pytest.approx(0.0, abs=1e-6)


def test_one_of_four_walls_moved_by_six_centimetres_fails_and_by_four_passes():
    for offset, precision, recall in ((0.04, 1.0, 1.0), (0.06, None, None)):
        the_map = vector_map(chain([(0, 0), (4, 0), (4, 3 + offset), (0, 3 + offset)]))
        figures = scored(home(ROOM), the_map)
        if precision is None:
            # Mapped: the top wall (4 m) is off, ends too (6 cm from the true corners), and the last centimetre of either side.
            length = 14 + 2 * offset
            precision = (length - 4 - 2 * (offset - 0.05)) / length
            # True: the top wall is off but for 5 cm at either end, where the mapped side walls pass.
            recall = (ROOM_ASKED - (4 - 2 * 0.05)) / ROOM_ASKED
        assert figures["precision_5cm"] == pytest.approx(precision, abs=0.003)
        assert figures["recall_5cm"] == pytest.approx(recall, abs=0.003)


def test_the_outline_figures_leave_islands_out_on_both_sides():
    the_home = home(ROOM, [TABLE], (0.5, 0.5))
    without_table = scored(the_home, vector_map(chain(ROOM)))
    assert without_table["outline_precision_5cm"] == without_table["outline_recall_5cm"] == 1.0
    assert without_table["precision_5cm"] == 1.0
    assert without_table["recall_5cm"] == pytest.approx(ROOM_ASKED / (ROOM_ASKED + 4), abs=0.002)

    invented = vector_map(chain(ROOM), chain(rectangle(3, 1, 3.5, 1.5), KIND_BARRIER))
    figures = scored(the_home, invented)
    assert figures["outline_precision_5cm"] == 1.0
    assert figures["precision_5cm"] == pytest.approx(14 / 16, abs=0.002)


def test_an_outline_that_follows_an_island_is_wrong_there():
    strayed = vector_map(chain(ROOM), chain(TABLE))  # both as outline
    figures = scored(home(ROOM, [TABLE], (0.5, 0.5)), strayed)
    assert figures["precision_5cm"] == 1.0
    assert figures["outline_precision_5cm"] == pytest.approx(14 / 18, abs=0.002)


def test_a_wall_that_no_disc_reaches_is_not_asked_for():
    # A slot 0.2 m wide and 1 m deep in the top wall: the disc of 0.18 m touches its mouth at most.
    slot = [(0, 0), (4, 0), (4, 3), (2.1, 3), (2.1, 4), (1.9, 4), (1.9, 3), (0, 3)]
    the_home = home(slot, start=(1, 1))
    truth = HomeTruth(the_home)
    asked = truth.outer_weights.sum()
    # The disc's centre comes to a height where it touches both corners of the mouth; the reach is 0.23 m from there.
    centre_y = 3 - math.sqrt(0.18 ** 2 - 0.1 ** 2)
    depth = centre_y + math.sqrt(0.23 ** 2 - 0.1 ** 2) - 3
    assert asked == pytest.approx(ROOM_ASKED - 0.2 + 2 * depth, abs=0.04)
    assert scored(the_home, vector_map(chain(ROOM)))["outline_recall_5cm"] > 0.98


def test_a_room_behind_a_gap_too_narrow_is_not_asked_for():
    # Two rooms of 2 x 2 m joined by a gap of 0.34 m: a disc of 0.17 m fits, one of 0.18 m does not.
    two = [(0, 0), (2, 0), (2, 0.8), (2.1, 0.8), (2.1, 0), (4.1, 0), (4.1, 2), (2.1, 2), (2.1, 1.14), (2, 1.14), (2, 2), (0, 2)]
    truth = HomeTruth(home(two, start=(1, 1)))
    # The left room's walls less the gap, and the jambs: the centre comes into the mouth until the disc touches both its corners.
    jamb = math.sqrt(0.23 ** 2 - 0.17 ** 2) - math.sqrt(0.18 ** 2 - 0.17 ** 2)
    assert truth.outer_weights.sum() == pytest.approx(8 - 8 * CORNER - 0.34 + 2 * jamb, abs=0.02)
    assert truth.swept.area == pytest.approx(4 - 4 * (0.18 ** 2 - math.pi * 0.18 ** 2 / 4), abs=0.03)


def test_hausdorff_is_the_worse_direction():
    # Half of the room mapped: the unmapped half is up to 2 m from the map.
    half = vector_map(chain([(2, 0), (0, 0), (0, 3), (2, 3)], closed=False))
    figures = scored(home(ROOM), half)
    # True wall by distance from the map: 7 m at 0, two stretches of 2 m rising from 0 to 2, and the far wall of 3 m at 2 m, whose
    # nearest mapped points are the ends (2, 0) and (2, 3): farthest in its middle. The worst 5 % of the wall lie around it.
    from_middle = 0.05 * ROOM_ASKED / 2
    assert figures["hausdorff_p95_cm"] == pytest.approx(100 * math.hypot(2, 1.5 - from_middle), abs=1)
    assert figures["precision_5cm"] == 1.0


def test_iou_of_a_room_mapped_too_small_by_a_known_strip():
    truth = HomeTruth(home(ROOM))
    # A disc does not reach into the four corners: 12 m2 less (4 - pi) r2.
    swept = 12 - (4 - math.pi) * 0.18 ** 2
    assert truth.swept.area == pytest.approx(swept, abs=1e-3)
    lost = 3 - (2 - math.pi / 2) * 0.18 ** 2  # the strip with two of the corners
    assert iou_free(truth, vector_map(chain(rectangle(0, 0, 3, 3)))) == pytest.approx((swept - lost) / swept, abs=2e-4)


def test_iou_of_a_map_too_large_is_limited_to_what_the_robot_sweeps():
    truth = HomeTruth(home(ROOM))
    assert iou_free(truth, vector_map(chain(rectangle(-1, -1, 5, 4)))) == pytest.approx(1.0)


def test_a_missed_table_costs_its_area_and_one_that_is_not_there_too():
    with_table = HomeTruth(home(ROOM, [TABLE], (0.5, 0.5)))
    assert iou_free(with_table, vector_map(chain(ROOM))) == pytest.approx(1.0)  # limited to the swept area: none of it is table
    bare = HomeTruth(home(ROOM, start=(0.5, 0.5)))
    invented = vector_map(chain(ROOM), chain(TABLE, KIND_BARRIER))
    assert iou_free(bare, invented) == pytest.approx((bare.swept.area - 1) / bare.swept.area)


def test_an_outline_that_crosses_itself_keeps_its_area():
    # The ring overshoots at a corner: a loop of 0.1 x 0.1 m outside, wound the other way.
    overshoot = [(0, 0), (4, 0), (4, 3.1), (3.9, 3.1), (3.9, 3), (4.1, 3), (0, 3)]
    assert enclosed_area(vector_map(chain(overshoot))).area == pytest.approx(12 + 0.01, abs=1e-6)


def test_a_knot_of_almost_collinear_vectors_is_measured_all_the_same():
    # As of a robot that turned on the spot in a box: noding without a grid raises GEOSException on these five points.
    knot = np.array([(-16, 38), (12, 36), (-30, 38), (20, 36), (-5, 37)]) * 0.005
    assert 0 < enclosed_area(vector_map(chain(knot))).area < 0.25 * 0.01


def test_outline_chains_with_gaps_enclose_the_ring_through_all_of_them():
    broken = vector_map(chain([(0, 0), (4, 0)], closed=False), chain([(4, 0.1), (4, 3), (0, 3), (0, 0.1)], closed=False))
    assert enclosed_area(broken).area == pytest.approx(12, abs=1e-9)


def test_no_map_gives_no_figures_but_a_recall_of_zero():
    figures = scored(home(ROOM), vector_map())
    assert figures["recall_5cm"] == figures["outline_recall_5cm"] == 0.0
    assert [figures[key] for key in ("precision_5cm", "outline_precision_5cm", "hausdorff_p95_cm", "iou_free")] == [None] * 4


def test_lower_bound_of_a_rectangle():
    truth = HomeTruth(home(ROOM, start=(1.0, 1.5)))
    # Contour 3.6 x 2.6 m, 0.8 m from the start to it, and four right angles.
    assert lower_bound_s(truth, 0.3, 2.0) == pytest.approx((2 * (3.6 + 2.6) + 0.8) / 0.3 + 2 * math.pi / 2.0)


def test_lower_bound_with_a_table_and_with_lanes():
    truth = HomeTruth(home(ROOM, [TABLE], (0.5, 1.5)))
    # Outer contour 12.4 m; the table's is rolled: 4 m and a full circle of 0.2 m. From the start 0.3 m to the one, 0.8 m to the
    # other; the tree joins them by 0.3 + min(0.8, 0.6): between outline and table lie 1.0 - 2 * 0.2 m above and below.
    tree = 0.3 + 0.6
    expected = (12.4 + 4 + 2 * math.pi * 0.2 + tree) / 0.3 + (2 * math.pi + 2 * math.pi) / 2.0
    assert lower_bound_s(truth, 0.3, 2.0) == pytest.approx(expected, rel=1e-3)
    with_lanes = lower_bound_s(truth, 0.3, 2.0, lanes=True)
    assert with_lanes - lower_bound_s(truth, 0.3, 2.0) == pytest.approx(truth.swept.area / 0.75 / 0.3)


def test_connecting_tree_is_minimal():
    assert connecting_tree_m([Point(0, 0), Point(1, 0), Point(3, 0), Point(1, 5)]) == pytest.approx(1 + 2 + 5)


def test_turns_count_both_ways():
    ell = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2), (0, 0)]  # five left turns, one right
    assert turns_rad(LineString(ell)) == pytest.approx(6 * math.pi / 2)


def test_sampling_keeps_length_and_weights():
    points, weights = sample([(0, 0, 1, 0), (5, 5, 5, 5), (0, 0, 0, 0.004)])
    assert weights.sum() == pytest.approx(1.004)
    assert weights.max() <= 0.01 + 1e-12 and len(points) == 101
    assert share(weights, points[:, 0] < 0.25) == pytest.approx((0.25 + 0.004) / 1.004)


def test_distances_are_to_the_segment_not_to_its_line():
    assert distances(np.array([(2.0, 0.0), (0.5, 0.3)]), [(0, 0, 1, 0)]) == pytest.approx([1.0, 0.3])
    assert np.isinf(distances(np.zeros((2, 2)), np.zeros((0, 4)))).all()


def test_weighted_percentile_by_weight_not_by_count():
    values, weights = np.array([3.0, 1.0, 2.0]), np.array([1.0, 18.0, 1.0])
    assert weighted_percentile(values, weights, 50) == 1.0
    assert weighted_percentile(values, weights, 95) == 2.0
    assert weighted_percentile(values, weights, 96) == 3.0
