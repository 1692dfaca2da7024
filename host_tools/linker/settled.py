"""What a call at the top of the linked module gives to names, given to them before anything runs: `settle(bodies)`.

A port puts machine code in the place of the core's loops by such a call. Linked, every mention means the machine code at
once, the call is gone, and the loops that nobody mentions any more are left out.
"""

import ast

from host_tools.linker.unit import variables


def settle(bodies):
    """Changes `bodies`, lists of statements: calls at the top of functions that do nothing but `global NAMES; NAME = OTHER; ...`."""
    functions = {node.name: node for body in bodies for node in body if isinstance(node, ast.FunctionDef)}
    meant, done = {}, []
    for body in bodies:
        for statement in body:
            function = functions.get(_called(statement))
            given = _given(function) if function else {}
            if given:
                meant.update(given)
                done += [statement, function]
    for body in bodies:
        body[:] = [_Renamer(meant).visit(statement) for statement in body if statement not in done]


class _Renamer(ast.NodeTransformer):
    """Names that mean others. A function's own variables are left alone."""

    def __init__(self, meant):
        self.meant = meant

    def visit_FunctionDef(self, node):
        outer = self.meant
        self.meant = {name: other for name, other in outer.items() if name not in variables(node)}
        self.generic_visit(node)
        self.meant = outer
        return node

    def visit_Name(self, node):
        if isinstance(node.ctx, ast.Load) and node.id in self.meant:
            node.id = self.meant[node.id]
        return node


def _called(statement):
    """The name that a statement calls with nothing, if that is all that it does."""
    call = statement.value if isinstance(statement, ast.Expr) else None
    plain = isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and not call.args and not call.keywords
    return call.func.id if plain else None


def _given(function):
    """{name: name} if the function gives names to globals and does nothing else."""
    shared = {name for node in function.body if isinstance(node, ast.Global) for name in node.names}
    given = {}
    for node in function.body:
        targets = [getattr(target, "id", None) for target in node.targets] if isinstance(node, ast.Assign) else []
        if len(targets) == 1 and targets[0] in shared and isinstance(node.value, ast.Name):
            given[targets[0]] = node.value.id
        elif not isinstance(node, ast.Global):
            return {}
    return given
