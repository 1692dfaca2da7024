"""How a watch begins and ends: each way with one sentence and its exit code."""

import pytest

from host_tools.monitor_session import GARBAGE_S, SILENCE_S, MonitorSession, WatchEnded, end_of_mission
from host_tools.terminal_port import PortClosed
from protocol import states
from tests.host_tools.tap_story import Story


class Cable:
    """A port whose bytes the test puts in; what the monitor says is in `said`."""

    path = "out/tap"

    def __init__(self):
        self.pieces, self.said, self.open = [], b"", True

    def read(self, timeout_s=0.0):
        if self.pieces:
            return self.pieces.pop(0)
        if not self.open:
            raise PortClosed("out/tap was closed by its other end while in use.")
        return b""

    def write(self, data):
        self.said += data


@pytest.fixture
def watch():
    class Watch:
        def __init__(self):
            self.now_s = 100.0
            self.cable = Cable()
            self.session = MonitorSession(self.cable, first_frame_s=60.0, clock=lambda: self.now_s)

        def hear(self, data):
            self.cable.pieces.append(data)
            return self.session.pump()

        def ends(self):
            with pytest.raises(WatchEnded) as caught:
                self.session.pump()
            return caught.value

    return Watch()


def test_a_mission_is_followed_to_its_end(watch):
    story = Story()
    watch.hear(story.hello())
    for step in range(story.last_step + 1):
        watch.hear(story.frames(step))
    watch.cable.open = False
    assert not watch.session.pump()
    assert watch.session.closed_after_end
    end = end_of_mission(watch.session.state)
    assert end.code == 0 and end.sentence.startswith("The mission ended: DONE after")


def test_a_failed_mission_is_not_a_success(watch):
    story = Story(end_state=states.FAILED)
    watch.hear(story.frames(story.last_step))
    assert end_of_mission(watch.session.state).code == 1


def test_hello_is_asked_for_until_it_comes_and_nothing_else_is_said(watch):
    watch.session.pump()
    asked = watch.cable.said
    assert asked[4:6] != b"" and asked.count(b"\x03") >= 1     # IDENTIFY
    watch.now_s += 1.5
    watch.session.pump()
    assert len(watch.cable.said) == 2 * len(asked)
    watch.hear(Story().hello())
    watch.now_s += 5
    watch.hear(Story().frames(1))
    assert len(watch.cable.said) == 2 * len(asked)


def test_closed_while_in_use(watch):
    watch.hear(Story().frames(50))
    watch.cable.open = False
    end = watch.ends()
    assert end.code == 3
    assert end.sentence == ("out/tap was closed by its other end while in use. Last: FOLLOW after 1.0 s of robot time, "
                            "0.3 m of path, 1 points, 0 vectors, 0 bumps.")


def test_a_peer_that_never_says_anything(watch):
    watch.now_s += 59
    watch.session.pump()
    assert "nothing heard" in watch.session.waiting_for()
    watch.now_s += 2
    end = watch.ends()
    assert end.code == 3 and "nothing was heard in 60 s" in end.sentence


def test_a_peer_that_falls_silent(watch):
    watch.hear(Story().frames(50))
    watch.now_s += SILENCE_S - 1
    watch.session.pump()
    assert watch.session.waiting_for() == "nothing heard for 9 s"
    watch.now_s += 2
    end = watch.ends()
    assert end.code == 3 and "has said nothing for 10 s; last: FOLLOW" in end.sentence


def test_silence_after_the_end_is_no_fault(watch):
    story = Story()
    watch.hear(story.frames(story.last_step))
    watch.now_s += 1000
    watch.session.pump()
    assert watch.session.waiting_for() == ""


def test_garbage_from_the_start(watch):
    noise = bytes(range(1, 256)) * 4
    watch.hear(noise)
    watch.now_s += GARBAGE_S + 0.1
    end = watch.ends()
    assert end.code == 3 and "1,020 bytes, not one good frame" in end.sentence


def test_garbage_later(watch):
    watch.hear(Story().frames(50))
    for _ in range(int(SILENCE_S) - 1):
        watch.now_s += 1
        watch.hear(b"\0garbage that is no frame\0")
    watch.now_s += 2
    end = watch.ends()
    assert end.code == 3 and "has sent only garbage for 10 s" in end.sentence


def test_garbage_between_good_frames_is_counted_and_the_watch_goes_on(watch):
    for step in range(100):
        watch.hear(b"\0hit\0" + Story().frames(step) + b"\0\x05ab\0")
    assert watch.session.state.steps == 99
    assert watch.session.link.counts()["bad_length"] == 200


def test_a_schema_that_nobody_tells_is_named(watch):
    watch.hear(Story().hello(schema_lo=0x1234, schema_hi=0xABCD))
    watch.now_s += SILENCE_S + 1
    watch.cable.pieces.append(Story().hello(schema_lo=0x1234, schema_hi=0xABCD))
    end = watch.ends()
    assert end.code == 3 and "schema is abcd1234" in end.sentence and "update the older" in end.sentence


def test_the_screen_has_its_turn_when_bytes_never_cease(watch):
    watch.cable.pieces = [Story().frames(1)] * 1000
    assert watch.session.pump()
    assert watch.cable.pieces
