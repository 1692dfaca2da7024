# One stream, two targets: what the core answers in CPython it answers in the MicroPython VM, over the real link.
# The third target has its tests in tests/stm32/test_equality.py.

from hypothesis import example, given, settings

from host_tools.core_process import running_core
from tests.host_tools.recorded import WANDER
from tests.stories.streams import expect_equal
from tests.strategies import examples, settings_of_a_robot, streams


@settings(max_examples=examples(15))
@given(settings_of_a_robot(), streams(max_segments=4, max_ticks=150))
@example([], WANDER)
def test_any_stream_has_the_same_answers_on_unix(micropython, parameters, segments):
    with running_core("unix") as port:
        expect_equal("unix", port, parameters, segments)
