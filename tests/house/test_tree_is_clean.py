# What must not be in a clone: this machine's paths, its registries, its leftovers.

import re
import subprocess
from configparser import ConfigParser
from pathlib import Path

from tests.house.tree import PROJECT

TEXT = {".py", ".md", ".toml", ".txt", ".json", ".yml", ".yaml", ".cfg", ".sh", ""}
PIP_FILES = ("/etc/pip.conf", "~/.config/pip/pip.conf", "~/.pip/pip.conf", "~/.pydistutils.cfg")
PLAIN_PARENTS = {Path("/"), Path("/tmp"), Path("/home"), Path("/root"), Path("/opt"), Path("/usr"), Path("/srv")}


def files():
    listed = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=PROJECT, capture_output=True, text=True)
    if listed.returncode == 0:
        return [p for line in listed.stdout.splitlines() if (p := PROJECT / line).is_file()]
    hidden = {".venv", ".git", "out", "build", "__pycache__"}
    return [p for p in PROJECT.rglob("*") if p.is_file() and not hidden & set(p.relative_to(PROJECT).parts)]


def lines():
    for path in files():
        if path.suffix in TEXT:
            for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), 1):
                yield f"{path.relative_to(PROJECT)}:{number}", line


def test_no_path_of_this_machine():
    roots = {str(PROJECT)}
    if PROJECT.parent not in PLAIN_PARENTS:
        roots.add(str(PROJECT.parent) + "/")
    pattern = re.compile(r"(?<![\w./-])(" + "|".join(re.escape(r) for r in sorted(roots)) + r"|/(?:home|Users)/\w+/)")
    found = [f"{where}: {line.strip()}" for where, line in lines() if pattern.search(line) and "tests/house/" not in where]
    assert not found, "\n" + "\n".join(found)


def test_no_registry_host():
    hosts = set()
    for name in PIP_FILES:
        parser = ConfigParser(strict=False, interpolation=None)
        parser.read(Path(name).expanduser())
        for section in parser.sections():
            hosts.update(re.findall(r"https?://(?:[^@/\s]*@)?([^/:\s]+)", " ".join(parser[section].values())))
    found = [f"{where}: {line.strip()}" for where, line in lines() if any(host in line for host in hosts)]
    assert not found, "\n" + "\n".join(found)


def test_what_sets_the_project_up_names_no_address():
    for name in ("constraints.txt", "Makefile", ".ci/run", "pyproject.toml"):
        assert "://" not in (PROJECT / name).read_text(), name


def test_constraints_pin_every_dependency():
    lines_of = (PROJECT / "constraints.txt").read_text().splitlines()
    pinned = {line.split("==")[0].lower().replace("_", "-") for line in lines_of if "==" in line}
    declared = re.findall(r'"([A-Za-z][\w-]*)>=', (PROJECT / "pyproject.toml").read_text())
    missing = {name.lower().replace("_", "-") for name in declared} - pinned - {"setuptools"}
    assert declared and not missing, missing
