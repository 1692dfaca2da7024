# Who may import whom. The diagram is in docs/architecture.md.

import pytest

from tests.house.tree import PACKAGES, core_files, imports_of, module_of, name_of, python_files

MAY_IMPORT = {
    "protocol": {"protocol"},
    "firmware_py": {"firmware_py", "protocol"},
    "sim_device": {"sim_device", "protocol"},
    "host_tools": {"host_tools", "protocol"},
}
DOORS = {("host_tools", "sim_device.home")}  # the home file's format and its truth

# The three layers of the paper (Fig. 1) and cleaning share the floor below, never each other.
LAYERS = ("collection", "building", "association", "cleaning")
FLOOR = {"storage", "fixed", "tables", "limits", "flags"}

# What is there on MicroPython on a board without an operating system.
CORE_MODULES = {"array", "gc", "micropython", "sys"}
CORE_GUARDED = {"zlib", "binascii"}  # CPython's faster way, beside one of our own

OURS = set(PACKAGES) | {"tests", "benchmarks", "examples"}


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_imports_only_what_it_may(package):
    broken = []
    for path in python_files(package):
        for line, module in imports_of(path):
            top = module.split(".")[0]
            if top in OURS and top not in MAY_IMPORT[package]:
                if not any(package == who and (module + ".").startswith(door + ".") for who, door in DOORS):
                    if not _is_package_of_a_door(package, module, path, line):
                        broken.append(f"{name_of(path)}:{line} imports {module}")
    assert not broken, "\n".join(broken)


def _is_package_of_a_door(package, module, path, line):
    # `from sim_device import home` counts as both modules; the package alone opens nothing
    return any(who == package and door.rpartition(".")[0] == module and (line, door) in imports_of(path) for who, door in DOORS)


def test_the_layers_of_the_core_do_not_know_each_other():
    broken = []
    for layer in LAYERS:
        for path in python_files("firmware_py/" + layer):
            for line, module in imports_of(path):
                parts = module.split(".")
                if parts[0] == "firmware_py" and len(parts) > 1 and parts[1] not in FLOOR | {layer}:
                    broken.append(f"{name_of(path)}:{line} imports {module}: layers share only {', '.join(sorted(FLOOR))}")
    assert not broken, "\n".join(broken)


def test_the_floor_of_the_core_does_not_know_the_layers():
    broken = []
    for path in core_files():
        parts = module_of(path).split(".")
        if parts[0] == "firmware_py" and len(parts) > 1 and parts[1] in FLOOR:
            for line, module in imports_of(path):
                above = module.split(".")
                if above[0] == "firmware_py" and len(above) > 1 and above[1] not in FLOOR:
                    broken.append(f"{name_of(path)}:{line} imports {module}")
    assert not broken, "\n".join(broken)


def test_only_ports_touch_the_machine():
    broken = []
    for path in core_files():
        if name_of(path).startswith("firmware_py/ports/"):
            continue
        for line, module in imports_of(path):
            top = module.split(".")[0]
            entry = path.name in ("__main__.py", "main.py") or name_of(path) == "firmware_py/__init__.py"
            if top not in {"firmware_py", "protocol"} | CORE_MODULES | CORE_GUARDED and not entry:
                broken.append(f"{name_of(path)}:{line} imports {module}: descriptors, registers and clocks belong in firmware_py/ports")
    assert not broken, "\n".join(broken)
