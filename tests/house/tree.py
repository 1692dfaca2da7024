# The project's Python files as the house rules see them: parsed once, named by
# their path from the project's folder. Nothing is imported to read it.

import ast
from functools import lru_cache
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
PACKAGES = ("protocol", "firmware_py", "sim_device", "host_tools")
OTHERS = ("tests", "benchmarks", "examples")


@lru_cache(maxsize=None)
def python_files(*folders):
    return tuple(sorted(p for f in folders for p in (PROJECT / f).rglob("*.py")))


@lru_cache(maxsize=None)
def parsed(path):
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


def name_of(path):
    return str(path.relative_to(PROJECT))


def module_of(path):
    parts = list(path.relative_to(PROJECT).with_suffix("").parts)
    if parts[-1] == "__init__":
        parts.pop()
    return ".".join(parts)


def imports_of(path):
    """Every module that a file imports, absolute, with its line: {(line, module)}."""
    package = module_of(path).split(".")
    if path.name != "__init__.py":
        package.pop()
    found = set()
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Import):
            found.update((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join(base + ([node.module] if node.module else []))
            found.add((node.lineno, module))
            # `from firmware_py.storage import point_ring` names a module too
            found.update((node.lineno, module + "." + alias.name) for alias in node.names if is_module(module + "." + alias.name))
    return found


def is_module(dotted):
    base = PROJECT.joinpath(*dotted.split("."))
    return base.with_suffix(".py").exists() or (base / "__init__.py").exists()


def file_of(dotted):
    base = PROJECT.joinpath(*dotted.split("."))
    return base.with_suffix(".py") if base.with_suffix(".py").exists() else base / "__init__.py"


@lru_cache(maxsize=None)
def core_files():
    """All that a core carries: firmware_py, and what of protocol it imports, directly or through others."""
    todo = list(python_files("firmware_py"))
    seen = set(todo)
    while todo:
        for _, module in imports_of(todo.pop()):
            if module.split(".")[0] == "protocol" and is_module(module):
                path = file_of(module)
                if path not in seen:
                    seen.add(path)
                    todo.append(path)
    return tuple(sorted(seen))
