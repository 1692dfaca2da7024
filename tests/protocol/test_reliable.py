# The reliable layer between Link and HostLink with Window: every question is taken once and in its turn, every answer arrives.

from hypothesis import given
from hypothesis import strategies as st

from protocol import frame_reader as fr
from protocol import schema
from protocol.host_link import RELIABLE
from protocol.host_window import SIZE, Window
from protocol.link import Link
from protocol.messages import BY_NAME
from tests.protocol.messages import raw_frame, wire
from tests.protocol.test_link import BOOT_ID, hello, joined, receive, send, sent

STATUS, PARAM_GET = BY_NAME["STATUS"], BY_NAME["PARAM_GET"]
ANSWER = BY_NAME["PARAM_VALUE"]


def asked(core, host, seq, number):
    """What the core does with question `seq`: the frame that it sends, b"" if none."""
    got = receive(core, host.encode(PARAM_GET(number, 0), seq))
    if got and isinstance(got[0], tuple):
        return send(core, ANSWER(number, 0, 0, 7))
    return got[0] if got else b""


def test_a_question_that_comes_twice_is_no_message_and_gets_its_answer_byte_for_byte():
    core, host = joined()
    first = asked(core, host, 1, 5)
    ((message, ctl, seq, ack),) = host.take(first)
    assert message == ANSWER(5, 0, 0, 7) and ctl & RELIABLE and (seq, ack) == (1, 1)
    send(core, BY_NAME["POSE"](*range(14)))
    for _ in range(3):
        assert receive(core, host.encode(PARAM_GET(5, 0), 1)) == [first] and core.message_id == 0
    assert core.counters[fr.DUPLICATES] == 3


def test_an_acknowledged_answer_is_not_sent_again():
    core, host = joined()
    asked(core, host, 1, 5)
    host.ack = 1
    second = asked(core, host, 2, 6)
    assert receive(core, host.encode(PARAM_GET(5, 0), 1)) == []
    assert receive(core, host.encode(PARAM_GET(6, 0), 2)) == [second]


def test_a_question_whose_answer_could_not_be_retained_waits():
    core, host = joined()
    answers = [asked(core, host, 1, 1), asked(core, host, 2, 2)]
    assert asked(core, host, 3, 3) == b""
    assert receive(core, host.encode(PARAM_GET(1, 0), 1)) == answers[:1] and receive(core, host.encode(PARAM_GET(2, 0), 2)) == answers[1:]
    host.ack = 1
    assert asked(core, host, 3, 3) and asked(core, host, 4, 4) == b""
    assert receive(core, host.encode(PARAM_GET(2, 0), 2)) == answers[1:]


def test_an_acknowledgement_of_what_was_never_sent_is_none():
    core, host = joined()
    first = asked(core, host, 1, 1)
    for ack in (2, 3, 130, 200, 255):
        host.ack = ack
        assert receive(core, host.encode(PARAM_GET(1, 0), 1)) == [first]


def test_one_nak_a_gap():
    core, host = joined()
    asked(core, host, 1, 1)
    host.ack = 1
    ((nak, ctl, _, ack),) = host.take(asked(core, host, 3, 3))
    assert nak == BY_NAME["ACK"](2) and ctl & 16 and ack == 1
    assert asked(core, host, 3, 3) == b"" and asked(core, host, 4, 4) == b""
    assert asked(core, host, 2, 2) and asked(core, host, 3, 3)
    host.ack = 3
    assert host.take(asked(core, host, 5, 5))[0][0] == BY_NAME["ACK"](4)


def test_a_question_that_nobody_knows_takes_its_turn_and_its_error_is_retained():
    core, host = joined()
    strange = wire(raw_frame(0x7F, b"", schema.VERSION | RELIABLE | 1 << 5, seq=1))
    (error,) = receive(core, strange)
    assert host.take(error)[0][:2] == (BY_NAME["ERROR"](schema.ERROR_UNKNOWN_ID, 0x7F, 0), schema.VERSION | 4 | RELIABLE | 1 << 5)
    assert receive(core, strange) == [error]
    assert asked(core, host, 2, 2)


def test_telemetry_never_takes_an_answers_place():
    core, host = joined()
    first = asked(core, host, 1, 1)
    for _ in range(300):
        send(core, BY_NAME["POSE"](*range(14)))
    assert receive(core, host.encode(PARAM_GET(1, 0), 1)) == [first]


def test_a_new_epoch_begins_at_one_and_knows_no_old_answer():
    core, host = joined()
    asked(core, host, 1, 1)
    asked(core, host, 2, 2)
    old = host.encode(PARAM_GET(9, 0), 3)
    receive(core, host.reopen())
    assert core.epoch == 2 and receive(core, old) == [] and core.counters[fr.STALE] == 1
    ((_, _, seq, ack),) = host.take(asked(core, host, 1, 7))
    assert (seq, ack) == (1, 1) and asked(core, host, 2, 8)


def test_a_host_that_comes_later_opens_an_epoch_of_its_own():
    core, old_host = joined()
    asked(core, old_host, 1, 1)
    _, host = joined()
    host.__init__()
    receive(core, host.encode(BY_NAME["IDENTIFY"](0, 0)))
    (said,) = host.feed(hello(core))
    assert said.capabilities == 1
    receive(core, host.welcome(said))
    assert core.epoch == host.epoch == 2
    assert asked(core, host, 1, 2) and receive(core, old_host.encode(PARAM_GET(1, 0), 1)) == []


def test_a_welcome_said_twice_changes_nothing():
    core, host = joined()
    first = asked(core, host, 1, 1)
    receive(core, host.invitation())
    assert core.epoch == 1 and receive(core, host.encode(PARAM_GET(1, 0), 1)) == [first]


# The host's side over a line that does to each frame as it is told, and from then on nothing: what the core took, what was answered.
class Story:
    def __init__(self, down, up):
        self.core, self.host = joined()
        self.window = Window()
        self.fates = {"down": iter(down), "up": iter(up)}
        self.held = {"down": [], "up": []}
        self.taken, self.answered = [], []
        self.now_us = 0

    def line(self, way, frame):
        fate = next(self.fates[way], "deliver")
        if fate == "swap":
            self.held[way].append(frame)
            return []
        late, self.held[way] = self.held[way], []
        return {"deliver": [frame], "lose": [], "double": [frame] * 2}[fate] + late

    def say(self, question):
        for frame in self.line("down", question.wire):
            for got in receive(self.core, frame):
                if isinstance(got, tuple):
                    self.taken.append(got[1][0])
                    got = send(self.core, ANSWER(got[1][0], 0, 0, 7))
                for back in self.line("up", got):
                    self.hear(back)

    def hear(self, frame):
        for message, ctl, seq, _ in self.host.take(frame):
            if not ctl & RELIABLE:
                self.window.lost(message.missing)
            elif self.window.answered(seq, self.now_us):
                self.answered.append(message.parameter)
            self.host.ack = self.window.ack

    def run(self, total):
        opened = 0
        while len(self.answered) < total:
            self.now_us += 10_000
            assert self.now_us < 1_000_000 * total, "it stands still"
            while not self.window.full and opened < total:
                question, opened = self.window.open(), opened + 1
                self.window.sent(question, self.host.encode(PARAM_GET(question.seq, 0), question.seq), self.now_us)
                self.say(question)
            for question in self.window.due(self.now_us):
                self.say(question)


FATES = st.lists(st.sampled_from(["deliver", "lose", "double", "swap"]), max_size=80)


@given(down=FATES, up=FATES, total=st.sampled_from([3, 40, 300]))
def test_whatever_the_line_does_each_question_is_taken_once_in_order(down, up, total):
    story = Story(down, up)
    story.run(total)
    assert story.taken == [k & 255 for k in range(1, total + 1)]
    assert sorted(story.answered) == sorted(story.taken) and not story.window.out


def test_never_more_questions_are_out_than_answers_retained():
    core = Link(BOOT_ID)
    assert SIZE == len(core.kept)
    said = hello(core)
    _, host = joined()
    assert host.feed(said)[0].window_up == SIZE
    window = Window()
    for _ in range(SIZE):
        assert not window.full
        window.open()
    assert window.full


def test_an_answer_that_came_before_an_older_one_makes_no_room():
    window = Window()
    first, second = window.open(), window.open()
    window.answered(second.seq, 0)
    assert window.full and window.ack == 0
    window.answered(first.seq, 0)
    assert not window.full and window.ack == 2


def test_the_buffers_are_what_the_specification_states():
    core = Link(BOOT_ID)
    assert [len(kept) for kept in core.kept] == [fr.WIRE_MAX] * 2 and len(core.tx) == fr.WIRE_MAX
    buffers = {id(b) for b in (*core.kept, core.tx)}
    assert len(buffers) == 3
    send(core, BY_NAME["PONG"](1, 2))
    assert len(sent(core)) < 30 and id(core.tx) in buffers


def test_what_lay_behind_a_gap_is_repeated_too():
    window = Window()
    questions = [window.open(), window.open()]
    for question in questions:
        window.sent(question, b"", 0)
    window.lost(questions[0].seq)
    assert window.wait_us(1) == 0 and window.due(1) == questions and window.due(2) == []
