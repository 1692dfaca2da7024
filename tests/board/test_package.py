# package.json, from which mip installs the core's sources: it lists what a board needs, and a board runs from it.

import contextlib
import io
import subprocess
import sys

from host_tools.board import Board
from host_tools.board_files import package_json, sources
from tests.board.unix_board import UnixBoard


def test_it_is_not_stale(project):
    assert (project / "package.json").read_text() == package_json(), "run python -m host_tools.board_files"


def test_it_lists_what_the_core_imports(project):
    names = sources()
    assert {"firmware_py/main_board.py", "firmware_py/ports/machine.py", "protocol/link.py"} <= set(names)
    assert not [name for name in names if "stm32" in name or "unix" in name or "host" in name]
    assert all((project / name).is_file() for name in names)


def test_mip_installs_it_and_the_core_starts_from_it(project, micropython, tmp_path):
    with UnixBoard(micropython, tmp_path, heap="700k") as board:
        done = subprocess.run([sys.executable, "-m", "mpremote", "connect", board.device, "resume", "mip", "install", "./package.json"],
                              cwd=project, capture_output=True, text=True, timeout=100)
        assert done.returncode == 0, done.stdout + done.stderr
        with Board(board.device) as there:
            files, _ = there.files("/lib/firmware_py", "/lib/protocol")
            assert set(files) == {"/lib/" + name for name in sources()}
            assert all(there.holds(path, digest, (project / path[5:]).read_bytes()) for path, (_, digest) in files.items())
            there.write("/main.py", b"from firmware_py.main_board import main\nmain()\n")
            with contextlib.redirect_stdout(io.StringIO()):
                assert there.restart().heap_bytes > 600000
