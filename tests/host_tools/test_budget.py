"""`host_tools budget`: the sums are the core's own figures, added up."""

import json

import pytest

from host_tools import budget, cli
from tests.host_tools.core_driver import CoreDriver


@pytest.fixture
def figures(tmp_path, capsys):
    with CoreDriver() as core:
        code = cli.main(["budget", "--target", "port:" + core.path, "--json", str(tmp_path / "b.json")])
    assert code == 0
    return json.loads((tmp_path / "b.json").read_text()), capsys.readouterr().out


def test_every_store_is_counted_byte_by_byte(figures):
    numbers, text = figures
    assert numbers["stores"] == [
        {"name": "vectors", "used": 5, "capacity": 768, "record_bytes": 6, "bytes": 4608},
        {"name": "hits", "used": 0, "capacity": 64, "record_bytes": 8, "bytes": 512}]
    assert numbers["stores_bytes"] == 5120
    rows = [line.split() for line in text.splitlines()]
    assert ["vectors", "768", "6", "4,608", "90.0", "%"] in rows
    assert ["all", "stores", "5,120"] in rows


def test_the_heap_is_split_into_code_and_data(figures):
    numbers, text = figures
    assert (numbers["heap_bytes"], numbers["heap_used_bytes"], numbers["heap_code_bytes"]) == (196608, 62000, 40000)
    assert numbers["heap_data_bytes"] == 22000 and numbers["heap_locked"] is True
    assert numbers["allocated_after_boot_bytes"] == 0
    assert "code 40,000 B, data 22,000 B: the stores above 5,120 B, objects and buffers around them 16,880 B" in text


def test_the_paper_stands_beside_it(figures):
    numbers, text = figures
    assert numbers["paper_bytes"] == 28200
    assert "28,200 B: all stores here are 18.2 % of that" in text


def test_what_a_target_does_not_measure_is_null_not_zero():
    numbers = {"target": "cpython", "stores": [], "stores_bytes": 0, "heap_bytes": None, "heap_used_bytes": None,
               "heap_code_bytes": None, "heap_data_bytes": None, "heap_locked": False, "allocated_after_boot_bytes": None}
    assert budget.heap_lines(numbers) == ["Heap: not measured on this target (cpython)."]


def test_a_file_that_cannot_be_written(tmp_path, capsys):
    (tmp_path / "no").write_text("")
    with CoreDriver() as core:
        code = cli.main(["budget", "--target", "port:" + core.path, "--json", str(tmp_path / "no" / "b.json")])
    said = capsys.readouterr()
    assert code == 2 and "no/b.json cannot be written (" in said.err and not said.out


@pytest.mark.parametrize("target", ["unix", "cpython"])
def test_the_real_core_says_what_it_costs(target, micropython, tmp_path, capsys):
    assert cli.main(["budget", "--target", target, "--json", str(tmp_path / "b.json")]) == 0
    numbers = json.loads((tmp_path / "b.json").read_text())
    stores = {store["name"]: store for store in numbers["stores"]}
    assert {"vectors", "chains", "points"} <= set(stores) and len(stores) == len(numbers["stores"])
    assert stores["vectors"]["bytes"] >= 458 * 6       # Paper Fig. 7 has 458 vectors
    assert 0 < numbers["stores_bytes"] < numbers["paper_bytes"]
    if target == "unix":
        assert numbers["heap_used_bytes"] < numbers["heap_bytes"] <= 192 * 1024
        assert numbers["heap_locked"] is True and numbers["allocated_after_boot_bytes"] == 0
    else:
        assert numbers["heap_bytes"] is None


def test_a_heap_too_small_to_boot_is_the_cores_own_sentence(micropython, capsys):
    assert cli.main(["budget", "--target", "unix", "--heap", "40k"]) == 3
    err = capsys.readouterr().err
    assert "the heap is too small to boot: give a larger --heap, as in --heap 192k" in err and err.count("\n") == 1


def test_a_heap_that_is_no_size(capsys):
    with pytest.raises(SystemExit) as left:
        cli.main(["budget", "--heap", "lots"])
    assert left.value.code == 2 and "lots is no size" in capsys.readouterr().err
