# One noun a file, one thought a function: what outgrows that is split.

import ast

from tests.house.tree import OTHERS, PACKAGES, core_files, name_of, parsed, python_files

FILE_LINES = 300
FUNCTION_LINES = 70


def test_files_stay_short():
    long = [f"{name_of(p)}: {n} lines" for p in python_files(*PACKAGES, *OTHERS) if (n := len(p.read_text().splitlines())) >= FILE_LINES]
    assert not long, f"under {FILE_LINES} lines a file:\n" + "\n".join(long)


def test_functions_stay_short():
    long = []
    for path in python_files(*PACKAGES, *OTHERS):
        for node in ast.walk(parsed(path)):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                lines = node.end_lineno - node.lineno + 1
                if lines >= FUNCTION_LINES:
                    long.append(f"{name_of(path)}:{node.lineno} {node.name}: {lines} lines")
    assert not long, f"under {FUNCTION_LINES} lines a function:\n" + "\n".join(long)


def test_every_file_says_first_what_it_is():
    bare = []
    for path in python_files(*PACKAGES, *OTHERS):
        text = path.read_text()
        if text.count("\n") > 12 and not text.startswith(("#", '"""')):
            bare.append(name_of(path))
    assert not bare, "begin with a comment that says what the file holds:\n" + "\n".join(bare)


def test_a_contract_stands_at_each_class_of_the_core():
    bare = []
    for path in core_files():
        lines = path.read_text().splitlines()
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.ClassDef) and not node.name.endswith("Error"):
                above = lines[node.lineno - 2].strip() if node.lineno > 1 else ""
                below = lines[node.lineno].strip() if node.lineno < len(lines) else ""
                if not above.startswith("#") and not below.startswith("#"):
                    bare.append(f"{name_of(path)}:{node.lineno} class {node.name}")
    assert not bare, "a comment that says what it holds, who writes it and what it does when full:\n" + "\n".join(bare)
