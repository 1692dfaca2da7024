# CRC-32 and COBS against oracles that are not ours: zlib, and the definition of COBS.

import random
import zlib
from array import array

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from protocol import cobs, crc32, crc32_tables
from protocol.host_link import stuff
from tests.protocol.messages import cobs_by_definition

LOOPS = {"crc32_into": crc32.crc32_into, "TableCrc32": crc32.TableCrc32().into}


@pytest.mark.parametrize("loop", LOOPS)
@given(data=st.binary(max_size=120), before=st.integers(0, 5), after=st.integers(0, 5))
@example(data=b"", before=0, after=0)
@example(data=b"\0", before=1, after=0)
@example(data=b"123456789", before=0, after=3)
def test_crc_is_zlibs(loop, data, before, after):
    buf = bytearray(b"\xaa" * before + data + b"\x55" * after)
    out = array("H", [1, 2])
    LOOPS[loop](buf, before, before + len(data), out)
    assert out[0] | out[1] << 16 == zlib.crc32(data)
    assert buf[before:before + len(data)] == data


def test_crc_tables_are_the_polynomials():
    tables = (crc32_tables.T0, crc32_tables.T1, crc32_tables.T2, crc32_tables.T3)
    for index in range(256):
        entry = index
        for _ in range(8):
            entry = entry >> 1 ^ (0xEDB88320 if entry & 1 else 0)
        assert bytes(table[index] for table in tables) == entry.to_bytes(4, "little")


# Zeros are what COBS is about: make half the bytes zero.
zero_rich = st.lists(st.one_of(st.just(0), st.integers(0, 255)), max_size=200).map(bytes)


@given(data=zero_rich, before=st.integers(0, 4), after=st.integers(0, 4))
@example(data=b"", before=0, after=0)
@example(data=b"\0" * 105, before=1, after=2)
@example(data=b"\1" * 105, before=1, after=2)
def test_cobs_is_the_definition(data, before, after):
    buf = bytearray(b"\0" * before + b"\xee" + data + b"\0" * after)
    end = before + 1 + len(data)
    cobs.encode(buf, before, end)
    assert bytes(buf[before:end]) == cobs_by_definition(data) == stuff(data)
    assert end - before == cobs.encoded_size_max(len(data))
    assert 0 not in buf[before:end]
    assert bytes(buf[:before] + buf[end:]) == b"\0" * (before + after)
    assert cobs.decode(buf, before, end)
    assert bytes(buf[before + 1:end]) == data
    assert bytes(buf[:before] + buf[end:]) == b"\0" * (before + after)


def test_cobs_refuses_what_leads_past_the_end_or_stops_early():
    rng = random.Random(5)
    refused = 0
    for _ in range(2000):
        data = bytearray(rng.randrange(256) for _ in range(rng.randint(1, 30)))
        at, well_formed = 0, True
        while at < len(data) and data[at]:
            at += data[at]
        well_formed = at == len(data)
        refused += not well_formed
        assert cobs.decode(data, 0, len(data)) == well_formed
    assert 500 < refused < 2000
