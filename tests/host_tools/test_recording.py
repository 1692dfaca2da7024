"""A log as the mission that it holds: what was told, what was asked, and how far it goes."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from host_tools import recording as parts
from host_tools.recording import LogUnusable, Recording
from protocol import parameters, schema, states
from protocol.log import LogWriter
from protocol.messages import BY_ID
from tests.host_tools.recorded import CRC, HEAD, STEPS, changed, cut_behind, sealed, wander


@pytest.mark.parametrize("state, over", [(states.DONE, True), (states.FAILED, True), (states.BUILD, False)])
def test_a_mission_is_over_when_the_core_says_so(state, over, written):
    data = changed("STATUS_RSP", 2, cut=cut_behind("STATUS_RSP", 2), state=lambda _: state)
    recording = Recording(written(data))
    assert len(list(recording.ticks())) == STEPS and recording.status["state"] == state and recording.over is over


def test_a_core_that_started_anew_before_the_first_step_is_told_as_it_was(written):
    hello = BY_ID[wander().frames[0][1][3]].unpack(wander().frames[0][1][HEAD:-CRC])
    earlier = [sealed("HELLO", 0, *hello._replace(boot_id=hello.boot_id - 1)), sealed("PARAM_SET", 1, 0, 0, 5),
               sealed("PARAM_VALUE", 1, 0, 0, 0, 5), sealed("PARAM_SET", 2, 0, 0, 6)]   # of which the last was never answered
    writer = LogWriter()
    data = writer.head() + b"".join(writer.record(9, direction, raw) for direction, raw in earlier + wander().frames)
    assert Recording(written(data)).parameters == wander().parameters


@given(st.data())
def test_whatever_happens_to_a_log_what_it_gives_is_how_it_was(tmp_path_factory, data):
    log = bytearray(wander().log())
    if data.draw(st.booleans()):
        del log[data.draw(st.integers(0, len(log))):]
    for _ in range(data.draw(st.integers(0, 3))):
        if log:
            log[data.draw(st.integers(0, len(log) - 1))] ^= data.draw(st.integers(1, 255))
    path = tmp_path_factory.mktemp("log") / "m"
    path.write_bytes(log)
    try:
        recording = Recording(str(path))
        ticks = list(recording.ticks())
    except LogUnusable as error:
        assert str(path) in str(error)
        return
    assert recording.parameters == wander().parameters[:len(recording.parameters)]
    for tick, true in zip(ticks, wander()._ticks):
        assert tick.question == true.question and tick.answer in (true.answer, None)
        assert tick.telemetry == true.telemetry[:len(tick.telemetry)]
    # What broke off behind a whole record shows no damage: replay says that it ends before its mission did.
    only_shorter = log == wander().log()[:len(log)]
    assert recording.damage or len(ticks) == STEPS or only_shorter


def test_a_parameter_is_known_by_its_name_whatever_its_number_was(written):
    data = wander().log()
    assert Recording(written(data)).parameters == [(0, 0, 1)]
    end = data.index(LogWriter().marker()[:16])
    told = [list(row) for row in parameters.PARAMETERS]
    swapped = LogWriter().head(parameters=[told[1], told[0], *told[2:]])
    assert Recording(written(swapped + data[end + len(LogWriter().marker()):])).parameters == [(1, 0, 1)]
    with pytest.raises(LogUnusable, match="sets the parameter wheels"):
        Recording(written(LogWriter().head(parameters=[["wheels", "", 1]]) + data[end + len(LogWriter().marker()):]))


def test_the_pace_of_a_free_run_is_not_replayed(written):
    number = next(i for i, row in enumerate(parameters.PARAMETERS) if row[0] == "tick_ms")
    data = changed("PARAM_SET", 1, parameter=lambda _: number, value=lambda _: 20)
    assert Recording(written(data)).parameters == []


def test_every_message_that_is_compared_exists():
    assert {*parts.NEEDED, *parts.AT_THE_END, *parts.TELEMETRY} <= {row[1] for row in schema.MESSAGES}
