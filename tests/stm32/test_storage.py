# The emulated part stores and loads what every other target does, byte for byte.

import shutil

import pytest

from tests.host_tools.test_hil_storage import mission, stored  # noqa: F401


@pytest.mark.timeout(300)
def test_it_goes_on_from_the_file_as_the_computer_does(project, tmp_path, stm32_elf, stored):  # noqa: F811
    ends = {}
    for target, link in (("cpython", "memory"), ("stm32", "semihost")):
        nvm = shutil.copy(stored[0], tmp_path / target)
        result, _ = mission(project, tmp_path, nvm, "--target", target, "--link", link)
        assert [one["loaded"] for one in result["storage"]["found"]] == ["outline"] and result["storage"]["kept"] == "explored"
        assert target == "cpython" or result["memory"]["allocated_after_boot_bytes"] == 0
        ends[target] = (result["hash"], (tmp_path / target).read_bytes())
    assert ends["stm32"] == ends["cpython"]
