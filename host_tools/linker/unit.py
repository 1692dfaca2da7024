"""The files to be linked, and what each name at their top means."""

import ast
from dataclasses import dataclass


class LinkError(Exception):
    """One sentence: the file and what in it cannot be linked."""


BUILTIN = "Python itself"  # whose names are taken: a core's own `min` must not become that of its other files


# A name at the top of a file after all: a number, a thing with its name in the linked module, another file, or from outside.
@dataclass(frozen=True)
class Symbol:
    kind: str      # "number", "global", "module", "outside"
    value: object


class Units:
    """The files by path, and which one an import means."""

    def __init__(self, files):
        self.files = files
        self.units = {}
        self.outside = {}  # {name: the import that brings it}

    def find(self, name):
        for path in (name.replace(".", "/") + ".py", name.replace(".", "/") + "/__init__.py"):
            if path in self.files:
                return path
        return None

    def order(self, entry):
        done = []
        self._visit(entry, done)
        return done

    def _visit(self, path, done):
        if path in self.units:
            return
        unit = self.units[path] = Unit(path, self.files[path])
        for name in unit.imports(self):
            self._visit(name, done)
        done.append(unit)


class Unit:
    """One file: its statements without what only another interpreter runs, and the meaning of each name at its top."""

    def __init__(self, path, source):
        self.path = path
        self.short = path.rsplit("/", 1)[-1].removesuffix(".py")
        self.names = {}
        tree = ast.parse(source, path)
        self.made = set()   # names of `names` that this file itself gives to things
        self.body = list(_unfolded(tree.body, path))
        self.changing = {name for node in ast.walk(tree) if isinstance(node, ast.Global) for name in node.names}

    def imports(self, units):
        for node in self.body:
            if isinstance(node, ast.ImportFrom):
                package = self._from(node)
                for alias in node.names:
                    path = units.find(package + "." + alias.name) or units.find(package)
                    if path:
                        yield path

    def _from(self, node):
        """The dotted name after `from`, from the top."""
        if not node.level:
            return node.module
        parts = self.path.split("/")[:-node.level]
        return ".".join(parts + ([node.module] if node.module else []))

    def resolve(self, units, taken):
        rest = []
        for node in self.body:
            if isinstance(node, ast.Import):
                for alias in node.names:
                    self._not_ours(units, node, alias)
                    self._outside(units, taken, alias.asname or alias.name.split(".")[0], "import %s" % _as(alias))
            elif isinstance(node, ast.ImportFrom):
                for alias in node.names:
                    self._import(units, taken, node, alias)
            elif not self._number(node):
                self._imports_inside(units, node)
                rest.append(node)
        self.made = {name for node in rest for name in bound(node)}
        for name in sorted(self.made):
            if name in self.names and self.names[name].kind == "number":
                raise LinkError("%s: %s is a number first and something else later: give it two names." % (self.path, name))
            unique = name if taken.setdefault(name, self.path) == self.path else "%s_%s" % (self.short, name)
            if taken.setdefault(unique, self.path) != self.path:
                raise LinkError("%s: two files want to call something %s." % (self.path, unique))
            if unique in units.outside:
                raise LinkError("%s: %s is also what `%s` brings: give it another name." % (self.path, unique, units.outside[unique]))
            self.names[name] = Symbol("global", unique)
        self.body = rest

    def _outside(self, units, taken, name, statement):
        if units.outside.setdefault(name, statement) != statement:
            raise LinkError("%s: `%s`, but %s is what `%s` brings: import it by another name." % (
                self.path, statement, name, units.outside[name]))
        if name in taken:
            raise LinkError("%s: `%s`, but %s is a name of %s: import it by another name." % (self.path, statement, name, taken[name]))
        self.names[name] = Symbol("outside", name)

    def _imports_inside(self, units, statement):
        """Only at the top does an import of a file of ours mean a name of the linked module."""
        for node in ast.walk(statement):
            if isinstance(node, ast.Import):
                for alias in node.names:
                    self._not_ours(units, node, alias)
            elif isinstance(node, ast.ImportFrom):
                package = self._from(node)
                if node.level or units.find(package) or any(units.find(package + "." + alias.name) for alias in node.names):
                    raise LinkError("%s:%d an import of %s inside a function or block: move it to the top." % (
                        self.path, node.lineno, package))

    def _not_ours(self, units, node, alias):
        if units.find(alias.name):
            raise LinkError("%s:%d `import %s` names a file of the core: write `from ... import`." % (self.path, node.lineno, _as(alias)))

    def _import(self, units, taken, node, alias):
        package = self._from(node)
        name = alias.asname or alias.name
        if name == "*":
            raise LinkError("%s:%d `import *` hides which names are meant: name them." % (self.path, node.lineno))
        module = units.find(package + "." + alias.name)
        if module:
            self.names[name] = Symbol("module", units.units[module])
            return
        path = units.find(package)
        if path is None:
            if node.level:
                raise LinkError("%s:%d %s is not among the files of the core." % (self.path, node.lineno, package))
            if alias.name != "const":  # the compiler's own, and every one of them is a number by now
                self._outside(units, taken, name, "from %s import %s" % (package, _as(alias)))
            return
        symbol = units.units[path].names.get(alias.name)
        if symbol is None:
            raise LinkError("%s: %s has no %s." % (self.path, path, alias.name))
        self.names[name] = symbol

    def _number(self, node):
        """Whether the statement makes names for numbers; they are remembered."""
        if not (isinstance(node, ast.Assign) and len(node.targets) == 1):
            return False
        target, value = node.targets[0], node.value
        pairs = [(target, value)]
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple) and len(target.elts) == len(value.elts):
            pairs = list(zip(target.elts, value.elts, strict=True))
        found = [(name.id, self._evaluated(what)) for name, what in pairs if isinstance(name, ast.Name)]
        if len(found) != len(pairs) or any(number is None or name in self.changing for name, number in found):
            return False
        for name, number in found:
            if self.names.setdefault(name, Symbol("number", number)) != Symbol("number", number):
                raise LinkError("%s:%d %s has another value before: give it another name." % (self.path, node.lineno, name))
        return True

    def _evaluated(self, node):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "const":
            node = node.args[0]
        for part in ast.walk(node):
            if isinstance(part, ast.Name):
                symbol = self.names.get(part.id)
                if symbol is None or symbol.kind != "number":
                    return None
            elif not isinstance(part, (ast.Constant, ast.BinOp, ast.UnaryOp, ast.operator, ast.unaryop, ast.expr_context)):
                return None
        numbers = {name: symbol.value for name, symbol in self.names.items() if symbol.kind == "number"}
        value = eval(compile(ast.Expression(node), self.path, "eval"), {"__builtins__": {}}, numbers)
        return value if isinstance(value, int) and not isinstance(value, bool) else None


def _as(alias):
    return "%s as %s" % (alias.name, alias.asname) if alias.asname else alias.name


def _unfolded(body, path):
    """Statements as MicroPython runs them on a part that has the emitters: branches chosen, doubts removed."""
    for node in body:
        if isinstance(node, ast.If):
            yield from _unfolded(node.body if _is_micropython(node.test, path) else node.orelse, path)
        elif isinstance(node, ast.Try):
            if node.orelse or node.finalbody:
                raise LinkError("%s:%d `try` at the top with `else` or `finally` cannot be linked." % (path, node.lineno))
            yield from _unfolded(node.body, path)
        elif not isinstance(node, ast.Assert) and not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
            yield node


def _is_micropython(test, path):
    if isinstance(test, ast.Compare) and ast.unparse(test.left) == "sys.implementation.name" and len(test.ops) == 1:
        name, equal = test.comparators[0], isinstance(test.ops[0], ast.Eq)
        if isinstance(name, ast.Constant) and isinstance(test.ops[0], (ast.Eq, ast.NotEq)):
            return (name.value == "micropython") == equal
    raise LinkError("%s:%d `if %s` at the top of a file cannot be linked: only sys.implementation.name is asked there." % (
        path, test.lineno, ast.unparse(test)))


def bound(node):
    """Names that a statement at the top binds."""
    if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
        return [node.name]
    return [part.id for part in ast.walk(node) if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store)]


def variables(function):
    """Names that are the function's own."""
    own, shared = set(), set()
    for part in ast.walk(function):
        if isinstance(part, ast.arg):
            own.add(part.arg)
        elif isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store):
            own.add(part.id)
        elif isinstance(part, ast.ExceptHandler) and part.name:
            own.add(part.name)
        elif isinstance(part, ast.alias):
            own.add((part.asname or part.name).split(".")[0])
        elif isinstance(part, ast.Global):
            shared.update(part.names)
    return own - shared
