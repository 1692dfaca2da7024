"""The core's files linked into one module: `link(files, entry) -> Linked`, for an image where the heap is scarce.

On a microcontroller the names cost more than the data: each module, each imported name and
each public constant takes heap at import. Linking keeps the sources as they are and drops
what only they need: constants become numbers where they are used, the modules one,
imports vanish, and what the entry cannot reach is left out. What is left goes into flash as it is (rom). Nothing is computed otherwise;
that the linked core steps with the same hashes as the files themselves is tested.

What it relies on (a LinkError names what is not so): files of the core are imported by `from ... import` at the top,
no star; no getattr and its like; no nested functions, no lambda; no variable called as a global that is meant beside it.
"""

import ast
import builtins
from dataclasses import dataclass, field

from host_tools.linker.reach import reachable
from host_tools.linker.rewriter import Rewriter
from host_tools.linker.settled import settle
from host_tools.linker.unit import BUILTIN, LinkError, Units, bound

__all__ = ("Linked", "LinkError", "link")


@dataclass
class Linked:
    source: str = ""
    modules: list = field(default_factory=list)  # paths of the files in it, in the order in which they run
    owners: dict = field(default_factory=dict)   # {name at the top of the linked module: path}


def link(files, entry, mark=""):
    """`files`: {path: source}; `entry`: path whose functions stay callable. `mark`: a function of the VM's builtins that is called in
    each constructor's place, mark(name of the class, class, *arguments), to measure what its object takes."""
    units = Units(files)
    order = units.order(entry)
    taken = dict.fromkeys(dir(builtins), BUILTIN)
    for unit in order:
        unit.resolve(units, taken)
    bodies = [(unit, [Rewriter(unit).visit(node) for node in unit.body]) for unit in order]
    settle([body for _, body in bodies])
    statements = [statement for _, body in bodies for statement in body]
    keep = reachable(statements, units.units[entry])
    if mark:
        _mark(mark, [statement for statement in statements if keep(statement)])
    linked = Linked(modules=[unit.path for unit in order])
    text = sorted(units.outside.values())
    for unit, body in bodies:
        for statement in body:
            if keep(statement):
                text.append(ast.unparse(ast.fix_missing_locations(statement)))
                for name in bound(statement):
                    linked.owners[name] = unit.path
    linked.source = "\n".join(text) + "\n"
    return linked


def _mark(mark, statements):
    classes = {statement.name for statement in statements if isinstance(statement, ast.ClassDef)}
    for statement in statements:
        for node in ast.walk(statement):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in classes:
                node.args = [ast.Constant(node.func.id), node.func, *node.args]
                node.func = ast.Name(mark, ast.Load())
