"""Methods put in the place of their one call do what the call did, whatever way they return."""

import ast
import itertools

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
