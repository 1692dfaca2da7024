"""`host_tools flash --target mpremote:DEVICE`: the core's files onto a board, verified there, and the core started."""

import sys
from pathlib import Path

from host_tools.board import Board, BoardError
from host_tools.board_files import LIB, PACKAGES, compiled
from host_tools.budget import grouped
from protocol.host_link import HostLink

MAIN = "/main.py"
MARK = "# TVSLAM: written by host_tools flash, which replaces it.\n"
START = "from firmware_py.main_board import main\n\nmain()\n"


def run(device, main_path=None, start=True):
    """The exit code: 0 done, 2 for what is wrong with the arguments, no board at the port among it, 3 for the board."""
    try:
        main = (MARK + (Path(main_path).read_text(encoding="utf-8") if main_path else START)).encode()
    except (OSError, UnicodeDecodeError) as error:
        print("flash: --main %s cannot be read (%s); give a file of Python." % (
            main_path, (getattr(error, "strerror", None) or str(error)).lower()), file=sys.stderr)
        return 2
    try:
        with Board(device) as board:
            print("board   %s" % board.machine, flush=True)
            wanted = compiled(board.mpy)
            if start:
                wanted[MAIN] = main
            install(board, wanted, say=lambda text: print(text, flush=True))
            if start:
                _report(device, board.restart())
    except BoardError as error:
        print("flash: %s: %s" % (device, error), file=sys.stderr)
        return error.code
    return 0


def install(board, wanted, say):
    """Make the board's files `wanted`: what is right stays, what is not is written, what is stale goes; then all is verified."""
    there, folders = board.files(*(LIB + package for package in PACKAGES), MAIN)
    folders |= board.folders("/") & {LIB.rstrip("/")}
    _check_ours(board, there, wanted)
    right = {path for path, (_, digest) in there.items() if path in wanted and board.holds(path, digest, wanted[path])}
    if right != set(wanted):
        right.discard(MAIN)  # broken off, half a core must not start: it goes first and comes back last
    stale = sorted(path for path in there if path not in wanted and path != MAIN)
    to_write = sorted((path for path in wanted if path not in right), key=lambda path: (path == MAIN, path))
    _check_space(board, there, wanted, stale, to_write)
    if MAIN in to_write and MAIN in there:
        board.remove(MAIN)
    for path in stale:
        board.remove(path)
    _make_folders(board, folders, wanted)
    for path in to_write:
        board.write(path, wanted[path])
        say("copied  %-44s %7s B" % (path, grouped(len(wanted[path]))))
    _verify(board, wanted)
    say("files   %d copied, %d were there, %d stale ones removed; %d verified on the board, %s B" % (
        len(to_write), len(right), len(stale), len(wanted), grouped(sum(map(len, wanted.values())))))


def _check_ours(board, there, wanted):
    """What others put there is not replaced without being asked."""
    ours = any(path.startswith(LIB + PACKAGES[0] + "/") for path in there)
    others = [package for package in PACKAGES[1:] if any(path.startswith(LIB + package + "/") for path in there)]
    if others and not ours:
        raise BoardError("%s%s on it is another project's; remove it there first." % (LIB, others[0]))
    if MAIN in wanted and MAIN in there and not board.read(MAIN).startswith(MARK.encode()):
        raise BoardError("it has a %s of its own; rename that, or leave it with --no-start." % MAIN)


def _check_space(board, there, wanted, stale, to_write):
    freed = sum(there[path][0] for path in {*stale, *to_write} if path in there)
    needed, free = sum(len(wanted[path]) for path in to_write), board.free_bytes()
    if needed > free + freed:
        raise BoardError("its flash is full: %s B are needed, %s B are free; remove files of yours from it, or take a board with more." % (
            grouped(needed), grouped(free + freed)))


def _make_folders(board, there, wanted):
    needed = {str(parent) for path in wanted for parent in Path(path).parents} - {"/"}
    for folder in sorted(needed - there):
        board.make_folder(folder)
    for folder in sorted(there - needed - {LIB.rstrip("/")}, reverse=True):
        board.remove_folder(folder)


def _verify(board, wanted):
    there, _ = board.files(*wanted)
    wrong = [path for path, content in wanted.items() if path not in there or not board.holds(path, there[path][1], content)]
    if wrong:
        raise BoardError("%d of the files are not there as they were sent (%s); repeat the command, and if it stays so, the flash is "
                         "worn out." % (len(wrong), ", ".join(wrong[:3])))


def _report(device, hello):
    refusal = HostLink().refusal(hello)
    if refusal:
        raise BoardError("the core that answers there cannot be worked with: %s." % refusal)
    print("core    runs; heap %s B, %s B of it used, %s B of that its code" % (
        grouped(hello.heap_bytes), grouped(hello.heap_used_bytes), grouped(hello.heap_code_bytes)))
    print("now     host_tools hil HOME --target port:%s" % device)
