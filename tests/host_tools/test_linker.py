"""The linker: one module that does what the files did, and a sentence for what it cannot link."""

import ast

import pytest

from host_tools.linker import LinkError, link

CORE = {
    "core/__init__.py": "",
    "core/limits.py": "ROOM = 4\nassert ROOM > 2\nDEEP = 1 << 20\n",
    "core/tables.py": "WORDS = (b'one', b'two')\n",
    "core/ring.py": """
from array import array
from .limits import ROOM as SIZE

_STEP = const(3)


def _next(i):
    return (i + _STEP) % SIZE


class Ring:
    CAPACITY = SIZE

    def __init__(self):
        self.at = 0
        self.cells = array('i', bytes(4 * SIZE))

    def put(self, value):
        self.cells[self.at] = value
        self.at = _next(self.at)

    def unused(self):
        return never_called()


def never_called():
    return 7
""",
    "core/fast.py": """
from . import slow


def speed_up():
    slow.work = work


def work(x):
    return x * 2
""",
    "core/slow.py": """
WORK = 5


def work(x):
    return x + x


def _next(i):
    return i + 100


def far(i):
    return _next(i) + WORK
""",
    "core/main.py": """
import sys
from . import slow
from .fast import speed_up
from .limits import DEEP
from .ring import Ring
from .tables import WORDS

if sys.implementation.name == 'micropython':
    KIND = 1
else:
    KIND = 2
_count = 0


def main():
    global _count
    _count += 1
    speed_up()
    ring = Ring()
    for WORK in range(6):
        ring.put(WORK)
    return list(ring.cells), ring.CAPACITY, slow.work(4), slow.far(DEEP), WORDS[1], KIND, _count
""",
}


def run(linked):
    names = {"const": int}
    exec(compile(linked.source, "linked", "exec"), names)
    return names


def test_the_linked_module_does_what_the_files_do():
    names = run(link(CORE, "core/main.py"))
    assert names["main"]() == ([4, 3, 2, 5], 4, 8, (1 << 20) + 105, b"two", 1, 1)
    assert names["main"]()[-1] == 2


def test_constants_are_numbers_and_what_nobody_reaches_is_gone():
    linked = link(CORE, "core/main.py")
    tree = ast.parse(linked.source)
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)} | set(linked.owners)
    assert not names & {"ROOM", "SIZE", "_STEP", "DEEP", "KIND", "const", "never_called", "sys"}
    methods = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    assert "unused" not in methods and "put" in methods


def test_a_name_that_two_files_use_keeps_its_two_meanings():
    linked = link(CORE, "core/main.py")
    assert linked.owners["_next"] != linked.owners["slow__next" if "slow__next" in linked.owners else "ring__next"]
    assert {path for path in linked.owners.values()} == {"core/ring.py", "core/slow.py", "core/fast.py", "core/tables.py", "core/main.py"}
    assert linked.modules[-1] == "core/main.py" and linked.modules.index("core/limits.py") < linked.modules.index("core/ring.py")


def test_a_class_has_its_methods_and_nothing_that_python_wrote_into_it():
    ring = run(link(CORE, "core/main.py"))["Ring"]
    assert ring.CAPACITY == 4 and callable(ring.put)


def test_marks_tell_what_ran():
    seen = []
    linked = link(CORE, "core/main.py", mark="_seen")
    exec(compile(linked.source, "linked", "exec"), {"const": int, "_seen": seen.append})
    assert seen == linked.modules


@pytest.mark.parametrize("source, said", [
    ("from .limits import NOTHING\ndef main():\n    pass\n", "core/limits.py has no NOTHING"),
    ("def main():\n    def inner():\n        pass\n", "a function in a function"),
    ("from . import slow\ndef main():\n    return slow\n", "the module slow is used as a value"),
    ("from . import slow\ndef main():\n    return slow.nothing\n", "has no nothing"),
    ("SPEED = 3\nSPEED = [1]\ndef main():\n    return SPEED\n", "a number first and something else later"),
    ("from . import slow\ndef main():\n    slow.WORK = 2\n", "WORK of core/slow.py is no name that can be given another value"),
    ("if 1 < 2:\n    A = 1\ndef main():\n    pass\n", "only sys.implementation.name is asked there"),
    ("class A:\n    if True:\n        pass\ndef main():\n    return A\n", "holds what cannot be linked"),
])
def test_what_cannot_be_linked_is_named(source, said):
    with pytest.raises(LinkError, match=said):
        link(dict(CORE, **{"core/main.py": source}), "core/main.py")
