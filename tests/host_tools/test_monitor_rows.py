"""State -> rows, without a terminal: what a person reads is what the core said."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from host_tools import monitor_rows as rows
from host_tools.braille import Braille, View
from host_tools.monitor_state import PATH_POINTS_MAX, MonitorState
from protocol import states
from protocol.frame_reader import BOTH
from protocol.host_link import HostLink
from protocol.messages import BY_NAME
from tests.host_tools.tap_story import Story


def state_after(story, steps):
    state, link = MonitorState(), HostLink(listen=BOTH, any_epoch=True)
    for message in link.feed(story.hello()):
        state.apply(message)
    for step in range(0, steps + 1):
        for message in link.feed(story.frames(step)):
            state.apply(message)
    return state


def text_of(table, label):
    return next(text for name, text, _ in table if name == label)


def test_before_anything_was_heard_every_part_says_so():
    state = MonitorState()
    for table in (rows.store_rows(state), rows.memory_rows(state), rows.link_rows(state), rows.infrared_rows(state)):
        assert "not heard yet" in table[0][1]
    assert text_of(rows.mission_rows(state), "state") == "no state yet"
    assert rows.summary(state) == "nothing of a mission was heard"


def test_mission_rows_carry_the_pose():
    state = state_after(Story(), 500)
    table = rows.mission_rows(state)
    assert text_of(table, "state") == "FOLLOW"
    assert text_of(table, "pose") == "x 3.000 m  y 0.000 m  heading 0.0°"
    assert text_of(table, "odometry") == "x 3.030 m  y 0.000 m  heading 0.0°"
    assert text_of(table, "robot time") == "10.0 s, step 500"
    assert text_of(table, "path") == "3.00 m"


def test_what_is_degraded_is_shown_while_it_drives():
    state = MonitorState()
    kind = BY_NAME["STATUS_RSP"]
    state.apply(kind(**{field[0]: 0 for field in kind.FIELDS}))
    assert "degraded" not in [name for name, _, _ in rows.mission_rows(state)] and "degraded" not in rows.plain_line(state)
    state.apply(kind(**{field[0]: 0 for field in kind.FIELDS} | {"degraded": 1 << states.DEGRADED.index("infrared")}))
    assert text_of(rows.mission_rows(state), "degraded") == "infrared" and "degraded: infrared" in rows.plain_line(state)


def test_every_store_has_a_row_with_used_and_capacity():
    state = state_after(Story(), 1500)
    table = rows.store_rows(state)
    assert [row[0] for row in table] == ["vectors", "chains", "points", "hits"]
    assert "  2/768  4,608 B" in text_of(table, "vectors")


@pytest.mark.parametrize("name, said, warns", [("vectors", "5 lost", "warn"), ("chains", "5 lost", "warn"), ("points", "5 replaced", "")])
def test_a_map_that_lost_records_is_marked_and_a_ring_that_goes_round_is_not(name, said, warns):
    state = MonitorState()
    state.apply(BY_NAME["STORE"](index=0, name=name, used=64, capacity=64, record_bytes=12, lost=5))
    (label, text, mood), = rows.store_rows(state)
    assert (label, mood) == (name, warns)
    assert text.endswith(said) and "·" not in text


def test_buffers_of_fixed_size_are_one_row():
    state = MonitorState()
    for index, (name, size) in enumerate((("rx buffer", 256), ("tx frame", 108))):
        state.apply(BY_NAME["STORE"](index=index, name=name, used=size, capacity=size, record_bytes=1, lost=0))
    assert rows.store_rows(state) == [("buffers", "2 of fixed size, 364 B", "")]


def test_memory_and_link_rows():
    state = state_after(Story(), 100)
    assert "61,234 of 196,608 B" in text_of(rows.memory_rows(state), "heap")
    assert text_of(rows.memory_rows(state), "heap locked") == "yes"
    assert text_of(rows.link_rows(state), "frames in") == "100, 3,500 B"
    assert text_of(rows.link_rows(state), "bad frames") == "crc 1"


def test_a_core_that_allocated_after_boot_is_red():
    state = MonitorState()
    state.apply(BY_NAME["MEMORY"](heap_bytes=1000, heap_used_bytes=900, heap_locked=0, allocated_after_boot_bytes=16))
    assert [mood for _, _, mood in rows.memory_rows(state)] == ["", "warn", "bad"]


def test_infrared_rows_name_the_state_of_table_1():
    state = state_after(Story(), 10)    # ir_state 4: I6 alone is near
    table = rows.infrared_rows(state)
    assert text_of(table, "state") == "S5  00000100"
    assert [label[:2] for label, _, mood in table if mood == "warn"] == ["I6"]
    assert text_of(table, "I6  -90°").endswith(" 560")
    assert text_of(table, "ultrasonic") == "1200 mm"


def test_beams_stand_where_the_parameters_mount_them():
    state = state_after(Story(), 10)
    state.apply(BY_NAME["PARAM_SET"](parameter=8, index=1, value=16384))
    assert state.ir_bearings_deg[1] == 90.0
    picture = rows.infrared_picture(state)
    assert {len("".join(run for run, _ in line)) for line in picture} == {21}
    assert any(kind == "beam" for line in picture for _, kind in line)


def test_the_map_grows_with_vectors():
    story = Story()
    early, late = state_after(story, 300), state_after(story, story.last_step + 50)
    assert len(early.walls_m()) == 0 and len(late.walls_m()) == 4
    assert late.walls_m()[0] == (-0.2, -0.2, 4.2, -0.2)

    def walls(state):
        return sum(len(run) for line in rows.map_picture(state, 60, 20) for run, kind in line if kind == "wall")
    assert walls(early) == 0
    assert walls(late) > 100
    kinds = {kind for line in rows.map_picture(late, 60, 20) for _, kind in line}
    assert {"wall", "path", "robot"} <= kinds


def test_zoomed_in_the_robot_is_in_the_middle():
    state = state_after(Story(), 700)
    picture = rows.map_picture(state, 40, 20, zoom=4.0)
    row, = (i for i, line in enumerate(picture) if any(kind == "robot" for _, kind in line))
    column = len("".join(run for run, kind in picture[row]).split("↑")[0])
    assert abs(row - 10) <= 1 and abs(column - 20) <= 1


def test_a_new_boot_starts_the_map_afresh():
    story = Story()
    state = state_after(story, 1000)
    assert state.vectors and state.path_m
    for message in HostLink(any_epoch=True).feed(Story(boot_id=8).hello()):
        state.apply(message)
    assert not state.vectors and not state.path_m and state.steps == 0


def test_the_end_is_a_sentence():
    state = state_after(Story(end_state=states.FAILED), Story().last_step)
    assert state.ended
    assert rows.summary(state).startswith("FAILED after 46.7 s of robot time, 14.0 m of path")


def test_the_path_keeps_within_its_bound():
    state = MonitorState()
    for i in range(PATH_POINTS_MAX + 10):
        state.path_m.append((i * 0.1, 0.0))
    link = HostLink(any_epoch=True)
    for message in link.feed(Story().pose(5, states.FOLLOW)):
        state.apply(message)
    assert len(state.path_m) <= PATH_POINTS_MAX


@given(used=st.integers(0, 70000), capacity=st.integers(0, 70000), width=st.integers(1, 40))
def test_a_bar_has_its_width_and_is_full_only_at_capacity(used, capacity, width):
    bar = rows.bar(used, capacity, width)
    assert len(bar) == width
    assert (bar == "█" * width) == (capacity > 0 and used >= capacity)


@given(st.data())
def test_whatever_a_core_sends_the_rows_come(data):
    """Every message with any values its fields hold: no exception, and the map keeps its size."""
    state = MonitorState()
    for _ in range(data.draw(st.integers(1, 6))):
        kind = BY_NAME[data.draw(st.sampled_from(["POSE", "STORE", "VECTOR", "POINT", "LINK", "MEMORY", "STEP_RSP", "STEP",
                                                  "ERROR", "PARAM_SET", "STATUS_RSP"]))]
        raw = data.draw(st.binary(min_size=kind._HEAD.size, max_size=kind._HEAD.size))
        try:
            message = kind.unpack(raw)
        except ValueError:
            continue
        state.apply(message)
    for table in (rows.mission_rows, rows.store_rows, rows.memory_rows, rows.link_rows, rows.infrared_rows):
        assert table(state)
    assert rows.plain_line(state)
    picture = rows.map_picture(state, 30, 10)
    assert [len("".join(run for run, _ in line)) for line in picture] == [30] * 10
    assert len(rows.infrared_picture(state)) == 10


def test_braille_dots_are_where_they_belong():
    raster = Braille(2, 1)
    for x, y in ((0, 0), (3, 3), (9, 9), (-1, 0)):
        raster.dot(x, y)
    assert raster.lines() == ["\u2840\u2808"]


@given(*[st.floats(-1e6, 1e6) for _ in range(4)])
def test_a_line_from_far_away_is_clipped(x0, y0, x1, y1):
    raster = Braille(10, 5)
    raster.line(x0, y0, x1, y1)
    assert [len(line) for line in raster.lines()] == [10] * 5


def test_a_view_shows_its_bounds_whole():
    view = View.fit(Braille(40, 20), (-3.0, 1.0, 5.0, 2.0))
    for x_m, y_m in ((-3.0, 1.0), (5.0, 2.0), (-3.0, 2.0), (5.0, 1.0)):
        assert view.cell(x_m, y_m) is not None
    assert view.cell(50.0, 1.5) is None
    (x0, _), (x1, _) = view.dots(0, 0), view.dots(1, 0)
    assert math.isclose(x1 - x0, view.dots_per_m)
