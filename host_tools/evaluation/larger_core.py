"""A core with other capacities than its own, for floors that no home has: a copy with its limits changed, to be run from there."""

import os
import re
import shutil

from host_tools.core_process import packages_folder


def larger_core(limits, folder):
    """The folder to look for firmware_py in. `limits`: {name in firmware_py/limits.py: value}."""
    core = os.path.join(folder, "firmware_py")
    shutil.copytree(os.path.join(packages_folder(), "firmware_py"), core, ignore=shutil.ignore_patterns("__pycache__"))
    path = os.path.join(core, "limits.py")
    with open(path, encoding="utf-8") as file:
        text = file.read()
    for name, value in limits.items():
        text, count = re.subn(r"(?m)^%s = [^#\n]*" % re.escape(name), "%s = %d  " % (name, value), text)
        if count != 1:
            raise ValueError("firmware_py/limits.py has no %s" % name)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
    return folder
