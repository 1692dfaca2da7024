# The range coder: what was written is read, by the same calls; likely bits cost little; and the machine code agrees.

from array import array

from hypothesis import given
from hypothesis import strategies as st

from protocol import range_code
from tests.upy import run

PIECES = st.one_of(
    st.tuples(st.just("bit"), st.integers(-1, 9), st.integers(0, 1)),
    st.tuples(st.just("number"), st.integers(1, 7), st.integers(0, 65535)),
    st.tuples(st.just("number"), st.just(5), st.integers(0, 20)),
)


def coded(pieces, buf, reads):
    """-> (what the calls said, bytes)"""
    s, model = array("i", bytes(24)), array("h", bytes(64))
    range_code.open_range(s, buf, reads, len(buf) - 1)
    range_code.forget(model, 32)
    said = []
    for kind, place, value in pieces:
        value = 0 if reads else value
        if kind == "bit":
            said.append(range_code.code_bit(s, model, buf, place, value))
        else:
            said.append(range_code.code_number(s, model, buf, 10, place, value))
        assert 0 <= s[range_code.LOW] < 1 << 24 and 0 < s[range_code.RANGE] < 1 << 24 and min(model) > 0
    range_code.close_range(s, buf)
    return said, s[range_code.AT]


@given(st.lists(PIECES, max_size=200))
def test_what_is_written_is_read(pieces):
    buf = bytearray(4096)
    said, size = coded(pieces, buf, 0)
    assert said == [value for *_, value in pieces]
    again, read = coded(pieces, bytes(buf[:size]) + bytes(8), 1)
    assert again == said and read - 1 == size


def test_what_is_likely_costs_little_and_the_unknown_its_bits():
    likely = [("bit", 0, 0)] * 2000
    assert coded(likely, bytearray(4096), 0)[1] < 2000 * 0.03 / 8 + 10
    odd = [("bit", -1, k >> 1 & 1) for k in range(2000)]
    assert coded(odd, bytearray(4096), 0)[1] <= 2000 / 8 + 3


def test_the_machine_code_agrees_and_nothing_is_allocated():
    words = run.script("tests.upy.range_code_same", 5, 3000, heap="256k").split()
    assert words[0] == "coded" and int(words[1]) > 3000 and words[2:] == ["differed", "0"], words
