# `host_tools budget --target stm32`: where the heap of the emulated part goes, to the byte, and the least that will do.

import json

import pytest

from host_tools import budget, cli, heap_ledger, heap_search
from host_tools.heap_ledger import Ledger
from host_tools.heap_search import STEP_BYTES, DoesNotFit, smallest_that_boots
from tests.docs.pages import rows
from tests.host_tools.test_hil_mission import SMALL, finish, hil
from tests.stm32.test_mission import HEAP, MISSION

# The VM holds the script that runs, and the one that reads the bare VM is not the one that starts the core; and the collector takes
# what a word of the stack happens to point at for alive.
SCRIPT_BYTES = 320
READINGS = """@ 1000 begin
@ 1040 imported
@ 2010 + Device
@ 2050 + Link
@ 2150 - Link
@ 2150 + Link
@ 2250 - Link
@ 2500 - Device
tvslam: up
"""


# --- what the readings say ---

def test_each_difference_is_somebodys():
    ledger = heap_ledger.read("@ 600 vm\n", READINGS, 2530)
    assert ledger == Ledger(vm=600, apparatus=400, imports=40, objects={"Link": 200, "Device": 290}, others=970 + 30)
    assert ledger.sum == 2530


@pytest.mark.parametrize("lost", ["begin", "imported", "- Device"])
def test_a_reading_that_is_missing_is_not_made_up(lost):
    text = "\n".join(line for line in READINGS.splitlines() if not line.endswith(lost))
    assert heap_ledger.read("@ 600 vm\n", text, 2530) is None


# --- on the part ---

@pytest.fixture(scope="module")
def told(stm32_tools_here, tmp_path_factory):
    kept = tmp_path_factory.mktemp("budget") / "b.json"
    assert cli.main(["budget", "--target", "stm32", "--heap", HEAP, "--json", str(kept)]) == 0
    return json.loads(kept.read_text())


def test_the_bytes_listed_add_up_to_what_the_core_says_of_its_heap(told):
    ledger = told["ledger"]
    listed = ledger["vm"] + ledger["apparatus"] + ledger["others"] + ledger["imports"] + sum(ledger["objects"].values())
    assert listed == ledger["sum"]
    # The core by itself, not measured, with an image of its own.
    assert listed - ledger["apparatus"] == pytest.approx(told["heap_used_bytes"], abs=SCRIPT_BYTES)
    assert abs(ledger["others"]) < 600, "what no object holds must stay small"
    assert ledger["imports"] < 64, "names, functions and classes lie in flash"


@MISSION
def test_a_core_for_a_tool_holds_just_what_a_missions_does(told, project, tmp_path):
    home, kept = tmp_path / "small.json", tmp_path / "r.json"
    home.write_text(json.dumps(SMALL))
    _, _, said = finish(hil(project, str(home), "--target", "stm32", "--link", "semihost", "--heap", HEAP, "--max-robot-s", "1",
                            "--json", str(kept)))   # however it ends: it tells its heap at its beginning
    assert json.loads(kept.read_text())["memory"]["heap_peak_bytes"] == told["heap_used_bytes"], said


def test_every_store_is_within_an_object(told):
    assert sum(store["bytes"] for store in told["stores"]) < sum(told["ledger"]["objects"].values())
    stores = {store["name"]: store["bytes"] for store in told["stores"]}
    for name, of in (("VectorStore", ("vectors", "chains")), ("HitRing", ("hits",)), ("Breadcrumbs", ("breadcrumbs",))):
        data = sum(stores[part] for part in of)
        assert data < told["ledger"]["objects"][name] < data + 500, name


def test_flash_and_ram_stand_beside_it(told):
    modules = told["flash"]["modules"]
    assert 0 < sum(modules.values()) < told["flash"]["text_bytes"] <= told["flash"]["flash_bytes"]
    assert told["memory"]["static_ram_bytes"] > 500 and 500 < told["memory"]["stack_peak_bytes"] < 10 << 10
    text = "\n".join(heap_ledger.report(told) + budget.heap_lines(told))
    assert "{:,}".format(told["ledger"]["sum"]) in text and "objects of VectorStore" in text and "Of it code" not in text


def test_the_page_has_the_figures(told):
    ledger, page_rows = told["ledger"], {name: int(size) for name, size in rows("docs/memory.md", "part of the heap")}
    for size, name in ((ledger["vm"], "the VM"), (sum(ledger["objects"].values()), "objects"), (ledger["others"], "buffer")):
        written = next(size for row, size in page_rows.items() if row.startswith(name))
        assert written == pytest.approx(size, rel=0.06, abs=100), "docs/memory.md, On the stm32: %s take %d bytes" % (name, size)


# --- the search ---

@pytest.mark.parametrize("least", [STEP_BYTES * 40, 20000, heap_search.BEGIN_BYTES, heap_search.BEGIN_BYTES + 1, 100_000])
def test_the_bisection_ends_at_the_smallest(least):
    tried, said = [], []

    def boots(heap):
        tried.append(heap)
        return least - 700 if heap >= least else None

    found = smallest_that_boots(said.append, boots)
    assert found % STEP_BYTES == 0 and found - STEP_BYTES < least <= found
    assert len(tried) == len(set(tried)) == len(said) < 14


def test_a_core_that_boots_in_no_heap_is_told():
    with pytest.raises(DoesNotFit, match="does not boot in 112 KiB"):
        smallest_that_boots(lambda text: None, lambda heap: None)


@pytest.mark.parametrize("words", [("--target", "unix", "--search", "flat"), ("--target", "stm32", "--heap", "27k", "--search", "flat"),
                                   ("--target", "stm32", "--search", "no_such_home")])
def test_what_cannot_be_searched_is_one_sentence(words, capsys):
    assert cli.main(["budget", *words]) == 2
    said = capsys.readouterr()
    assert said.err.startswith("budget: ") and said.err.count("\n") == 1 and not said.out, said.err


@pytest.mark.soak
@MISSION
def test_the_heap_that_is_found_maps_the_home(stm32_tools_here, tmp_path, capsys):
    home, kept = tmp_path / "small.json", tmp_path / "b.json"
    home.write_text(json.dumps(SMALL))
    assert cli.main(["budget", "--target", "stm32", "--search", str(home), "--json", str(kept)]) == 0
    found = json.loads(kept.read_text())
    assert found["heap_bytes"] % STEP_BYTES == 0 and "outline closed" in found["missions"][SMALL["name"]]
    assert "does not boot" in capsys.readouterr().out
