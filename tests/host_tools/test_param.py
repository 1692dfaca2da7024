"""`host_tools param` against a core on a port: what it prints, and a sentence for each refusal."""

import os

import pytest

from host_tools import cli
from tests.host_tools.core_driver import CoreDriver


@pytest.fixture
def param(capsys):
    def run(*words, kind="good"):
        with CoreDriver(kind) as core:
            code = cli.main(["param", "--target", "port:" + core.path, *words])
            out = capsys.readouterr()
            return code, out.out, out.err, core
    return run


def test_list_is_a_table_of_what_the_core_has(param):
    code, out, _, _ = param("list")
    assert code == 0
    lines = [line.split() for line in out.splitlines()]
    assert lines[0] == ["parameter", "unit", "range", "default", "value"]
    assert lines[1] == "speed_max mm/s 50 to 1000 300 300".split()
    assert lines[2] == "ir_bearing[8] BAM -32768 to 32767 0 0, all 8".split()


def test_set_reaches_the_core_and_get_reads_it(param):
    code, out, _, core = param("set", "speed_max", "250")
    assert (code, out) == (0, "speed_max = 250 mm/s (was 300)\n")
    assert core.values[0] == [250]
    code, out, _, core = param("set", "ir_bearing.3", "-7282")
    assert code == 0 and core.values[1][3] == -7282
    code, out, _, _ = param("get", "ir_bearing.3")
    assert (code, out) == (0, "ir_bearing.3 = 0 BAM\n")
    code, out, _, _ = param("get", "ir_bearing")
    assert out.count("\n") == 8


@pytest.mark.parametrize("words, sentence", [
    (("get", "sped_max"), "no parameter 'sped_max': did you mean speed_max?; `host_tools param list` shows all 2"),
    (("set", "zzz", "1"), "no parameter 'zzz'; `host_tools param list` shows all 2"),
    (("set", "speed_max", "5000"), "speed_max takes 50 to 1000 mm/s: 5000 was refused and 300 stays"),
    (("set", "speed_max", "99999999999"), "speed_max takes 50 to 1000 mm/s: 99999999999 was refused and 300 stays"),
    (("set", "ir_bearing", "1"), "ir_bearing holds 8 values: name one, ir_bearing.0 to ir_bearing.7"),
    (("get", "ir_bearing.8"), "ir_bearing has no value number 8: it holds numbers 0 to 7"),
    (("get", "speed_max.1"), "speed_max has no value number 1: it holds one, number 0"),
    (("get", "ir_bearing.x"), "'ir_bearing.x' does not name a value"),
    ((), "say what to do: list, get"),
])
def test_a_wrong_request_is_one_sentence(param, words, sentence):
    code, out, err, core = param(*words)
    assert code == 2 and sentence in err and err.count("\n") == 1
    assert core.values == [[300], [0] * 8]


def test_a_locked_core_says_so(param):
    code, _, err, core = param("set", "speed_max", "250", kind="locked")
    assert code == 2 and "the mission has begun" in err and core.values[0] == [300]


@pytest.mark.parametrize("kind, sentence", [
    ("old", "the core's message schema is abcd1234"),
    ("gone", "was closed by its other end while in use"),
])
def test_a_core_that_cannot_be_worked_with(param, kind, sentence):
    code, _, err, _ = param("list", kind=kind)
    assert code == 3 and sentence in err and err.count("\n") == 1


@pytest.mark.parametrize("kind, came", [("silent", "nothing came"), ("garbage", "0 good frames")])
def test_waiting_in_vain_names_what_was_waited_for(param, monkeypatch, kind, came):
    monkeypatch.setattr("host_tools.core_session.BOOT_S", 0.5)
    code, _, err, _ = param("list", kind=kind)
    assert code == 3 and "in vain" in err and "for HELLO" in err and came in err


def test_a_value_that_is_no_number(param, capsys):
    with pytest.raises(SystemExit) as left:
        param("set", "speed_max", "fast")
    assert left.value.code == 2 and "'fast' is not a whole number" in capsys.readouterr().err


@pytest.mark.parametrize("path, sentence", [("/no/such/port", "no such file"), (os.devnull, "is not a terminal")])
def test_a_port_that_is_none(capsys, path, sentence):
    assert cli.main(["param", "--target", "port:" + path, "list"]) == 2
    assert sentence in capsys.readouterr().err


def test_the_target_may_stand_behind_the_words(param, capsys):
    code, said, _, _ = param("get", "speed_max")
    assert code == 0
    assert cli.main(["param", "get", "speed_max", "--target", "cpython", "--heap", "1m"]) == 0
    assert capsys.readouterr().out == said


def test_what_no_action_takes_is_refused_in_its_name(capsys):
    with pytest.raises(SystemExit) as left:
        cli.main(["param", "list", "--nope"])
    said = capsys.readouterr().err
    assert left.value.code == 2 and said.startswith("host_tools param: ") and "--nope" in said and said.count("\n") == 1


def test_a_target_that_is_none(capsys):
    assert cli.main(["param", "--target", "moon", "list"]) == 2
    assert "'moon' is no target: give cpython, unix, stm32 or port:DEVICE" in capsys.readouterr().err


@pytest.mark.parametrize("target", ["unix", "cpython"])
def test_the_real_core_has_the_parameters_of_the_table(target, micropython, capsys):
    from protocol.parameters import PARAMETERS
    assert cli.main(["param", "--target", target, "list"]) == 0
    lines = capsys.readouterr().out.splitlines()[1:]
    assert [line.split()[0].split("[")[0] for line in lines] == [row[0] for row in PARAMETERS]
    assert cli.main(["param", "--target", target, "set", "speed_max", "250"]) == 0
    assert "speed_max = 250 mm/s (was 300)" in capsys.readouterr().out
    assert cli.main(["param", "--target", target, "set", "speed_max", "5000"]) == 2
    assert "takes 50 to 1000 mm/s: 5000 was refused and 300 stays" in capsys.readouterr().err
