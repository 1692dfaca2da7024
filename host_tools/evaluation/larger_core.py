"""A core with other constants than its own: a copy with those changed, to be run from there."""

import os
import re
import shutil

from host_tools.core_process import packages_folder

LIMITS = "limits.py"


def larger_core(limits, folder):
    """The folder to look for firmware_py in. `limits`: {name in firmware_py/limits.py, or file:name of another one: value}."""
    core = os.path.join(folder, "firmware_py")
    shutil.copytree(os.path.join(packages_folder(), "firmware_py"), core, ignore=shutil.ignore_patterns("__pycache__"))
    for name, value in limits.items():
        file, _, constant = name.rpartition(":")
        _change(os.path.join(core, file or LIMITS), file or LIMITS, constant, value)
    return folder


def _change(path, told, constant, value):
    with open(path, encoding="utf-8") as file:
        text = file.read()
    text, count = re.subn(r"(?m)^%s = [^#\n]*" % re.escape(constant), "%s = %d  " % (constant, value), text)
    if count != 1:
        raise ValueError("firmware_py/%s has no %s" % (told, constant))
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
