"""What the entry reaches: the rest of the linked module is left out."""

import ast

from host_tools.linker.unit import bound


def reachable(statements, entry):
    """-> whether a statement is needed. Methods that nobody calls by name are taken out of their classes."""
    wanted = {entry.names[name].value for name in entry.names if entry.names[name].kind == "global" and not name.startswith("_")}
    seen = set()
    growing = True

    def take(node):
        for part in ast.walk(node):
            if isinstance(part, ast.Name):
                wanted.add(part.id)
            elif isinstance(part, ast.Attribute):
                wanted.add("." + part.attr)

    def needed(statement):
        return not _only_names(statement) or any(name in wanted for name in bound(statement))

    def called(method):
        return method.name.startswith("__") or "." + method.name in wanted

    while growing:
        growing = False
        for statement in statements:
            if not needed(statement):
                continue
            parts = [statement]
            if isinstance(statement, ast.ClassDef):
                parts = statement.bases + [p for p in statement.body if not isinstance(p, ast.FunctionDef) or called(p)]
            for part in parts:
                if id(part) not in seen:
                    seen.add(id(part))
                    take(part)
                    growing = True
    for statement in statements:
        if isinstance(statement, ast.ClassDef):
            statement.body = [p for p in statement.body if not isinstance(p, ast.FunctionDef) or called(p)]
    return needed


def _only_names(statement):
    """Whether all that a statement at the top does is to give names to things: without the names it does nothing."""
    if isinstance(statement, (ast.FunctionDef, ast.ClassDef)):
        return True
    parts = list(ast.walk(statement))
    return isinstance(statement, ast.Assign) and not any(
        isinstance(part, ast.Call) or isinstance(getattr(part, "ctx", None), ast.Store) and not isinstance(part, (ast.Name, ast.Tuple))
        for part in parts)
