"""The files to be linked, and what each name at their top means."""

import ast
from dataclasses import dataclass


class LinkError(Exception):
    """One sentence: the file and what in it cannot be linked."""


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
        self.outside = set()

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
        self.body = list(_unfolded(tree.body))
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
                    self._outside(units, alias.asname or alias.name, "import %s" % _as(alias))
            elif isinstance(node, ast.ImportFrom):
                for alias in node.names:
                    self._import(units, node, alias)
            elif not self._number(node):
                rest.append(node)
        assigned = {name for node in rest for name in bound(node)}
        for name in sorted(assigned):
            if name in self.names and self.names[name].kind == "number":
                raise LinkError("%s: %s is a number first and something else later: give it two names." % (self.path, name))
            unique = name if taken.setdefault(name, self.path) == self.path else "%s_%s" % (self.short, name)
            if taken.setdefault(unique, self.path) != self.path:
                raise LinkError("%s: two files want to call something %s." % (self.path, unique))
            self.names[name] = Symbol("global", unique)
        self.body = rest

    def _outside(self, units, name, statement):
        units.outside.add(statement)
        self.names[name] = Symbol("outside", name)

    def _import(self, units, node, alias):
        package = self._from(node)
        name = alias.asname or alias.name
        module = units.find(package + "." + alias.name)
        if module:
            self.names[name] = Symbol("module", units.units[module])
            return
        path = units.find(package)
        if path is None:
            if alias.name != "const":  # the compiler's own, and every one of them is a number by now
                self._outside(units, name, "from %s import %s" % (package, _as(alias)))
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
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            pairs = list(zip(target.elts, value.elts, strict=True))
        found = [(name.id, self._evaluated(what)) for name, what in pairs if isinstance(name, ast.Name)]
        if len(found) != len(pairs) or any(number is None or name in self.changing for name, number in found):
            return False
        self.names.update((name, Symbol("number", number)) for name, number in found)
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


def _unfolded(body):
    """Statements as MicroPython runs them on a part that has the emitters: branches chosen, doubts removed."""
    for node in body:
        if isinstance(node, ast.If):
            yield from _unfolded(node.body if _is_micropython(node.test) else node.orelse)
        elif isinstance(node, ast.Try):
            yield from _unfolded(node.body)
        elif not isinstance(node, ast.Assert) and not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
            yield node


def _is_micropython(test):
    if ast.unparse(test).startswith("sys.implementation.name "):
        return isinstance(test.ops[0], ast.Eq)
    raise LinkError("`if %s` at the top of a file cannot be linked: only sys.implementation.name is asked there." % ast.unparse(test))


def bound(node):
    """Names that a statement at the top binds."""
    if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
        return [node.name]
    return [part.id for part in ast.walk(node) if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store)]
