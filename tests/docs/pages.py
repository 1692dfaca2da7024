# The documentation as its tests read it: pages, their tables, and the places in the code that they name.

import ast
import re
from functools import lru_cache

from tests.house.tree import PROJECT, parsed

PLACE = re.compile(r"`([\w./-]+\.py):([A-Za-z_]\w*(?:\.\w+)*)`")
TEST = re.compile(r"`(tests/[\w/]+\.py)::(\w+)`")
FILE = re.compile(r"`((?:protocol|firmware_py|sim_device|host_tools|tests|docs|benchmarks|examples)/[\w./-]*\.\w+)`")


@lru_cache(maxsize=None)
def page(name):
    return (PROJECT / name).read_text(encoding="utf-8")


def pages():
    return ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", *sorted(f"docs/{p.name}" for p in (PROJECT / "docs").glob("*.md"))]


def rows(name, first):
    """The cells of the table whose first heading is `first`, row by row, without marks of emphasis."""
    found = []
    lines = iter(page(name).splitlines())
    for line in lines:
        if line.startswith(f"| {first} |"):
            next(lines)
            for row in lines:
                if not row.startswith("|"):
                    break
                found.append([cell.strip().strip("*`") for cell in row.strip()[1:-1].split("|")])
    assert found, f"{name} has no table that begins with {first!r}"
    return found


def defined(path, dotted):
    """Whether this file defines Class, function, Class.method, CONSTANT or an attribute that Class.__init__ makes."""
    body = parsed(PROJECT / path).body
    *owners, last = dotted.split(".")
    for owner in owners:
        body = next((n.body for n in body if isinstance(n, ast.ClassDef) and n.name == owner), ())
    return last in {name for node in body for name in _names(node)}


def _names(node):
    if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
        yield node.name
    elif isinstance(node, ast.Assign):
        yield from (target.id for target in node.targets if isinstance(target, ast.Name))
