"""The files of --out, and map.bin read back."""

import errno
import json
import math
import os
import struct
import sys
import zlib
from array import array

import numpy as np
import pytest

from host_tools.result import empty_result, evaluate, mission_map
from host_tools.export import FILES, geojson, tum, write_all
from host_tools.map_file import KIND_BARRIER, KIND_OUTLINE, MapError, Records, decode_map, encode_map, encode_records
from host_tools.mission_log import read_mission
from host_tools.score import HomeTruth
from host_tools.whole_file import whole_file, write_result
from protocol.map_code import ABOUT, EDGES
from tests.host_tools.score_cases import chain, home, rectangle, vector_map
from tests.host_tools.synthetic_mission import DOCK, SyntheticMission

OPTIONS = {"target": "cpython", "link": "pty", "mode": "improved", "uwb": "tof", "odometry": "calibrated", "seed": 1}
HOME = home(rectangle(0.5, 0.5, 3.5, 3.5), [rectangle(2, 2, 2.4, 2.4)], start=DOCK[:2])


@pytest.fixture
def mission(tmp_path):
    data = encode_map([chain(rectangle(0.5, 0.5, 3.5, 3.5)), chain([(2, 2), (2.4, 2)], KIND_BARRIER, closed=False)])
    mission = read_mission(*SyntheticMission().finish(data).save(tmp_path))
    the_map, _ = mission_map(mission)
    result = evaluate(empty_result("by hand", OPTIONS), mission, HomeTruth(HOME), the_map, {}, 1)
    return mission, the_map, result


def test_every_file_is_written_and_others_stay(mission, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "notes.txt").write_text("mine")
    (out / "map.bin").write_bytes(b"of an earlier mission")
    assert write_all(out, HOME, *mission) == []
    assert {path.name for path in out.iterdir()} == {*FILES, "notes.txt"}
    assert (out / "notes.txt").read_text() == "mine"
    assert (out / "map.bin").read_bytes() == mission[0].map_bytes
    assert json.loads((out / "result.json").read_text()) == mission[2]
    assert (out / "map.png").read_bytes().startswith(b"\x89PNG") and (out / "map.png").stat().st_size > 10_000
    assert len((out / "estimate.tum").read_text().splitlines()) == len((out / "truth.tum").read_text().splitlines()) == len(mission[0].pose)


def test_no_map_of_an_earlier_mission_is_left_to_pass_for_this_one(tmp_path):
    for name in FILES:
        (tmp_path / name).write_bytes(b"old")
    write_all(tmp_path, HOME, None, None, empty_result("by hand", OPTIONS))
    assert [path.name for path in tmp_path.iterdir()] == ["result.json"]


def test_without_matplotlib_all_but_the_picture_is_written(mission, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    out = tmp_path / "out"
    out.mkdir()
    notes = write_all(out, HOME, *mission)
    assert len(notes) == 1 and "pip install" in notes[0] and "\n" not in notes[0]
    assert {path.name for path in out.iterdir()} == set(FILES) - {"map.png"}


def test_a_file_that_cannot_be_finished_leaves_the_old_one(tmp_path):
    path = tmp_path / "r.json"
    path.write_text("of an earlier mission")
    with pytest.raises(OSError) as caught, whole_file(path) as beside:
        with open(beside, "w") as file:
            file.write("half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert caught.value.filename == str(path)
    assert path.read_text() == "of an earlier mission" and os.listdir(tmp_path) == ["r.json"]


def test_what_is_no_file_is_written_to_and_not_replaced(tmp_path):
    link, pipe = tmp_path / "link", tmp_path / "pipe"
    link.symlink_to(tmp_path / "real")
    write_result(link, {"of": "this mission"})
    assert link.is_symlink() and json.loads((tmp_path / "real").read_text()) == {"of": "this mission"}
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_result(pipe, {"of": "this mission"})
    assert json.loads(os.read(reader, 1000)) == {"of": "this mission"} and pipe.is_fifo()
    os.close(reader)


def test_where_nothing_can_be_put_in_the_place_it_is_written_to(tmp_path, monkeypatch):
    read, write = os.pipe()
    write_result("/dev/fd/%d" % write, {"of": "this mission"})      # `--json /dev/stdout | cat`, and the shell's >( )
    assert json.loads(os.read(read, 1000)) == {"of": "this mission"}
    os.close(read), os.close(write)
    long = tmp_path / ("n" * 250)       # no room for the name beside; in a folder of others' it is the same
    write_result(long, {"of": "this mission"})

    def busy(*_):
        raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))
    monkeypatch.setattr(os, "replace", busy)
    mounted = tmp_path / "mounted"
    mounted.write_text("of an earlier mission" * 9)
    write_result(mounted, {"of": "this mission"})
    for path in (long, mounted):
        assert json.loads(path.read_text()) == {"of": "this mission"}
    assert sorted(os.listdir(tmp_path)) == ["mounted", long.name]


def test_a_full_disk_leaves_the_old_file_even_where_none_can_be_begun(tmp_path, monkeypatch):
    path = tmp_path / "r.json"
    path.write_text("of an earlier mission")

    def full(*_, **__):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    monkeypatch.setattr("builtins.open", full)
    with pytest.raises(OSError) as caught:
        write_result(path, {"of": "this mission"})
    assert caught.value.filename == str(path) and path.read_text() == "of an earlier mission"


def test_geojson_has_a_line_a_vector_with_its_properties():
    chair = chain([(1, 0.5), (1.5, 0.5), (1.5, 0.75)], KIND_BARRIER, closed=False, region=3)
    the_map = vector_map(chain(rectangle(0, 0, 2, 1), sigma_mm=7), chair)
    collection = geojson(the_map, "by hand")
    assert collection["type"] == "FeatureCollection" and "local metres" in collection["coordinate_system"]
    lines = [(f["geometry"]["coordinates"], f["properties"]) for f in collection["features"]]
    assert len(lines) == 4 + 2
    assert lines[3] == ([[0.0, 1.0], [0.0, 0.0]], {"kind": "outline", "chain": 0, "order": 3, "sigma_mm": 7, "region": 0})
    assert lines[5] == ([[1.5, 0.5], [1.5, 0.75]], {"kind": "barrier", "chain": 1, "order": 1, "sigma_mm": 3, "region": 3})
    assert json.loads(json.dumps(collection)) == collection


def test_tum_lines_hold_time_place_and_a_unit_quaternion():
    fields = [float(word) for word in tum([(0.1, 1.5, -2.25, math.pi / 2)]).split()]
    assert fields == pytest.approx([0.1, 1.5, -2.25, 0, 0, 0, math.sqrt(0.5), math.sqrt(0.5)])


def test_a_map_by_hand_is_read_in_metres():
    # A closed triangle and an open chain of two vectors; one region, two nodes, two edges.
    records = Records(6, 2, 1, 2, 1)
    for i, record in enumerate([(0, 0, 2, 0), (200, 0, 3, 1), (0, 200, 4, 0), (-20, 40, 5, 0), (-20, 60, 6, 0x30), (0, 60, 0, 8)]):
        records.xs[i], records.ys[i], records.sigmas[i], records.flags[i] = record
    records.firsts, records.counts[:], records.kinds[:] = [0, 3], (3, 3), (0, 1 | 4 | 5 << 3)
    records.regions[:] = array("H", [0, 3, 50, 2 | 1 << 8, 0, 0])
    records.shared[:4] = array("H", [20, 40, 60, 40])
    records.shared[ABOUT:ABOUT + 2] = array("H", [1 << 8, 1])
    records.shared[EDGES] = 1 | 4 << 8
    data = encode_records(records)
    assert len(data) < 6 * 6 + 2 * 4 + 12 + 12 + 2  # shorter than the records
    the_map = decode_map(data)
    assert (the_map.regions, the_map.nodes, the_map.edges) == (1, 2, 1)
    region, = the_map.region_list
    assert (region.area_m2, region.long, region.short, region.gate) == (0.5, 2, 1, None) and region.polygon.area == pytest.approx(0.5)
    assert np.array(the_map.node_list) == pytest.approx(np.array([(0.1, 0.2), (0.3, 0.2)]))
    assert [(e.nodes, e.region, e.cost_cm) for e in the_map.edge_list] == [((0, 1), 4, 21)]
    triangle, open_chain = the_map.chains
    assert triangle.closed and triangle.kind == KIND_OUTLINE and not triangle.searched
    assert triangle.vectors() == pytest.approx(np.array([(0, 0, 1, 0), (1, 0, 0, 1), (0, 1, 0, 0)]))
    assert not open_chain.closed and open_chain.kind == KIND_BARRIER and open_chain.searched and open_chain.region == 5
    assert open_chain.vectors() == pytest.approx(np.array([(-0.1, 0.2, -0.1, 0.3), (-0.1, 0.3, 0, 0.3)]))
    assert len(the_map.vectors()) == 5 and len(the_map.vectors(KIND_BARRIER)) == 2


@pytest.mark.parametrize("count", [3, 255, 256, 510, 511, 600])
@pytest.mark.parametrize("closed", [True, False])
def test_a_chain_of_any_length_survives_the_way_through_the_file(count, closed):
    t = np.linspace(0, 2 * np.pi, count, endpoint=False)
    ring = np.column_stack([np.cos(t), np.sin(t)]) * 100
    the_map = decode_map(encode_map([chain(ring, closed=closed), chain(rectangle(0, 0, 1, 1), KIND_BARRIER)]))
    assert [c.closed for c in the_map.chains] == [closed, True]
    assert len(the_map.vectors(KIND_OUTLINE)) == (count if closed else count - 1)
    assert the_map.chains[0].xy == pytest.approx(ring, abs=0.0026)


def test_two_chains_of_255_vectors_stay_two_if_the_first_is_open():
    t = np.linspace(0, 2, 255)
    line = np.column_stack([t, t])
    the_map = decode_map(encode_map([chain(line, closed=False), chain(line + 1, closed=False)]))
    assert len(the_map.chains) == 2 and len(the_map.vectors()) == 2 * 254


def test_a_damaged_map_is_refused_whatever_byte_is_hit():
    data = encode_map([chain(rectangle(0, 0, 1, 1))])
    for at in range(len(data)):
        broken = bytearray(data)
        broken[at] ^= 0x10
        with pytest.raises(MapError) as refused:
            decode_map(bytes(broken))
        assert "\n" not in str(refused.value) and ("checksum" in str(refused.value) or at < 4)
    for size in range(len(data)):
        with pytest.raises(MapError):
            decode_map(data[:size])


@pytest.mark.parametrize("at, value", [(4, 3), (4, 5), (6, 0), (4, 255)])
def test_counts_that_are_not_those_of_the_bytes_are_refused(at, value):
    data = bytearray(encode_map([chain(rectangle(0, 0, 1, 1))])[:-4])
    data[at] = value  # of vertices, chains
    with pytest.raises(MapError):
        decode_map(bytes(data) + struct.pack("<I", zlib.crc32(data)))
