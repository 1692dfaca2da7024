"""The linked core as a module in flash: `c_source(core, frozen)` -> C that stands behind what MicroPython's build froze.

A module that is imported makes its functions, classes and names anew in the heap: 11 KB for the core. None of them ever
changes, so the image has them ready in flash, as the VM's own modules are: the globals and each class's names as hash
tables in the VM's layout, each function as the object that `def` would have made of the same machine code. The heap is left to the data.

What it relies on (a LinkError names what is not so): nothing runs at import, but names are given to functions, plain
classes, and literals; names of modules and types of the VM are imported.
"""

import ast
import re
from pathlib import Path

from host_tools.linker.unit import LinkError

MODULE = "tvslam"
INT_LIMIT = 1 << 30  # the part's small ints
HASH_BYTES = 2  # MICROPY_QSTR_BYTES_IN_HASH: rom.c asserts it
# (package, name) that is imported: the VM's own object.
OF_THE_VM = {(None, "gc"): "mp_module_gc", (None, "micropython"): "mp_module_micropython", (None, "sys"): "mp_module_sys",
             ("array", "array"): "mp_type_array"}
FUNCTIONS = {"MP_CODE_NATIVE_PY": "mp_type_fun_native", "MP_CODE_NATIVE_VIPER": "mp_type_fun_viper"}
RAW_CODE = re.compile(r"static const mp_raw_code(?:_truncated)?_t (?:proto_fun|raw_code)_(\w+) = \{(.*?)\n\};", re.S)
CHILDREN = re.compile(r"static const mp_raw_code_t \*const children_(\w+)\[\] = \{(.*?)\};", re.S)


def c_source(source, frozen):
    """`source`: the linked module; `frozen`: the text of frozen_content.c that was made of it, its functions in the same order."""
    codes = Codes(frozen)
    rom = Rom(codes)
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Global):
            raise LinkError("`%s`: in flash no name at the top gets another value: keep it in an object." % ast.unparse(node))
    scopes = [node for node in tree.body if isinstance(node, (ast.FunctionDef, ast.ClassDef))]
    names = {"__name__": "MP_ROM_QSTR(MP_QSTR_%s)" % MODULE}
    for node, code in zip(scopes, codes.children(codes.module, len(scopes)), strict=True):
        names[node.name] = rom.a_class(node, code) if isinstance(node, ast.ClassDef) else rom.function(node, code, node.name)
    values = {}
    for node in tree.body:
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            names.update(_outside(node))
        elif isinstance(node, ast.Assign) and len(node.targets) == 1 and isinstance(node.targets[0], ast.Name):
            name = node.targets[0].id
            values[name] = _literal(node, values)
            names[name] = rom.value(values[name])
        elif node not in scopes:
            raise LinkError("`%s` would run at import, where nothing runs in the image: move it into a function." % ast.unparse(node)[:60])
    rom.table("rom_globals", names)
    rom.lines.append("const byte rom_of_class[] = {%s};\nconst size_t rom_of_class_size = sizeof(rom_of_class);" % (
        ", ".join("[MP_QSTR_%s] = 1" % name for name in sorted(rom.of_classes))))
    rom.lines.append("const mp_module_context_t %s_module = {{{&mp_type_module}, (mp_obj_dict_t *)&rom_globals}, {%s, %s}};" % (
        MODULE, *codes.constants))
    head = Path(__file__).with_name("rom.c").read_text(encoding="utf-8")
    return "\n".join(["", head, *rom.lines, ""])


class Codes:
    """The pieces of code that the build froze, by the names that it gave them."""

    def __init__(self, frozen):
        self._codes = {name: dict(re.findall(r"\.(\w+) = (.*?),?$", body, re.M)) for name, body in RAW_CODE.findall(frozen)}
        self._children = {name: re.findall(r"&(?:proto_fun|raw_code)_(\w+)", body) for name, body in CHILDREN.findall(frozen)}
        self.module = MODULE + "__lt_module_gt_"
        tables = re.search(r"\.qstr_table = (.*?),\n\s*\.obj_table = (.*?),\n", frozen)
        if self.module not in self._codes or not tables:
            raise LinkError("What MicroPython's build froze has no module %s in it." % MODULE)
        self.constants = tables.groups()

    def children(self, name, count):
        found = self._children.get(name, [])
        if len(found) != count:
            raise LinkError("%s has %d functions and classes, but the build froze %d: has MicroPython's mpy-tool changed?" % (
                name, count, len(found)))
        return found

    def of(self, name):
        return self._codes[name]


class Rom:
    """C definitions in `lines`; each method adds some and gives the C expression that stands for the object."""

    def __init__(self, codes):
        self.codes = codes
        self.lines = []
        self.of_classes = set()

    def a_class(self, node, code):
        methods = [part for part in node.body if isinstance(part, ast.FunctionDef)]
        constants = [part for part in node.body if isinstance(part, ast.Assign) and [type(t) for t in part.targets] == [ast.Name]]
        if node.bases or node.keywords or node.decorator_list or any(
                not isinstance(part, (ast.FunctionDef, ast.Pass)) and part not in constants for part in node.body):
            raise LinkError("class %s: in flash a class has no bases, and only methods and constants in it." % node.name)
        names = {part.targets[0].id: self.value(_literal(part, {})) for part in constants}
        for method, its_code in zip(methods, self.codes.children(code, len(methods)), strict=True):
            if method.name.startswith("__") and method.name != "__init__":
                raise LinkError("class %s: in flash a class has no %s." % (node.name, method.name))
            names[method.name] = self.function(method, its_code, "%s_%s" % (node.name, method.name))
        attributes = _attributes(methods)
        hidden = sorted(attributes & set(names))
        if hidden:
            raise LinkError("class %s: in flash a class's own %s hides what an object gives that name: give one of them another." % (
                node.name, hidden[0]))
        self.of_classes.update(names)
        self.table("rom_names_%s_%s" % (MODULE, node.name), names)
        self.lines.append("ROM_CLASS(%s, %d)" % (node.name, len(attributes)))
        return "MP_ROM_PTR(&rom_%s_%s)" % (MODULE, node.name)

    def function(self, node, code, name):
        of, args = self.codes.of(code), node.args
        if args.kw_defaults or len(set(map(ast.unparse, node.decorator_list)) - {"micropython.viper", "micropython.asm_thumb"}):
            raise LinkError("%s: in flash a function has no keyword-only defaults and no decorator but the emitters'." % name)
        if of["kind"] == "MP_CODE_NATIVE_ASM":
            self.lines.append("static const mp_obj_fun_asm_t rom_%s_%s = {{&mp_type_fun_asm}, %s, %s, %s};" % (
                MODULE, name, of["asm_n_pos_args"], of["fun_data"], of["asm_type_sig"]))
        elif of["kind"] in FUNCTIONS:
            defaults = [self.value(_literal(default, {})) for default in args.defaults]
            self.lines.append("ROM_FUNCTION(%d) rom_%s_%s = {{{&%s}, &%s_module, %s, %s}, {%s}};" % (
                len(defaults), MODULE, name, FUNCTIONS[of["kind"]], MODULE, of["children"], of["fun_data"], ", ".join(defaults)))
        else:
            raise LinkError("%s is no machine code but %s: the image is built with -X emit=native." % (name, of["kind"]))
        return "MP_ROM_PTR(&rom_%s_%s)" % (MODULE, name)

    def value(self, value):
        if value is None:
            return "MP_ROM_NONE"
        if isinstance(value, bool):
            return "MP_ROM_%s" % str(value).upper()
        if isinstance(value, int):
            if abs(value) >= INT_LIMIT:
                raise LinkError("%d cannot stand in flash: there an int has 31 bits, and this one would wrap: stay below 2**30." % value)
            return "MP_ROM_INT(%d)" % value
        name = "rom_%s_%d" % (MODULE, len(self.lines))
        if isinstance(value, (bytes, str)):
            data = value if isinstance(value, bytes) else value.encode()
            self.lines.append('static const mp_obj_str_t %s = {{&mp_type_%s}, 0, %d, (const byte *)"%s"};' % (
                name, type(value).__name__, len(data), "".join("\\%03o" % byte for byte in data)))
        else:
            items = [self.value(item) for item in value]
            name = "rom_%s_%d" % (MODULE, len(self.lines))  # they took numbers, too
            self.lines.append("static const mp_rom_obj_tuple_t %s = {{&mp_type_tuple}, %d, {%s}};" % (name, len(items), ", ".join(items)))
        return "MP_ROM_PTR(&%s)" % name

    def table(self, name, values):
        """A dict in the VM's layout: open addressing by the names' hashes. Half of it stays free: what is not in it is asked for, too."""
        places = [None] * min(2 * len(values) + 1, max(255, len(values) + 1))  # the VM's cache knows the first 256 places
        for key in values:
            at = qstr_hash(key) % len(places)
            while places[at]:
                at = (at + 1) % len(places)
            places[at] = key
        rows = ["    {MP_ROM_QSTR(MP_QSTR_%s), %s}," % (key, values[key]) if key else "    {0, 0}," for key in places]
        self.lines.append("static const mp_rom_map_elem_t %s_table[] = {\n%s\n};" % (name, "\n".join(rows)))
        self.lines.append("static const mp_obj_dict_t %s = ROM_TABLE(%d, %s_table);" % (name, len(values), name))


def qstr_hash(name):
    """As MicroPython's py/qstr.c."""
    value = 5381
    for byte in name.encode():
        value = (value * 33) ^ byte
    return value & (1 << 8 * HASH_BYTES) - 1 or 1


def _outside(node):
    """{name: C expression} of what an import brings."""
    package = getattr(node, "module", None)
    try:
        return {alias.asname or alias.name: "MP_ROM_PTR(&%s)" % OF_THE_VM[package, alias.name] for alias in node.names}
    except KeyError:
        raise LinkError("`%s`: a module in flash can only import %s. Does firmware_py/manifest.py list the file?" % (
            ast.unparse(node), ", ".join(name for _, name in OF_THE_VM))) from None


def _literal(node, values):
    """The value of what stands right of an assignment, or of a default."""
    node = node.value if isinstance(node, ast.Assign) else node
    try:
        value = eval(compile(ast.Expression(node), MODULE, "eval"), {"__builtins__": {"len": len}}, values)
    except Exception as error:
        raise LinkError("`%s` cannot stand in flash: %s." % (ast.unparse(node)[:60], error)) from None
    if not _plain(value):
        raise LinkError("`%s` cannot stand in flash: only numbers, bytes, text and tuples of them." % ast.unparse(node)[:60])
    return value


def _attributes(methods):
    """Names that the methods give values to in `self`: so many places an object gets at once."""
    parts = [part for method in methods for part in ast.walk(method) if isinstance(part, ast.Attribute) and isinstance(part.ctx, ast.Store)]
    return {part.attr for part in parts if isinstance(part.value, ast.Name) and part.value.id == "self"}


def _plain(value):
    return value is None or isinstance(value, (int, bytes, str)) or isinstance(value, tuple) and all(map(_plain, value))
