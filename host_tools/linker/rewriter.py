"""A file's statements, with the names of the linked module."""

import ast

from host_tools.linker.unit import LinkError, bound, variables

# They reach names by their spelling: of what the linked module has renamed, or left out.
BY_SPELLING = ("getattr", "setattr", "delattr", "hasattr", "globals", "locals", "vars", "dir", "eval", "exec", "__import__")


class Rewriter(ast.NodeTransformer):
    """Names of one file to names of the linked module. A function's own variables are left alone."""

    def __init__(self, unit):
        self.unit = unit
        self.own = set()    # variables of the function, or names of the class, at hand
        self.doubtful = set()  # of the class's: methods, which the linker may take out, and names of the file's top, too
        self.stored = None  # globals that the function at hand assigns to by `module.name = ...`

    def visit_FunctionDef(self, node):
        if self.stored is not None or node.name not in self.unit.made:
            self._refuse(node, "a function in a function or block cannot be linked")
        node = self._function(node)
        node.name = self.unit.names[node.name].value
        return node

    def _function(self, node):
        node.decorator_list = [self.visit(decorator) for decorator in node.decorator_list]
        node.args.defaults = [self.visit(default) for default in node.args.defaults]  # outside of the function, as they are run
        node.args.kw_defaults = [default and self.visit(default) for default in node.args.kw_defaults]
        outer, self.own, self.stored = self.own, variables(node), set()
        node.body = [self.visit(statement) for statement in node.body]
        if self.stored:
            node.body.insert(0, ast.Global(sorted(self.stored)))
        self.own, self.stored = outer, None
        return node

    def visit_ClassDef(self, node):
        if self.stored is not None or node.name not in self.unit.made:
            self._refuse(node, "a class in a function or block cannot be linked")
        for outside in (node.bases, node.keywords, node.decorator_list):
            outside[:] = [self.visit(part) for part in outside]
        methods = {part.name for part in node.body if isinstance(part, ast.FunctionDef)}
        self.own = {name for part in node.body for name in bound(part)}
        self.doubtful = methods | {name for name in self.own if name in self.unit.names}
        body = []
        for part in node.body:
            if isinstance(part, ast.FunctionDef):
                part = self._function(part)
            elif isinstance(part, ast.Assign):
                part.value = self.visit(part.value)
            elif not isinstance(part, (ast.Pass, ast.Expr)):
                self._refuse(part, "class %s holds what cannot be linked" % node.name)
            body.append(part)
        self.own = set()
        node.name = self.unit.names[node.name].value
        node.body = body
        return node

    def visit_Lambda(self, node):
        self._refuse(node, "a lambda cannot be linked: write a function")

    def visit_AsyncFunctionDef(self, node):
        self._refuse(node, "an async function cannot be linked")

    def visit_comprehension(self, node):
        for part in ast.walk(node.target):
            if self.stored is not None and isinstance(part, ast.Name) and part.id in self.unit.names:
                self._captured(part, part.id)
        return self.generic_visit(node)

    def visit_Name(self, node):
        symbol = self.unit.names.get(node.id)
        if node.id in self.own:
            if self.stored is None and node.id in self.doubtful:
                self._refuse(node, "%s is a name of the class and used in its body: give it another name, or the value itself" % node.id)
            return node
        if symbol is None:
            if node.id in BY_SPELLING:
                self._refuse(node, "%s reaches names by their spelling, which linking changes" % node.id)
            return node
        return self._meant(symbol, node, node.id)

    def visit_Attribute(self, node):
        symbol = self.unit.names.get(node.value.id) if isinstance(node.value, ast.Name) and node.value.id not in self.own else None
        if symbol is None or symbol.kind != "module":
            return self.generic_visit(node)
        meant = symbol.value.names.get(node.attr)
        if meant is None:
            self._refuse(node, "%s has no %s" % (symbol.value.path, node.attr))
        if not isinstance(node.ctx, ast.Load):
            if meant.kind != "global" or self.stored is None:
                self._refuse(node, "%s of %s is no name that can be given another value" % (node.attr, symbol.value.path))
            self.stored.add(meant.value)
        return self._meant(meant, node, node.attr)

    def visit_Global(self, node):
        for name in node.names:
            if name not in self.unit.made:
                self._refuse(node, "global %s is given no value at the top of this file" % name)
        return ast.Global([self.unit.names[name].value for name in node.names])

    def visit_Assert(self, node):
        return ast.Pass()

    def _meant(self, symbol, node, name):
        if symbol.kind == "module":
            self._refuse(node, "the module %s is used as a value" % name)
        if symbol.kind == "number":
            return ast.copy_location(ast.Constant(symbol.value), node)
        if symbol.value in self.own:
            self._captured(node, symbol.value)
        return ast.copy_location(ast.Name(symbol.value, node.ctx), node)

    def _captured(self, node, name):
        self._refuse(node, "%s is here a variable and a global that is meant as well: give the variable another name" % name)

    def _refuse(self, node, why):
        raise LinkError("%s:%d %s." % (self.unit.path, node.lineno, why))
