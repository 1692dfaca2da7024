# The Python that the core is written in: what never allocates after boot, never
# needs a float unit, and means the same on MicroPython and CPython.
# (That it really allocates nothing is proved by tests/upy under a locked heap.)

import ast

from tests.house.tree import core_files, name_of, parsed

SMALL_INT = 2**30
# 'I' and 'L' read values that need a big integer on a 32-bit board; 'q' always does; 'f' and 'd' are floats.
ARRAY_CODES = set("bBhHi")
NO_NAMES = {"float", "complex", "divmod", "enumerate", "zip", "map", "filter", "sorted", "round", "eval", "exec", "globals", "locals"}
PORTS = "firmware_py/ports/"
CPYTHON_ONLY = {"firmware_py/ports/host.py"}  # the port of the target `cpython` never runs in the VM
VIPER = "_viper.py"                           # a faster twin of a file that works without the emitter


def offences(complain):
    found = []
    for path in core_files():
        if name_of(path) in CPYTHON_ONLY:
            continue
        for node in ast.walk(parsed(path)):
            text = complain(node, name_of(path))
            if text:
                found.append(f"{name_of(path)}:{node.lineno} {text}")
    assert not found, "\n" + "\n".join(sorted(found))


def test_the_rules_see_the_core():
    names = {name_of(p) for p in core_files()}
    assert "firmware_py/pipeline.py" in names and "protocol/codec.py" in names, names


def test_no_float_anywhere():
    def complain(node, _):
        if isinstance(node, ast.Constant) and isinstance(node.value, (float, complex)):
            return f"float literal {node.value}"
        if isinstance(node, (ast.BinOp, ast.AugAssign)) and isinstance(node.op, (ast.Div, ast.MatMult)):
            return "true division makes a float: use // or a shift"
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow) and not isinstance(node.left, ast.Constant):
            return "** of a variable"
    offences(complain)


def test_no_construct_that_allocates_unseen():
    def complain(node, path):
        if isinstance(node, ast.JoinedStr):
            return "f-string"
        if isinstance(node, (ast.Lambda, ast.Yield, ast.YieldFrom, ast.AsyncFunctionDef, ast.Await, ast.GeneratorExp, ast.With)):
            return type(node).__name__
        if isinstance(node, ast.Return) and isinstance(node.value, (ast.Tuple, ast.List, ast.Dict)):
            return "returns several values: write them into attributes or the caller's buffer"
        if isinstance(node, ast.FunctionDef) and any(isinstance(n, ast.Assign) and isinstance(n.value, ast.Tuple) for n in ast.walk(node)):
            return f"{node.name} assigns several values at once: in the linked module that makes a tuple"
        if isinstance(node, ast.Call) and any(isinstance(a, ast.Starred) for a in node.args):
            return "call with *args"
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "range" and len(node.args) == 3:
            step = node.args[2].operand if isinstance(node.args[2], ast.UnaryOp) else node.args[2]
            if not isinstance(step, ast.Constant):
                return "range with a step that is no literal makes an object"
        if isinstance(node, ast.FunctionDef) and (node.args.vararg or node.args.kwarg):
            return f"{node.name} takes *args"
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id in NO_NAMES:
            return node.id
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and not path.startswith(PORTS) and not path.endswith(VIPER):
            for decorator in node.decorator_list:
                if ast.unparse(decorator) != "micropython.native":
                    return f"decorator @{ast.unparse(decorator)}: emitters belong in {PORTS}"
    offences(complain)


def test_a_board_without_the_emitter_can_do_without_the_viper_twin():
    found = []
    for path in core_files():
        guarded = {id(n) for t in ast.walk(parsed(path)) if isinstance(t, ast.Try) for n in ast.walk(t)}
        for node in ast.walk(parsed(path)):
            if isinstance(node, (ast.Import, ast.ImportFrom)) and id(node) not in guarded:
                if "_viper" in ast.unparse(node) and not name_of(path).startswith(PORTS):
                    found.append(f"{name_of(path)}:{node.lineno} {ast.unparse(node)} outside of a try")
    assert not found, "\n".join(found)


def test_no_closure():
    def complain(node, _):
        if isinstance(node, ast.FunctionDef):
            inner = [n for n in ast.walk(node) if n is not node and isinstance(n, (ast.FunctionDef, ast.ClassDef))]
            if inner:
                return f"{inner[0].name} inside {node.name}"
    offences(complain)


def test_literals_are_small_ints():
    def complain(node, _):
        if isinstance(node, ast.Constant) and type(node.value) is int and abs(node.value) >= SMALL_INT:
            return f"{node.value} is a big integer on a 32-bit board"
    offences(complain)


def test_arrays_hold_what_a_small_int_holds():
    def complain(node, _):
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ("array", "array.array") and node.args:
            code = node.args[0]
            if isinstance(code, ast.Constant) and code.value not in ARRAY_CODES:
                return f"array({code.value!r})"
    offences(complain)


def test_every_attribute_is_born_in_init():
    # An attribute that first appears later grows the instance: an allocation under a locked heap.
    found = []
    for path in core_files():
        for cls in (n for n in ast.walk(parsed(path)) if isinstance(n, ast.ClassDef)):
            methods = [n for n in cls.body if isinstance(n, ast.FunctionDef)]
            born = {name for m in methods if m.name == "__init__" for name, _ in _own_attributes(m)}
            for method in methods:
                for name, line in _own_attributes(method):
                    if name not in born:
                        found.append(f"{name_of(path)}:{line} {cls.name}.{name} is first assigned in {method.name}")
    assert not found, "\n" + "\n".join(sorted(set(found)))


def _own_attributes(method):
    for node in ast.walk(method):
        if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            if isinstance(node.value, ast.Name) and node.value.id == "self":
                yield node.attr, node.lineno
