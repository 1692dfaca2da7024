# Runs the core on CPython with every number watched: a value that a 31-bit small
# int cannot hold is an error here, as it would be an allocation on the board.
#
#   with guarded_core() as core:
#       Tvslam = core("firmware_py.pipeline").Tvslam
#
# How: the source of firmware_py and protocol is rewritten before it is compiled.
# Each arithmetic expression, each augmented assignment and each call that can make
# a number (sum, int, abs, from_bytes ...) passes its result through `_checked`.
# The rewritten modules live beside the ordinary ones, never in place of them.

import ast
import importlib
import importlib.abc
import importlib.machinery
import sys
from contextlib import contextmanager

from tests.house.tree import PROJECT

LIMIT = 2**30
GUARDED = ("firmware_py", "protocol")
MAKERS = {"sum", "int", "pow", "abs", "ord", "len", "from_bytes", "hash"}


# Raised where a value passes 2**30; an AssertionError, so that hypothesis shrinks it like any other.
class IntegerTooBig(AssertionError):
    pass


def _checked(value, where, line):
    if value.__class__ is int:
        if -LIMIT < value < LIMIT:
            return value
        raise IntegerTooBig(f"{where}:{line} makes {value}, which passes 2**30")
    if value.__class__ is float:
        raise IntegerTooBig(f"{where}:{line} makes the float {value}")
    return value


# Wraps what makes a number. `a.b[i] += e` becomes `a.b[i] = _checked(a.b[i] + e)`: its
# target is evaluated twice, so a call inside such a target is refused.
class _Watch(ast.NodeTransformer):
    def __init__(self, where):
        self.where = where

    def _wrap(self, node):
        call = ast.Call(ast.Name("_checked", ast.Load()), [node, ast.Constant(self.where), ast.Constant(node.lineno)], [])
        return ast.copy_location(call, node)

    def visit_BinOp(self, node):
        self.generic_visit(node)
        return self._wrap(node)

    def visit_UnaryOp(self, node):
        self.generic_visit(node)
        return self._wrap(node) if isinstance(node.op, (ast.USub, ast.Invert)) else node

    def visit_Call(self, node):
        self.generic_visit(node)
        name = node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")
        return self._wrap(node) if name in MAKERS else node

    def visit_AugAssign(self, node):
        if any(isinstance(n, ast.Call) for n in ast.walk(node.target)):
            raise SyntaxError(f"{self.where}:{node.lineno} calls in the target of an augmented assignment")
        self.generic_visit(node)
        read = ast.parse(ast.unparse(node.target), mode="eval").body
        value = ast.copy_location(ast.BinOp(read, node.op, node.value), node)
        return ast.copy_location(ast.Assign([node.target], self._wrap(value)), node)


def watched(source, where):
    tree = ast.parse(source, where)
    watch = _Watch(where)
    # an assertion of limits.py runs at import, where 1 << 30 may be made
    tree.body = [node if isinstance(node, ast.Assert) else watch.visit(node) for node in tree.body]
    return compile(ast.fix_missing_locations(tree), where, "exec")


class _Loader(importlib.abc.Loader):
    def __init__(self, path):
        self.path = path

    def exec_module(self, module):
        module.__dict__["_checked"] = _checked
        exec(watched(self.path.read_text(encoding="utf-8"), str(self.path.relative_to(PROJECT))), module.__dict__)


class _Finder(importlib.abc.MetaPathFinder):
    def find_spec(self, fullname, path=None, target=None):
        if fullname.split(".")[0] not in GUARDED:
            return None
        base = PROJECT.joinpath(*fullname.split("."))
        package = base.is_dir()
        file = base / "__init__.py" if package else base.with_suffix(".py")
        if not file.exists():
            return None
        spec = importlib.machinery.ModuleSpec(fullname, _Loader(file), origin=str(file), is_package=package)
        if package:
            spec.submodule_search_locations = [str(base)]
        return spec


def _ours():
    return {name: module for name, module in sys.modules.items() if name.split(".")[0] in GUARDED}


@contextmanager
def guarded_core():
    """Gives import_module for watched copies of the core's modules; they stay usable after the block."""
    plain = _ours()
    for name in plain:
        del sys.modules[name]
    finder = _Finder()
    sys.meta_path.insert(0, finder)
    try:
        yield importlib.import_module
    finally:
        sys.meta_path.remove(finder)
        for name in _ours():
            del sys.modules[name]
        sys.modules.update(plain)
