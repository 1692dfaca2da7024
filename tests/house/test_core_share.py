# On a small board functions and classes set the heap, not data: each has its share of it, so that what is still to be
# built finds room. Beyond a share: make two functions one, or raise the share here with what it takes from the 27 KiB.

import ast
from collections import Counter

from host_tools import stm32_core
from tests.house.tree import PROJECT

# Kept in the heap for each, measured on the emulated part (`budget --target stm32`, all files, by least squares).
FUNCTION_BYTES, CLASS_BYTES, NAME_BYTES = 18, 147, 11
# The core of today, rounded up: 8.6 KB of the 27 KiB. Files cost nothing in the image, which is linked to one module, and 48
# bytes each on a board that imports them.
SHARE = {"functions": 220, "classes": 30, "names": 30, "files": 50}


def counted(core):
    """({kind: how many}, {file: bytes}) of a linked core."""
    many, cost = Counter(files=len(core.modules)), Counter()
    for statement in ast.parse(core.source).body:
        if isinstance(statement, (ast.FunctionDef, ast.ClassDef)):
            owner = core.owners[statement.name]
            here = Counter(functions=sum(isinstance(node, ast.FunctionDef) for node in ast.walk(statement)),
                           classes=int(isinstance(statement, ast.ClassDef)))
        elif isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
            owner = core.owners[statement.targets[0].id]
            here = Counter(names=1)
        else:
            continue
        many += here
        cost[owner] += FUNCTION_BYTES * here["functions"] + CLASS_BYTES * here["classes"] + NAME_BYTES * here["names"]
    return many, cost


def beyond(many, cost):
    """One sentence for the share that is overdrawn, or None."""
    for kind, most in SHARE.items():
        if many[kind] > most:
            dearest, used = cost.most_common(1)[0]
            return "The core has %d %s, its share of the heap is %d: begin with %s, whose names alone take about %d bytes." % (
                many[kind], kind, most, dearest, used)
    return None


def test_the_core_keeps_to_its_share():
    many, cost = counted(stm32_core.linked(stm32_core.core_files(PROJECT)))
    assert min(many[kind] for kind in SHARE) > 10, "nothing was counted"
    assert beyond(many, cost) is None, beyond(many, cost)


def test_a_core_that_grows_is_told_where():
    files = stm32_core.core_files(PROJECT)
    names = ["grown_%d" % i for i in range(SHARE["functions"])]
    # Names that nobody reaches, and functions short enough to stand where they are called, the linker leaves out.
    body = "def %s(x):\n    while x > 3:\n        x -= 2\n        if x == 5:\n            return 4\n    return x\n"
    files["firmware_py/fixed.py"] += "".join(body % name for name in names).encode()
    files["firmware_py/main_stm32.py"] += ("def more():\n    return %s\n" % " + ".join("fixed.%s(1)" % name for name in names)).encode()
    files["firmware_py/main_stm32.py"] = b"from . import fixed\n" + files["firmware_py/main_stm32.py"]
    sentence = beyond(*counted(stm32_core.linked(files)))
    assert sentence and "functions" in sentence and "begin with firmware_py/fixed.py" in sentence, sentence
