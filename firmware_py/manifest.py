# What is frozen into the flash of a board: the core and the core's half of the
# protocol. MicroPython's build reads this file; a core never imports it.
#
# File by file, so that the same sources give the same image on any machine. A
# file of firmware_py that stands in neither list is an error of `host_tools flash`.

# ruff: noqa: F821  (MicroPython's build brings `package`)

# Asserts and line numbers are left out: each would cost flash, and a core under a locked heap has no traceback.
OPT = 3
ROOT = ".."

# What a board with a filesystem gets (host_tools/board_files.py) beside what is frozen, less what names the stm32.
BOARD = ("main_board.py", "ports/machine.py", "ports/pins.py")

# What only a computer runs, and this file; and what the emulated part has no use for.
LEFT_OUT = ("__main__.py", "main.py", "main_can.py", "manifest.py", "ports/host.py", "ports/unix.py") + BOARD

package("protocol", (
    "__init__.py", "can_cutter.py", "can_joiner.py", "codec.py", "codec_fields.py", "codec_viper.py", "cobs.py", "crc32.py",
    "crc32_tables.py", "crc32_viper.py", "frame_reader.py", "link.py", "map_code.py",
    "parameters.py", "range_code.py", "range_code_viper.py", "schema_text.py", "tables.py",
), base_path=ROOT, opt=OPT)
package("firmware_py", (
    "__init__.py", "device.py", "fixed.py", "identity.py", "inventory.py", "limits.py", "main_stm32.py", "parameters.py",
    "pipeline.py", "record.py", "tables.py", "telemetry.py",
    "building/__init__.py", "building/builder.py", "building/closure.py", "building/corners.py", "building/frontier.py",
    "building/gates.py", "building/line_fit.py", "building/outline.py", "building/partition.py", "building/passage.py", "building/rings.py",
    "building/room.py", "building/sight.py", "building/tidy.py", "building/topology.py", "building/way.py", "building/walls.py",
    "collection/bumper.py", "collection/__init__.py", "collection/explorer.py", "collection/follower.py", "collection/infrared.py",
    "collection/ekf.py", "collection/infrared_curve.py", "collection/ir_state.py", "collection/landmarks.py",
    "collection/localization.py",
    "collection/manhattan.py", "collection/motion.py", "collection/odometry.py", "collection/search.py", "collection/rolling.py",
    "collection/relocation.py", "collection/sensor_watch.py",
    "collection/shadowing.py", "collection/two_fixes.py", "collection/turning_points.py",
    "collection/traveller.py", "collection/states.py", "collection/uwb.py", "collection/wall_end.py",
    "storage/barrier_list.py", "storage/__init__.py", "storage/breadcrumbs.py", "storage/frame.py", "storage/hit_ring.py",
    "storage/map_image.py", "storage/point_ring.py", "storage/region_graph.py", "storage/slots.py", "storage/tally.py",
    "storage/vector_store.py",
    "ports/__init__.py", "ports/frontier_viper.py", "ports/rolling_viper.py", "ports/sight_viper.py",
    "ports/slcan.py", "ports/stm32.py", "ports/stm32_registers.py",
), base_path=ROOT, opt=OPT)
