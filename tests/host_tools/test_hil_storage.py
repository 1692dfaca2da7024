"""`hil --nvm FILE`: what one mission's core stored, the next one's goes on from, on whatever target."""

import json
import shutil

import pytest

from tests.host_tools.test_hil_mission import finish, hil

CELL = "tests/sim_device/cell.json"


def mission(project, folder, nvm, *argv):
    """(the result file, what was said)"""
    code, out, err = finish(hil(project, CELL, "--nvm", str(nvm), "--json", str(folder / "r.json"), *argv))
    assert code == 0, out + err
    return json.loads((folder / "r.json").read_text()), out + err


@pytest.fixture(scope="module")
def stored(project, tmp_path_factory):
    """A memory with the outline only, as the power was lost when the explored home was being stored; and the mission's result."""
    folder = tmp_path_factory.mktemp("stored")
    result, _ = mission(project, folder, folder / "nvm", "--target", "cpython", "--link", "memory")
    whole = (folder / "nvm").read_bytes()
    (folder / "outline").write_bytes(whole[:8192] + b"\xff" * 8192)
    return folder / "outline", folder / "nvm", result


def test_a_new_process_goes_on_from_the_file(project, tmp_path, stored):
    # The search inside from the outline on, then from the explored home: the same on the Unix port as on CPython, to the last stored byte.
    results = {}
    for target, *link in (("cpython", "--link", "memory"), ("unix",)):
        nvm = shutil.copy(stored[0], tmp_path / target)
        first, said = mission(project, tmp_path, nvm, "--target", target, *link)
        assert [one["loaded"] for one in first["storage"]["found"]] == ["outline"] and "goes on searching inside" in said
        assert first["storage"]["kept"] == "explored" and first["time"]["robot_s"] < stored[2]["time"]["robot_s"] / 2
        last, said = mission(project, tmp_path, nvm, "--target", target, *link)
        assert last["storage"]["found"][0]["loaded"] == "explored" and "only the map is built" in said
        assert last["hash"]["map"] == first["hash"]["map"] and last["time"]["robot_s"] < 1 and last["storage"]["programs"] == 0
        results[target] = (first["hash"], last["hash"], (tmp_path / target).read_bytes())
    assert results["cpython"] == results["unix"]


def test_a_damaged_record_is_passed_over_and_said(project, tmp_path, stored):
    data = bytearray(stored[1].read_bytes())
    data[8192 + 70] ^= 1
    (tmp_path / "nvm").write_bytes(data)
    result, said = mission(project, tmp_path, tmp_path / "nvm", "--target", "cpython", "--link", "memory")
    assert result["storage"]["found"] == [{"loaded": "outline", "damaged": True, "foreign": False}]
    assert "it is not whole" in said


@pytest.mark.parametrize("make, words", [
    (lambda path: path.mkdir(), "is a folder"), (lambda path: path.write_bytes(b"x" * 99), "holds 99 bytes"),
    (lambda path: path.symlink_to("/dev/full"), "--nvm"),
])
def test_what_is_no_memory_is_said_in_one_sentence(project, tmp_path, make, words):
    make(tmp_path / "nvm")
    code, out, err = finish(hil(project, CELL, "--target", "cpython", "--link", "memory", "--nvm", str(tmp_path / "nvm")))
    assert code == 2 and len(err.splitlines()) == 1 and words in err, out + err


def test_no_memory_at_all(project, tmp_path):
    result, said = mission(project, tmp_path, "none", "--target", "cpython", "--link", "memory")
    assert result["storage"]["nvm_bytes"] is None and "storage" not in said
