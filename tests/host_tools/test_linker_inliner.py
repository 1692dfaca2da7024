"""Methods put in the place of their one call do what the call did, whatever way they return."""

import ast
import itertools
from textwrap import indent

import pytest

from host_tools.linker import link

HEAD = """
class Thing:
    def __init__(self):
        self.log = []

    def go(self, a, b):
        x = 100
%s

%s

def main(a, b):
    thing = Thing()
    result = thing.go(a, b)
    return result, thing.log
"""
GUARDS = """
    def _part(self, x, b):
        self.log.append(x)
        if x > b:
            return
        y = x + 1
        if y == b:
            self.log.append(y)
            return
        elif y > 3:
            y = 9
        else:
            self.log.append(-y)
            return
        self.log.append(y)
"""
VALUES = """
    def _part(self, x, b):
        if x > b:
            return x
        elif x == b:
            x += 40
            return -x
        y = x * b
        if y > 2:
            self.log.append(y)
            return y
"""
LOOP = """
    def _part(self, x, b):
        for y in range(b):
            if y == x:
                return y
        return -1
"""
ENDLESS = """
    def _part(self, x, b):
        if x > b:
            while True:
                x -= 1
                if x == b:
                    break
            self.log.append(x)
        if x:
            if b:
                return x
            x = 3
        self.log.append(x)
"""
CALLS = {
    "alone": "        self._part(a, b)\n        self.log.append(x)\n        return x",
    "assigned": "        x = self._part(a + 1, b)\n        self.log.append(x)\n        return x",
    "returned": "        return self._part(a, b)",
    "in a loop": "        for i in range(3):\n            self._part(i, a)\n            self.log.append((i, x))",
    "at the end of a branch": "        if a:\n            x = self._part(b, a)\n        else:\n            x = 7\n        return x",
    "twice": "        self._part(a, b)\n        self._part(b, a)",
    "in a condition": "        if self._part(a, b):\n            return x",
}


@pytest.mark.parametrize("where", CALLS)
@pytest.mark.parametrize("part", [GUARDS, VALUES, LOOP, ENDLESS], ids=["guards", "values", "loop", "partly"])
def test_the_same_comes_out(where, part):
    source = HEAD % (CALLS[where], part)
    linked = link({"thing.py": source}, "thing.py").source
    plain, inlined = {}, {}
    exec(source, plain)
    exec(linked, inlined)
    for a, b in itertools.product(range(-1, 6), repeat=2):
        assert plain["main"](a, b) == inlined["main"](a, b), (a, b, linked)


@pytest.mark.parametrize("where, part, gone", [
    ("alone", GUARDS, True), ("assigned", VALUES, True), ("returned", LOOP, True), ("in a loop", GUARDS, True),
    ("alone", LOOP, False), ("assigned", LOOP, False), ("twice", GUARDS, False), ("in a condition", VALUES, False),
    ("alone", ENDLESS, False), ("returned", ENDLESS, True),
])
def test_only_what_is_called_once_and_stands_alone_is_moved(where, part, gone):
    linked = link({"thing.py": HEAD % (CALLS[where], part)}, "thing.py").source
    methods = {node.name for node in ast.walk(ast.parse(linked)) if isinstance(node, ast.FunctionDef)}
    assert ("_part" not in methods) == gone


# What must stay a method, or come out the same although it is none any more: what stands in `go`, the methods, whether _part is gone.
ODD = {
    "an answer with a call in it": ("self._part()\nreturn x", """
def _part(self):
    return self.add() + 1

def add(self):
    self.log.append(7)
    return 1
""", True),
    "nothing in it": ("self._part()\nreturn x", "def _part(self):\n    pass", True),
    "nothing left of it": ("if a:\n    self._part()\nreturn x", "def _part(self):\n    return", True),
    "a global that is a variable of the caller":
        ("LIMIT = a\nx = self._part(b)\nreturn x, LIMIT", "def _part(self, x):\n    return x + LIMIT[0]", False),
    "a builtin that is a variable of the caller":
        ("min = a\nx = self._part(b)\nreturn x, min", "def _part(self, x):\n    return min(x, 2)", False),
    "a variable of the caller by the new name":
        ("_part_y = a\nx = self._part(b)\nreturn x, _part_y", "def _part(self, x):\n    y = x\n    return y", False),
    "a named exception": ("x = self._part(a, b)\nreturn x", """
def _part(self, a, b):
    c = 0
    try:
        c = a // b
    except ZeroDivisionError as e:
        self.log.append(len(e.args))
    return c
""", False),
    "an exception without a name": ("x = self._part(a, b)\nreturn x", """
def _part(self, a, b):
    c = 0
    try:
        c = a // b
    except ZeroDivisionError:
        self.log.append(1)
    return c
""", True),
    "a global that is set":
        ("x = self._part(b)\nreturn x", "def _part(self, x):\n    global LIMIT\n    LIMIT = [x]\n    return LIMIT", False),
    "any number of arguments": ("x = self._part(a)\nreturn x", "def _part(self, x, *more):\n    return x, more", False),
    "any names": ("x = self._part(a)\nreturn x", "def _part(self, x, **more):\n    return x, more", False),
    "a name to be given": ("x = self._part(a)\nreturn x", "def _part(self, x, *, y=3):\n    return x, y", False),
    "arguments by position only": ("x = self._part(a)\nreturn x", "def _part(self, x, /):\n    return x", False),
    "a generator": ("x = self._part(a)\nreturn [*x]", "def _part(self, x):\n    yield x\n    yield LIMIT", False),
    "arguments from a list": ("c = [a]\nx = self._part(*c)\nreturn x", "def _part(self, x):\n    return x", False),
    "another name for self": ("x = self._part(a)\nreturn x", "def _part(me, x):\n    me.log.append(x)\n    return x", False),
    "an import": ("x = self._part(a)\nreturn x", "def _part(self, x):\n    import math\n    return math.floor(x)", False),
}


@pytest.mark.parametrize("case", ODD)
def test_odd_ones_stay_or_do_the_same(case):
    call, part, gone = ODD[case]
    source = "LIMIT = [3]\n" + HEAD % (indent(call, " " * 8), indent(part, " " * 4))
    linked = link({"thing.py": source}, "thing.py").source
    plain, inlined = {}, {}
    exec(source, plain)
    exec(linked, inlined)
    for a, b in itertools.product(range(-1, 4), repeat=2):
        assert plain["main"](a, b) == inlined["main"](a, b), (a, b, linked)
    assert ("def _part" not in linked) == gone


def test_a_method_that_a_subclass_has_as_well_stays():
    source = HEAD % ("        return self._part(a)", "    def _part(self, x):\n        return x\n")
    source += "\nclass Other(Thing):\n    def _part(self, x):\n        return -x\n\ndef other(a):\n    return Other().go(a, 0)\n"
    names = {}
    exec(link({"thing.py": source}, "thing.py").source, names)
    assert names["main"](3, 0) == (3, []) and names["other"](3) == -3
