"""The module in flash: tables in which the VM finds each name, and a sentence for what flash cannot hold.

That the image runs it with the hashes of the files is in tests/stm32; here, what it is made of."""

import ast
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from host_tools.linker import LinkError, link, rom
from tests.host_tools.test_linker import CORE

SOURCE = """
import gc
from array import array
LIMIT = 3
WORDS = (b'one', 'two', (None, True, -5))
COUNT = len(WORDS)
class Ring:
    SIZE = 4

    def __init__(self, size, first=7):
        self.cells = array('i', size)
        self.at = first

    def put(self, value):
        self.cells[self.at] = value
@micropython.viper
def fast(x: int) -> int:
    return x
def main():
    return Ring(LIMIT)
"""
# What MicroPython's mpy-tool writes, cut down to what is read of it; viper functions have no name of their own there.
CODE = """static const mp_raw_code_truncated_t proto_fun_tvslam_%s = {
    .kind = %s,
    .fun_data = fun_data_tvslam_%s,
    .children = (void *)children_or_prelude,
};
"""
LISTS = """static const mp_raw_code_t *const children_tvslam%s[] = {
%s};
"""
TABLES = """static const mp_frozen_module_t frozen_module_tvslam = {
    .constants = {
        .qstr_table = (qstr_short_t *)&const_qstr_table_data_tvslam,
        .obj_table = (mp_obj_t *)&const_obj_table_data_tvslam,
    },
};
"""


def frozen(children=("Ring", "tvslam_dot_py", "main"), kind="MP_CODE_NATIVE_PY"):
    codes = "".join(CODE % (name, kind, name) for name in ("_lt_module_gt_", "Ring", "Ring___init__", "Ring_put", "main"))
    codes += CODE % ("tvslam_dot_py", "MP_CODE_NATIVE_VIPER", "tvslam_dot_py")
    lists = [("__lt_module_gt_", children), ("_Ring", ("Ring___init__", "Ring_put"))]
    return codes + "".join(LISTS % (of, "".join("    (const mp_raw_code_t *)&proto_fun_tvslam_%s,\n" % name for name in names))
                           for of, names in lists) + TABLES


def module(source=SOURCE, **changed):
    return rom.c_source(source, frozen(**changed))


def table(text, name):
    """[(name, value) or None] of a table in the C."""
    body = re.search(r"static const mp_rom_map_elem_t %s_table\[\] = \{\n(.*?)\n\};" % name, text, re.S)[1]
    return [(m[1], m[2]) if (m := re.match(r"    \{MP_ROM_QSTR\(MP_QSTR_(\w+)\), (.*)\},$", line)) else None for line in body.splitlines()]


def looked_up(places, name):
    """As py/map.c looks for a name."""
    at = rom.qstr_hash(name) % len(places)
    for _ in places:
        if places[at] is None:
            return None
        if places[at][0] == name:
            return places[at][1]
        at = (at + 1) % len(places)
    return None


def test_every_name_is_found_and_no_other():
    text = module()
    names = table(text, "rom_globals")
    for name in ("gc", "array", "LIMIT", "WORDS", "COUNT", "Ring", "fast", "main", "__name__"):
        assert looked_up(names, name), name
    assert looked_up(names, "LIMIT") == looked_up(names, "COUNT") == "MP_ROM_INT(3)" and looked_up(names, "len") is None
    ring = table(text, "rom_names_tvslam_Ring")
    assert looked_up(ring, "SIZE") == "MP_ROM_INT(4)" and looked_up(ring, "put") == "MP_ROM_PTR(&rom_tvslam_Ring_put)"


@given(st.sets(st.from_regex(r"[a-z_]{1,8}", fullmatch=True), max_size=400), st.from_regex(r"[a-z_]{1,8}", fullmatch=True))
def test_a_table_of_any_names_finds_each(names, other):
    made = rom.Rom(None)
    made.table("rom_any", {name: "MP_ROM_INT(%d)" % i for i, name in enumerate(sorted(names))})
    places = table("\n".join(made.lines), "rom_any")
    assert None in places, "what is not in it must come to an end"
    for i, name in enumerate(sorted(names)):
        assert looked_up(places, name) == "MP_ROM_INT(%d)" % i
    assert (looked_up(places, other) is not None) == (other in names)


def test_functions_are_what_def_would_have_made():
    text = module()
    code = "rom_tvslam_%s = {{{&mp_type_fun_%s}, &tvslam_module, (void *)children_or_prelude, fun_data_tvslam_%s}, {%s}};"
    assert "ROM_FUNCTION(1) " + code % ("Ring___init__", "native", "Ring___init__", "MP_ROM_INT(7)") in text
    assert "ROM_FUNCTION(0) " + code % ("fast", "viper", "tvslam_dot_py", "") in text
    assert "ROM_CLASS(Ring, 2)" in text, "room for `cells` and `at`"


def test_hashes_are_the_vms():
    # QDEF0(MP_QSTR_append, 38763, ...) and QDEF0(MP_QSTR___init__, 42335, ...) of MicroPython's own build.
    assert (rom.qstr_hash("append"), rom.qstr_hash("__init__")) == (38763, 42335)


@pytest.mark.parametrize("source, said", [
    (SOURCE + "gc.collect()\n", "`gc.collect\\(\\)` would run at import"),
    (SOURCE + "BUFFER = bytearray(4)\n", "cannot stand in flash"),
    (SOURCE + "CELLS = [1, 2]\n", "only numbers, bytes, text and tuples"),
    (SOURCE + "from .limits import LIMIT\n", "can only import gc, micropython, sys, array"),
    (SOURCE.replace("class Ring:", "class Ring(Exception):"), "class Ring: in flash a class has no bases"),
    (SOURCE.replace("def put", "def __len__"), "class Ring: in flash a class has no __len__"),
    (SOURCE + "WIDE = 1 << 30\n", "1073741824 cannot stand in flash"),
    (SOURCE + "WIDE = (1, (-(1 << 30),))\n", "-1073741824 cannot stand in flash"),
    (SOURCE.replace("first=7", "first=1 << 31"), "2147483648 cannot stand in flash"),
    (SOURCE.replace("SIZE = 4", "at = 1 << 30"), "1073741824 cannot stand in flash"),
    (SOURCE.replace("SIZE = 4", "at = 4"), "class Ring: in flash a class's own at hides"),
    (SOURCE.replace("self.cells[self.at] = value", "self.put = value"), "class Ring: in flash a class's own put hides"),
    (SOURCE.replace("    return Ring", "    global LIMIT\n    return Ring"), "`global LIMIT`"),
])
def test_what_flash_cannot_hold_is_named(source, said):
    with pytest.raises(LinkError, match=said):
        module(source)


@given(st.integers(-(1 << 32), 1 << 32) | st.integers((1 << 30) - 2, (1 << 30) + 2))
def test_an_int_is_what_the_part_makes_of_it_or_refused(number):
    try:
        said = rom.Rom(None).value(number)
    except LinkError:
        assert abs(number) >= 1 << 30
        return
    on_the_part = ((2 * number + 1) & 0xFFFFFFFF ^ 1 << 31) - (1 << 31) >> 1  # MP_ROM_INT in 32 bits, and back
    assert said == "MP_ROM_INT(%d)" % number and on_the_part == number


def test_a_build_that_froze_something_else_is_named():
    with pytest.raises(LinkError, match="has 3 functions and classes, but the build froze 2"):
        module(children=("Ring", "main"))
    with pytest.raises(LinkError, match="no machine code but MP_CODE_BYTECODE"):
        module(kind="MP_CODE_BYTECODE")
    with pytest.raises(LinkError, match="has no module tvslam"):
        rom.c_source(SOURCE, "")


def test_a_call_at_the_top_that_only_gives_names_is_settled():
    main = CORE["core/main.py"].replace("    speed_up()\n", "").replace("_count = 0", "_count = 0\nspeed_up()")
    files = dict(CORE, **{"core/main.py": main})
    linked = link(files, "core/main.py")
    defined = {node.name for node in ast.parse(linked.source).body if isinstance(node, ast.FunctionDef)}
    assert len(defined & {"work", "fast_work", "slow_work"}) == 1 and "speed_up" not in defined
    names = {"const": int}
    exec(compile(linked.source, "linked", "exec"), names)
    assert names["main"]()[2] == 8
