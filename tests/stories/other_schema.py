# Versions of the product that speak another schema: a copy of the sources, changed in a few places and made consistent again as a
# developer would, by `python -m protocol.describe`. Each version: {file: [(what stands there, what shall)]}.

import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("protocol", "firmware_py", "sim_device")
SCHEMA, PARAMETERS, TELEMETRY = "protocol/schema.py", "protocol/parameters.py", "firmware_py/telemetry.py"
DEVICE = "firmware_py/device.py"

LIDAR = '    (0x26, "LIDAR", UP, 0, (("range_mm", "u16", "mm"), ("x", "i16", "5 mm"), ("state", "u8", ""))),\n'
TELL_LIDAR = """        self._device.send(POSE)
        out[0] = 512
        out[1] = -40
        out[2] = core.state
        self._device.send(LIDAR)"""
BEGIN_POSE = """        out = self._device.link.out
        out[0] = step
"""
MEMORY = """    (0x25, "MEMORY", UP, 0, (
        ("heap_bytes", "u32", "B"), ("heap_used_bytes", "u32", "B"), ("heap_locked", "u8", ""),
        ("allocated_after_boot_bytes", "u32", "B"))),
"""
NVM = """    (0x34, "NVM_DONE", DOWN, 1, (("request", "u16", ""), ("status", "u8", ""), ("data", "*", (("byte", "u8", ""),)))),
    (0x35, "NVM", UP, 1, (
        ("request", "u16", ""), ("operation", "u8", ""), ("kept", "u8", "bits"), ("address", "u32", "B"), ("size", "u16", "B"),
        ("data", "*", (("byte", "u8", ""),)))),
"""
NVM_BYTES = """    ("nvm_bytes", "B", 1, 0, 1048576, 0),          # non-volatile memory at the robot's end; 0: none, and nothing is kept
"""
ANSWER_NVM = """        elif message_id == NVM_DONE:
            self.send(NVM, self.core.slots.exchange(self.link.values, self.link.out))
"""
# Where a value of POSE goes, and by what its line is known; in an order in which no line is met twice.
PLACES = ((13, 14, "core.explorer"), (12, 13, "here.fixes"), (11, 12, "core.vectors"), (10, 11, "core.points"), (9, 10, "o.path"),
          (8, 9, "core.ir"), (7, 8, "core.state"), (6, 7, "o.heading"), (5, 6, "o.y"), (4, 5, "o.x"), (3, 4, "here.heading"),
          (2, 0, "here.y"), (1, 3, "here.x"))

VERSIONS = {
    # A field more at the end of POSE, without which one can do.
    "longer": {
        SCHEMA: [("OPTIONAL = (", 'OPTIONAL = ("POSE.battery_mv",'),
                 ('("fixes", "u16", ""), ("bumps", "u16", "")', '("fixes", "u16", ""), ("bumps", "u16", ""), ("battery_mv", "u16", "mV")')],
        TELEMETRY: [("        self._device.send(POSE)", "        out[14] = 7300\n        self._device.send(POSE)")]},
    # POSE with another field in its middle, and its first ones in another order; a telemetry message that nobody knows.
    "reordered": {
        SCHEMA: [('("step", "u32", "tick"), ("x_um", "i32", "um"), ("y_um", "i32", "um"),',
                  '("y_um", "i32", "um"), ("step", "u32", "tick"), ("spare", "i8", ""), ("x_um", "i32", "um"),'),
                 ("    # 30-3F map", LIDAR + "    # 30-3F map")],
        TELEMETRY: [(BEGIN_POSE, BEGIN_POSE.replace("[0]", "[1]") + "        out[2] = -3\n"),
                    *(("        out[%d] = %s" % (at, what), "        out[%d] = %s" % (to, what)) for at, to, what in PLACES),
                    ("        self._device.send(POSE)", TELL_LIDAR), ("import POSE,", "import LIDAR, POSE,")]},
    # Wider types, and a narrower one that holds what it is given.
    "wider": {
        SCHEMA: [('("points", "u16", ""), ("vectors", "u16", "")', '("points", "u32", ""), ("vectors", "i32", "")'),
                 ('("bumps", "u16", ""), ("path_mm", "u32", "mm"),', '("bumps", "u32", ""), ("path_mm", "u32", "mm"),'),
                 ('("left_mm_s", "i16", "mm/s")', '("left_mm_s", "i32", "mm/s")'),
                 ('("left", "i16", "pulse"), ("right", "i16", "pulse")', '("left", "i8", "pulse"), ("right", "i32", "pulse")')]},
    # Messages under other ids, and one that is no more.
    "moved": {
        SCHEMA: [('(0x10, "STEP"', '(0x1E, "STEP"'), ('(0x11, "STEP_RSP"', '(0x1F, "STEP_RSP"'), ('(0x22, "VECTOR"', '(0x27, "VECTOR"'),
                 (MEMORY, "")],
        TELEMETRY: [("LINK, MEMORY", "LINK"), ("self._device.send_memory(MEMORY)", "pass")]},
    # A parameter before all others: the core numbers them anew.
    "renumbered": {PARAMETERS: [('    ("dock_x",', '    ("battery", "mV", 1, 0, 20000, 7400),\n    ("dock_x",')]},
    # From before there was a non-volatile memory.
    "forgetful": {SCHEMA: [(NVM, "")], PARAMETERS: [(NVM_BYTES, "")], DEVICE: [("NVM, NVM_DONE, ", ""), (ANSWER_NVM, "")]},
    # A field that has no place any more, without which nobody drives.
    "without": {SCHEMA: [('("left_mm_s", "i16", "mm/s")', '("left_um_s", "i16", "um/s")')]},
}


def version(name, folder):
    """The folder to run that version from."""
    for package in PACKAGES:
        shutil.copytree(ROOT / package, folder / package, ignore=shutil.ignore_patterns("__pycache__"))
    (folder / "docs").mkdir()
    shutil.copy(ROOT / "docs" / "protocol.md", folder / "docs")
    for path, edits in VERSIONS[name].items():
        text = (folder / path).read_text()
        for old, new in edits:
            assert text.count(old) == 1, (path, old)
            text = text.replace(old, new)
        (folder / path).write_text(text)
    subprocess.run([sys.executable, "-m", "protocol.describe"], cwd=folder, check=True, capture_output=True)
    return folder
