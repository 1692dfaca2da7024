# The list of inside barriers against a plain list, every number watched.

from hypothesis import given
from hypothesis import strategies as st

from tests.firmware_py.watched import watched

limits, barrier_list = watched("firmware_py.limits", "firmware_py.storage.barrier_list")
UNITS = st.integers(-32768, 32767)
SPREAD = st.integers(-40, 40).map(lambda k: 50 * k)


@given(st.lists(st.tuples(st.sampled_from(("add", "add", "add", "search", "drop")), SPREAD, SPREAD), max_size=150))
def test_the_list_keeps_the_order_of_finding_and_forgets_only_what_is_searched(work):
    listed = barrier_list.BarrierList()
    model = []
    lost = 0
    for what, x, y in work:
        if what == "add":
            new = all(abs(x - a) >= 60 or abs(y - b) >= 60 for a, b, _ in model)
            assert listed.add(x, y) == (new and (len(model) < limits.BARRIERS_MAX or any(mark for _, _, mark in model)))
            if new and len(model) == limits.BARRIERS_MAX:
                searched = next((i for i, (_, _, mark) in enumerate(model) if mark), None)
                if searched is None:
                    lost += 1
                    continue
                del model[searched]
            if new:
                model.append([x, y, 0])
        elif model and what == "drop":
            listed.drop(abs(x) % len(model))
            del model[abs(x) % len(model)]
        elif model:
            i = listed.nearest(x, y)
            if i >= 0:
                model[i][2] = listed.marks[i] = 2
        assert [[listed.xs[i], listed.ys[i], listed.marks[i]] for i in range(listed.used)] == model
        assert listed.lost == lost


@given(st.lists(st.tuples(UNITS, UNITS), min_size=1, max_size=40), UNITS, UNITS)
def test_the_nearest_unsearched_one_comes_next(places, x, y):
    listed = barrier_list.BarrierList()
    for place in places:
        listed.add(*place)
    listed.marks[0] = 2
    i = listed.nearest(x, y)
    far = {k: ((listed.xs[k] - x) ** 2 + (listed.ys[k] - y) ** 2) ** 0.5 for k in range(1, listed.used)}
    assert i in far and far[i] <= min(far.values()) + 8 if far else i == -1


def test_who_was_tried_twice_is_not_tried_again():
    listed = barrier_list.BarrierList()
    listed.add(100, 100)
    listed.marks[0] += 1
    assert listed.nearest(0, 0) == 0
    listed.marks[0] += 1
    assert listed.nearest(0, 0) == -1


def test_the_one_that_the_robot_goes_to_keeps_its_mark_while_others_make_room():
    listed = barrier_list.BarrierList()
    for k in range(limits.BARRIERS_MAX):
        assert listed.add(100 * k, 0)
    listed.marks[3] = listed.marks[20] = 2
    listed.going = 20
    assert listed.add(0, 5000), "the place of number 3"
    assert listed.going == 19 and listed.xs[19] == 2000
    listed.drop(0)
    assert listed.going == 18 and listed.xs[18] == 2000
    assert listed.add(0, 5500)
    listed.marks[18] = 2
    assert not listed.add(0, 6000) and listed.lost == 1, "there is none but the one under way"
