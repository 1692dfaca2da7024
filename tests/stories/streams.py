# The same stream of STEPs on another target over its real link: each answer, each message of telemetry, the end and the
# map must be those of the core in this process. Where they are not, the message names the step and the field.

from host_tools.finding import Finding
from host_tools.side_by_side import SideBySide
from tests.host_tools.recorded import Recorded


def expect_equal(name, port, parameters, segments):
    """`port`: a TerminalPort on which a core speaks that has just been started."""
    recorded = Recorded(legal(parameters), segments)
    run = SideBySide(recorded, {name: port}, with_log=True)
    while run.advance():
        difference = run.telemetry_apart or run.apart
        assert difference is None, explained(run, difference)
    status = run.finish()[name]
    assert run.telemetry_apart is None, explained(run, run.telemetry_apart)
    assert status[:status._fields.index("heap_bytes")] == recorded.status[:status._fields.index("heap_bytes")]
    assert run.cores[0].map_bytes() == recorded.map_bytes
    assert status.allocated_after_boot_bytes == 0 and run.steps == sum(segment.ticks for segment in segments)
    assert not any(value for cause, value in run.cores[0].link.counts().items() if cause.startswith("bad_"))


def legal(parameters):
    """Free run has tests of its own: here nobody waits for a clock."""
    from host_tools.recording import NUMBERS, OF_THE_CLOCK
    return [triple for triple in parameters if triple[0] not in [NUMBERS[name] for name in OF_THE_CLOCK]]


def explained(run, difference):
    finding = Finding.of(run, difference)
    return "\n".join([finding.headline(), *finding.lines()])
