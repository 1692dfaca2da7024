"""Private methods that are called in one place are put there: 27 bytes of heap less each, and a call.

Only where it cannot change anything: one class defines the name, and its one mention in the whole linked module is a call by
`self` that stands alone, is assigned to a name, or is returned; but for the last, no `return` of the method stands in a loop;
the method is a plain one (_plain), and no name in it would be another in its caller.
"""

import ast
import copy
from collections import Counter

from host_tools.linker.unit import bound, variables

# What has names that are no ast.Name, or runs otherwise when it is not a function of its own.
NOT_PLAIN = (ast.Global, ast.Nonlocal, ast.Import, ast.ImportFrom, ast.Yield, ast.YieldFrom, ast.Await, ast.Lambda, ast.ClassDef,
             ast.AsyncFunctionDef)


class _CannotInline(Exception):
    pass


def inline(statements):
    """Changes the classes among `statements`."""
    mentions, definitions = Counter(), Counter()
    for statement in statements:
        for part in ast.walk(statement):
            if isinstance(part, ast.Attribute):
                mentions[part.attr] += 1
        if isinstance(statement, ast.ClassDef):
            definitions.update(name for part in statement.body for name in bound(part))
    once = {name for name in definitions if definitions[name] == mentions[name] == 1 and name.startswith("_") and name[:2] != "__"}
    for statement in statements:
        if isinstance(statement, ast.ClassDef):
            _inline_in(statement, once)


def _inline_in(a_class, once):
    for method in [part for part in a_class.body if isinstance(part, ast.FunctionDef)]:
        if method.name not in once or not _plain(method):
            continue
        for caller in a_class.body:
            if isinstance(caller, ast.FunctionDef) and caller is not method and not caller.decorator_list and _by_self(caller):
                if _put_into(caller, method):
                    a_class.body.remove(method)
                    break


def _plain(method):
    args = method.args
    if method.decorator_list or args.defaults or args.posonlyargs or args.vararg or args.kwonlyargs or args.kwarg or not _by_self(method):
        return False
    parts = [part for statement in method.body for part in ast.walk(statement)]
    return not any(isinstance(part, (*NOT_PLAIN, ast.FunctionDef)) or isinstance(part, ast.ExceptHandler) and part.name for part in parts)


def _by_self(method):
    """Whether `self` is the object in all of it."""
    selves = [part for part in ast.walk(method) if isinstance(part, ast.Name) and part.id == "self"]
    return [arg.arg for arg in method.args.args[:1]] == ["self"] and all(isinstance(part.ctx, ast.Load) for part in selves)


def _put_into(caller, method):
    """-> whether `caller` had the call, and has the method's statements in its place."""
    for part in ast.walk(caller):
        for name in ("body", "orelse"):
            block = getattr(part, name, None)
            if not isinstance(block, list):
                continue
            for i, statement in enumerate(block):
                call = _call(statement, method)
                if call:
                    try:
                        block[i:i + 1] = _instead(statement, call, method, caller) or [ast.Pass()]
                    except _CannotInline:
                        return False
                    return True
    return False


def _call(statement, method):
    if not isinstance(statement, (ast.Expr, ast.Return, ast.Assign)):
        return None
    if isinstance(statement, ast.Assign) and not (len(statement.targets) == 1 and isinstance(statement.targets[0], ast.Name)):
        return None
    call = statement.value
    if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute) and call.func.attr == method.name):
        return None
    by_self = isinstance(call.func.value, ast.Name) and call.func.value.id == "self"
    plain = not call.keywords and not any(isinstance(arg, ast.Starred) for arg in call.args)
    return call if by_self and plain and len(call.args) + 1 == len(method.args.args) else None


def _instead(statement, call, method, caller):
    own = [arg.arg for arg in method.args.args[1:]]
    local = variables(method) - {"self"}
    body = copy.deepcopy(method.body)
    free, renamed = set(), {"%s_%s" % (method.name, name) for name in local}
    for part in body:
        for name in ast.walk(part):
            if isinstance(name, ast.Name) and name.id in local:
                name.id = "%s_%s" % (method.name, name.id)
            elif isinstance(name, ast.Name) and name.id != "self":
                free.add(name.id)
    of_caller = variables(caller)
    if free & of_caller or renamed & (free | of_caller | {part.id for part in ast.walk(caller) if isinstance(part, ast.Name)}):
        raise _CannotInline
    taken = [_assign("%s_%s" % (method.name, name), value) for name, value in zip(own, call.args, strict=True)]
    if isinstance(statement, ast.Return):
        return taken + body + ([] if _ends(body) else [ast.Return(None)])
    if isinstance(statement, ast.Assign):
        target = statement.targets[0].id
        return taken + _tail(body, lambda value: [_assign(target, value or ast.Constant(None))])
    return taken + _tail(body, lambda value: [ast.Expr(value)] if _calls(value) else [])


def _calls(value):
    return value is not None and any(isinstance(part, ast.Call) for part in ast.walk(value))


def _assign(name, value):
    return ast.Assign([ast.Name(name, ast.Store())], value)


def _returns(node):
    return any(isinstance(part, ast.Return) for part in ast.walk(node))


def _ends(block):
    """Whether every way through the block ends in a return."""
    last = block[-1] if block else None
    return isinstance(last, ast.Return) or isinstance(last, ast.If) and _ends(last.body) and _ends(last.orelse)


def _tail(block, result):
    """The block with each `return X` as result(X): what follows one goes into the other branch."""
    out = []
    for i, statement in enumerate(block):
        rest = block[i + 1:]
        if isinstance(statement, ast.Return):
            return out + result(statement.value)
        if not _returns(statement):
            out.append(statement)
            continue
        if not isinstance(statement, ast.If):
            raise _CannotInline
        if _ends(statement.body):
            body, orelse = _tail(statement.body, result), _tail(statement.orelse + rest, result)
        elif statement.orelse and _ends(statement.orelse):
            body, orelse = _tail(statement.body + rest, result), _tail(statement.orelse, result)
        elif not rest:
            body, orelse = _tail(statement.body, result), _tail(statement.orelse, result)
        else:
            raise _CannotInline
        return [*out, ast.If(statement.test, body or [ast.Pass()], orelse)]
    return out + result(None)
