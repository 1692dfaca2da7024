"""The core itself, linked: no name in it is another's, and the real MicroPython VM gives the hashes and answers of the files on CPython."""

import ast
import builtins
import subprocess
import symtable

from host_tools import stm32_core
from host_tools.linker import link
from tests.firmware_py.core_run import REPLAY, hashes_here, hashes_of
from tests.firmware_py.device_story import Story
from tests.house.tree import PROJECT
from tests.strategies import Segment

HEAP = ("-X", "heapsize=4m")  # to compile all of it there; the image has it compiled
SEGMENTS = [Segment("wander", 600, 4), Segment("along_a_wall", 300, 5), Segment("extremes", 100, 6)]
# As device_story.MemoryPort, whose answers it has to give: HELLO and the figures of memory are the port's.
DRIVER = """
import sys
from firmware_py.device import Device


class Port:
    def __init__(self, out):
        self.out = out
        self.heap_bytes, self.heap_code_bytes, self.heap_boot_bytes, self.locked = 196608, 40000, 60000, 1

    def write(self, buf, size):
        self.out.write(bytes(buf[:size]))

    def heap_used(self):
        return 60000

    def ticks_ms(self):
        return 1000


def main(heard, said):
    out = open(said, "wb")
    device = Device(Port(out), 77)
    device.hello()
    data = bytearray(open(heard, "rb").read())
    device.receive(data, len(data))
    out.close()


main(sys.argv[1], sys.argv[2])
"""


def frozen():
    files = stm32_core.core_files(PROJECT)
    return {name: files[name].decode() for name in stm32_core.modules(files)}


def linked_script(folder, path, source):
    """A script that uses the core, and the core, as one file."""
    script = folder / "linked.py"
    script.write_text(link({**frozen(), path: source}, path).source)
    return str(script)


def scopes(table):
    for inner in table.get_children():
        yield inner
        yield from scopes(inner)


def test_no_name_of_the_linked_core_is_lost_or_captured():
    source = stm32_core.linked(stm32_core.core_files(PROJECT)).source
    top = symtable.symtable(source, "tvslam.py", "exec")
    there = {name.get_name() for name in top.get_symbols() if name.is_assigned() or name.is_imported()}
    emitted = {node.name for node in ast.walk(ast.parse(source)) if isinstance(node, ast.FunctionDef) and node.decorator_list}
    functions = [scope for scope in scopes(top) if scope.get_type() == "function" and scope.get_name() not in emitted]
    names = [(scope.get_name(), name) for scope in functions for name in scope.get_symbols()]
    assert len(functions) > 100
    lost = [(where, name.get_name()) for where, name in names if name.is_global() and name.get_name() not in there | set(dir(builtins))]
    assert not lost
    # A variable called as something at the top may be right; that there is none shows that none is wrong.
    assert not [(where, name.get_name()) for where, name in names if name.is_local() and name.get_name() in there]


def test_the_linked_core_steps_with_the_same_hashes(micropython, tmp_path):
    script = linked_script(tmp_path, REPLAY, (PROJECT / REPLAY).read_text())
    there, last = hashes_of([micropython, *HEAP], tmp_path, [], SEGMENTS, script)
    assert last == "ticks 1000 allocated 0"
    assert there == hashes_here([], SEGMENTS)


def test_the_linked_core_gives_the_same_answers(micropython, tmp_path):
    story = Told()
    for name, *fields in (("IDENTIFY", 1, 0), ("IDENTIFY", 2, 3), ("PING", 5), ("PARAM_LIST", 4), ("PARAM_GET", 3, 0),
                          ("PARAM_SET", 3, 0, 70000), ("PARAM_SET", 99, 0, 1), ("STATUS", 0), ("MAP_INFO", 0), ("MAP_READ", 0, 0)):
        story.ask(name, *fields)
    for step in range(40):
        story.step(step)
    story.step(39)  # once more: the answer that it kept
    story.step(99)  # out of order
    story.ask("STATUS", 0)
    (tmp_path / "heard").write_bytes(story.given)
    script = linked_script(tmp_path, "driver.py", DRIVER)
    subprocess.run([micropython, *HEAP, script, tmp_path / "heard", tmp_path / "said"], check=True, timeout=60)
    assert (tmp_path / "said").read_bytes() == story.said and len(story.said) > 2000


# A Story that keeps all the bytes of both directions.
class Told(Story):
    def __init__(self):
        self.given, self.said = b"", b""
        super().__init__()

    def give(self, data):
        self.given += bytes(data)
        super().give(data)

    def heard(self):
        self.said += bytes(self.port.out)
        return super().heard()
