# The loops of the search over corners: against the plain words for what they do, and against their machine code.

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.firmware_py.watched import watched
from tests.upy import run

frontier = watched("firmware_py.building.frontier")
CLOSED, NOBODY, UNREACHED = frontier.CLOSED, frontier.NOBODY, frontier.UNREACHED
COORDINATE = st.integers(-32768, 32767) | st.integers(-50, 50)
PLACE = st.tuples(COORDINATE, COORDINATE)
# place, cost in cm, next node, settled
NODES = st.lists(st.tuples(PLACE, st.integers(0, 9000) | st.just(UNREACHED), st.integers(0, 241), st.booleans()), max_size=30)


def arrays(nodes):
    costs = [cost for _, cost, _, _ in nodes]
    marks = [to | (CLOSED if settled else 0) for _, _, to, settled in nodes]
    return costs, marks, [c & 0xFFFF for place, _, _, _ in nodes for c in place]


def leg(a, b):
    """cm, with the stop; None: longer than any way that is looked at."""
    dx, dy = a[0] - b[0], a[1] - b[1]
    return (math.isqrt(dx * dx + dy * dy) + 2 >> 1) + frontier.STOP_CM if max(abs(dx), abs(dy)) < 11000 else None


@given(NODES, PLACE)
def test_the_node_chosen_may_lie_on_the_shortest_way(nodes, to):
    costs, marks, places = arrays(nodes)
    found = frontier.choose(costs, marks, places, len(nodes), *to)
    # No open node that was not chosen is surely better: straight on to the end it would not even cost as much.
    open_nodes = [k for k, (_, cost, _, settled) in enumerate(nodes) if not settled and cost < UNREACHED]
    straight = {k: nodes[k][1] + math.dist(nodes[k][0], to) / 2 for k in open_nodes}
    if found >= NOBODY:
        assert all(cost >= UNREACHED * 0.9 for cost in straight.values())
    else:
        assert found & 255 in open_nodes and found >> 8 <= min(straight.values())
        assert found >> 8 >= min(nodes[k][1] + max(abs(c - e) for c, e in zip(nodes[k][0], to, strict=True)) // 2 for k in open_nodes)


@given(PLACE, PLACE, PLACE)
def test_what_is_left_never_falls_by_more_than_a_leg(a, b, to):
    left = [frontier.choose(*arrays([(place, 0, 0, False)]), 1, *to) >> 8 for place in (a, b)]
    assert leg(a, b) is None or abs(left[0] - left[1]) <= leg(a, b)


@given(NODES.filter(len), PLACE)
def test_who_is_offered_a_better_way_takes_it(nodes, place):
    nodes = [*nodes, (place, 700, 3, True)]
    costs, marks, places = arrays(nodes)
    frontier.offer(costs, marks, places, len(nodes), *place, len(nodes) - 1)
    for k, (at, cost, to, settled) in enumerate(nodes):
        way = leg(place, at)
        better = not settled and way and (700 + way, len(nodes) - 1) < (cost, to)
        assert (costs[k], marks[k]) == ((700 + way, len(nodes) - 1) if better else (cost, to | (CLOSED if settled else 0)))


@given(NODES, PLACE, st.integers(0, 12000), st.integers(0, 241))
def test_the_other_candidates_come_in_the_order_of_their_costs(nodes, place, cost, node):
    given_arrays = arrays(nodes)
    candidates = [(nodes[k][1] + leg(place, nodes[k][0]) << 8) + k for k in range(len(nodes)) if nodes[k][3] and leg(place, nodes[k][0])]
    tried = cost << 8 | node
    left = sorted(c for c in candidates if tried < c < NOBODY)
    while left:
        tried = frontier.next_best(*given_arrays, len(nodes), *place, tried)
        assert tried == left.pop(0)
    assert frontier.next_best(*given_arrays, len(nodes), *place, tried) == NOBODY


@pytest.mark.parametrize("seed", [1, 77])
def test_the_machine_code_agrees(seed):
    printed = run.script("tests.upy.frontier_same", seed, 1500, heap="256k")
    *told, differed = [int(word) for word in printed.split()[1::2]]
    assert differed == 0 and min(told) > 200, printed
