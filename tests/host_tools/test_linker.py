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


def run(linked, **names):
    names["const"] = int
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


def test_a_mark_stands_in_each_constructors_place():
    seen = []

    def made(name, cls, *args):
        seen.append(name)
        return cls(*args)

    names = run(link(CORE, "core/main.py", mark="_made"), _made=made)
    assert names["main"]() == run(link(CORE, "core/main.py"))["main"]() and seen == ["Ring"]


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


def with_main(source, **others):
    return dict(CORE, **{"core/main.py": source}, **{"core/%s.py" % name: text for name, text in others.items()})


@pytest.mark.parametrize("source, said", [
    # A variable that would capture the global meant beside it.
    ("from . import slow\ndef main():\n    work = slow.work(4)\n    return work\n", "core/main.py:3 work is here .* variable another name"),
    ("from .slow import work as job\ndef main(work):\n    return job(work)\n", "core/main.py:3 work is here"),
    ("from .limits import ROOM\ndef main():\n    return [ROOM for ROOM in range(3)], ROOM\n", "core/main.py:3 ROOM is here"),
    ("N = 5\nclass A:\n    N = 2\n    M = N + 1\ndef main():\n    return A.M\n", "core/main.py:4 N is a name of the class"),
    ("class A:\n    def f(self):\n        pass\n    G = f\ndef main():\n    return A\n", "core/main.py:4 f is a name of the class"),
    # What has names of its own in a function, and what reaches names by their spelling.
    ("def main():\n    return lambda x: x\n", "core/main.py:2 a lambda"),
    ("def main():\n    class A:\n        pass\n", "core/main.py:2 a class in a function"),
    ("async def main():\n    pass\n", "core/main.py:1 an async function"),
    ("for i in range(2):\n    def main():\n        pass\n", "core/main.py:2 a function in a function or block"),
    ("def main(a):\n    return getattr(a, 'b')\n", "core/main.py:2 getattr reaches names"),
    ("def main(a):\n    setattr(a, 'b', 1)\n", "core/main.py:2 setattr reaches names"),
    ("def main():\n    return globals()\n", "core/main.py:2 globals reaches names"),
    ("def main():\n    global fresh\n    fresh = 1\n", "core/main.py:2 global fresh"),
    # Imports.
    ("def main():\n    from .slow import work\n    return work(1)\n", "core/main.py:2 an import of core.slow inside"),
    ("def main():\n    import core.slow\n", "core/main.py:2 `import core.slow` names a file"),
    ("import core.slow\ndef main():\n    return core.slow.work(1)\n", "core/main.py:1 `import core.slow` names a file"),
    ("import core.slow as slow\ndef main():\n    pass\n", "`import core.slow as slow` names a file"),
    ("from .slow import *\ndef main():\n    pass\n", "core/main.py:1 `import \\*`"),
    ("from .lost import thing\ndef main():\n    pass\n", "core/main.py:1 core.lost is not among the files"),
    ("from os import open\ndef main():\n    pass\n", "open is a name of Python itself"),
    # What stands at the top.
    ("try:\n    A = [1]\nexcept ImportError:\n    A = [2]\nelse:\n    A = [3]\ndef main():\n    pass\n", "core/main.py:1 `try` at the top"),
    ("try:\n    A = [1]\nfinally:\n    B = [3]\ndef main():\n    pass\n", "core/main.py:1 `try` at the top"),
    ("import sys\nif sys.implementation.name > 'a':\n    A = 1\ndef main():\n    pass\n", "only sys.implementation.name"),
    ("N = 2\nA = [N]\nN = 3\ndef main():\n    return A, N\n", "core/main.py:3 N has another value before"),
])
def test_what_would_mean_something_else_is_refused(source, said):
    with pytest.raises(LinkError, match=said):
        link(with_main(source), "core/main.py")


@pytest.mark.parametrize("first, second", [
    ("import time\n", "def time():\n    return 1\n"),
    ("def time():\n    return 1\n", "import time\n"),
    ("import time\n", "from os import times as time\n"),
])
def test_a_name_from_outside_that_means_two_things_is_refused(first, second):
    files = with_main("from . import first, second\ndef main():\n    pass\n", first=first, second=second)
    with pytest.raises(LinkError, match="core/second.py: .*time.* another name"):
        link(files, "core/main.py")


def both(files):
    """What main() gives in the linked module; the files' own answer is the test's to know."""
    return run(link(files, "core/main.py"))["main"]()


def test_a_files_own_min_stays_its_own():
    main = "from .own import low\ndef main():\n    return low(3, 4), min(3, 4)\n"
    assert both(with_main(main, own="def min(a, b):\n    return -1\n\ndef low(a, b):\n    return min(a, b)\n")) == (-1, 3)


def test_a_name_from_outside_reaches_whoever_imports_it_from_a_file():
    main = "from .ring import array as kind\nfrom . import ring\ndef main():\n    return kind('i', [1])[0], ring.array('i', [2])[0]\n"
    assert both(with_main(main)) == (1, 2)


@pytest.mark.parametrize("test, kind", [("== 'micropython'", 1), ("!= 'micropython'", 2), ("== 'cpython'", 2), ("!= 'cpython'", 1)])
def test_the_branch_of_micropython_is_the_one_that_is_taken(test, kind):
    source = "import sys\nif sys.implementation.name %s:\n    KIND = 1\nelse:\n    KIND = 2\ndef main():\n    return KIND\n" % test
    assert both(with_main(source)) == kind


def test_a_default_means_what_stands_outside_of_its_function():
    main = "from .limits import ROOM\nfrom .slow import far\ndef main(ROOM=ROOM, *, far=far):\n    return ROOM, far(1)\n"
    assert both(with_main(main)) == (4, 106)


def test_statements_that_do_more_than_give_names_are_kept():
    main = """
TABLE = [0, 0, 0, 0]
LEFT = [9]
LEFT_OUT = [9]
for i in range(2):
    TABLE[i] = i + 1
n = [0]
while n[0] < 3:
    n[0] += 1
    last = TABLE.append(n[0])
nothing = TABLE.append(7)
unused, TABLE[3] = [1], 5
_spare = LEFT
_spare += [8]

def main():
    return TABLE, LEFT
"""
    files = with_main("from .fill import main as fill\ndef main():\n    return fill()\n", fill=main)
    linked = link(files, "core/main.py")
    assert run(linked)["main"]() == ([1, 2, 0, 5, 1, 2, 3, 7], [9, 8])
    assert "LEFT_OUT" not in linked.owners


def test_a_class_may_use_what_it_alone_names():
    assert both(with_main("class A:\n    N = 2\n    M = N + 1\ndef main():\n    return A.M\n")) == 3
