"""A file's statements, with the names of the linked module."""

import ast

from host_tools.linker.unit import LinkError


class Rewriter(ast.NodeTransformer):
    """Names of one file to names of the linked module. A function's own variables are left alone."""

    def __init__(self, unit):
        self.unit = unit
        self.own = set()
        self.stored = None  # globals that the function at hand assigns to by `module.name = ...`

    def visit_FunctionDef(self, node):
        if self.stored is not None:
            raise LinkError("%s:%d a function in a function cannot be linked." % (self.unit.path, node.lineno))
        node.decorator_list = [self.visit(decorator) for decorator in node.decorator_list]
        at_top = not self.own and self.unit.names.get(node.name)
        outer, shared = self.own, {name for part in ast.walk(node) if isinstance(part, ast.Global) for name in part.names}
        self.own = {a.arg for a in node.args.args + node.args.kwonlyargs}
        self.own |= {part.id for part in ast.walk(node) if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store)}
        self.own |= {part.name for part in ast.walk(node) if isinstance(part, ast.ExceptHandler) and part.name}
        self.own -= shared
        self.stored = set()
        node.args.defaults = [self.visit(default) for default in node.args.defaults]
        node.body = [self.visit(statement) for statement in node.body]
        if self.stored:
            node.body.insert(0, ast.Global(sorted(self.stored)))
        self.own, self.stored = outer, None
        if at_top and at_top.kind == "global":
            node.name = at_top.value
        return node

    def visit_ClassDef(self, node):
        node.bases = [self.visit(base) for base in node.bases]
        names, node.name = node.name, self.unit.names[node.name].value
        body = []
        for part in node.body:
            if isinstance(part, ast.FunctionDef):
                name = part.name
                part = self.visit(part)
                part.name = name
            elif isinstance(part, ast.Assign):
                part.value = self.visit(part.value)
            elif not isinstance(part, (ast.Pass, ast.Expr)):
                raise LinkError("%s:%d class %s holds what cannot be linked." % (self.unit.path, part.lineno, names))
            body.append(part)
        # What MicroPython writes into every class, for nobody: the two places are taken by methods instead.
        node.body = [ast.Delete([ast.Name(name, ast.Del()) for name in ("__module__", "__qualname__")]), *body]
        return node

    def visit_Name(self, node):
        symbol = None if node.id in self.own else self.unit.names.get(node.id)
        if symbol is None or symbol.kind == "outside":
            return node
        if symbol.kind == "module":
            raise LinkError("%s:%d the module %s is used as a value." % (self.unit.path, node.lineno, node.id))
        return self._meant(symbol, node)

    def visit_Attribute(self, node):
        symbol = self.unit.names.get(node.value.id) if isinstance(node.value, ast.Name) and node.value.id not in self.own else None
        if symbol is None or symbol.kind != "module":
            return self.generic_visit(node)
        meant = symbol.value.names.get(node.attr)
        if meant is None:
            raise LinkError("%s:%d %s has no %s." % (self.unit.path, node.lineno, symbol.value.path, node.attr))
        if isinstance(node.ctx, ast.Store):
            if meant.kind != "global" or self.stored is None:
                raise LinkError("%s:%d %s of %s is no name that can be given another value." % (
                    self.unit.path, node.lineno, node.attr, symbol.value.path))
            self.stored.add(meant.value)
        return self._meant(meant, node)

    def visit_Global(self, node):
        return ast.Global([self.unit.names[name].value for name in node.names])

    def visit_Assert(self, node):
        return ast.Pass()

    def _meant(self, symbol, node):
        if symbol.kind == "number":
            return ast.copy_location(ast.Constant(symbol.value), node)
        return ast.copy_location(ast.Name(symbol.value, node.ctx), node)
