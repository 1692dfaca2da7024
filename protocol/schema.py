# THE messages, declared once. The core, the host, the documentation and the
# generators of the tests are all made from this table.
#
#   (id, name, direction, reliable, fields)      direction: DOWN host -> core, UP core -> host
#                                                reliable: may be a question, or the answer to one, that is repeated until it has come
#   field: (name, type, unit)
#     u8 i8 u16 i16 u32 i32   little-endian; a value of magnitude >= 2**30 is rejected
#     p10                     eight unsigned 10-bit values in 10 bytes, least significant bit first
#     cN                      N bytes, each a value of its own (text, NUL-padded)
#     *                       last field only: a group of fields repeated to the end of the body
#                             (unit = the group's fields); decoded as a count, then the items
#
# HELLO, WELCOME, IDENTIFY and IDENTITY keep their ids and layouts for ever.

VERSION = 1
BODY_MAX = 96
VALUES_MAX = 96  # ints that the largest message decodes to

DOWN = 0
UP = 1

MESSAGES = (
    # 00-0F link
    (0x01, "HELLO", UP, 0, (
        ("protocol_min", "u8", ""), ("protocol_max", "u8", ""),
        ("schema_lo", "u16", ""), ("schema_hi", "u16", ""),
        ("firmware_lo", "u16", ""), ("firmware_hi", "u16", ""),
        ("boot_id", "u16", ""), ("reset_cause", "u8", ""),
        ("body_max", "u8", "B"), ("window_down", "u8", "frame"), ("window_up", "u8", "frame"),
        ("capabilities", "u16", ""), ("stores", "u8", ""), ("parameters", "u8", ""),
        ("heap_bytes", "u32", "B"), ("heap_used_bytes", "u32", "B"), ("heap_code_bytes", "u32", "B"))),
    (0x02, "WELCOME", DOWN, 0, (
        ("epoch", "u8", ""), ("boot_id", "u16", ""), ("schema_lo", "u16", ""), ("schema_hi", "u16", ""))),
    (0x03, "IDENTIFY", DOWN, 0, (("section", "u8", ""), ("offset", "u16", "B"))),
    (0x04, "IDENTITY", UP, 0, (
        ("section", "u8", ""), ("offset", "u16", "B"), ("size", "u16", "B"), ("data", "*", (("byte", "u8", ""),)))),
    (0x05, "PING", DOWN, 0, (("token", "u16", ""),)),
    (0x06, "PONG", UP, 0, (("token", "u16", ""), ("t_ms", "u32", "ms"))),
    (0x07, "ERROR", UP, 1, (("code", "u8", ""), ("message_id", "u8", ""), ("detail", "i32", ""))),
    (0x08, "ACK", UP, 0, (("missing", "u8", ""),)),   # with the nak bit: a question is missing, this SEQ
    # 10-1F step
    (0x10, "STEP", DOWN, 1, (
        ("step", "u32", "tick"), ("left", "i16", "pulse"), ("right", "i16", "pulse"),
        ("ir", "p10", "count"), ("ultrasonic_mm", "u16", "mm"), ("bump", "u8", "bits"),
        ("uwb", "*", (("anchor", "u8", ""), ("strength_cdb", "i16", "cdB"), ("range_mm", "u16", "mm"))))),
    (0x11, "STEP_RSP", UP, 1, (
        ("step", "u32", "tick"), ("left_mm_s", "i16", "mm/s"), ("right_mm_s", "i16", "mm/s"),
        ("state", "u8", ""), ("ir_state", "u8", ""), ("hash16", "u16", ""))),
    (0x12, "STATUS", DOWN, 1, (("flags", "u8", ""),)),
    (0x13, "STATUS_RSP", UP, 1, (
        ("step", "u32", "tick"), ("state", "u8", ""), ("finished", "u8", ""), ("reason", "u8", ""),
        ("degraded", "u16", "bits"), ("steps_lo", "u16", ""), ("steps_hi", "u16", ""),
        ("map_lo", "u16", ""), ("map_hi", "u16", ""),
        ("closure_before_mm", "u16", "mm"), ("closure_after_mm", "u16", "mm"),
        ("bumps", "u16", ""), ("path_mm", "u32", "mm"),
        ("heap_bytes", "u32", "B"), ("heap_used_bytes", "u32", "B"),
        ("heap_locked", "u8", ""), ("allocated_after_boot_bytes", "u32", "B"),
        ("late_ticks", "u16", "tick"), ("late_ms", "u16", "ms"))),  # free run: how many, and the latest of them
    # 20-2F telemetry: unreliable, newest wins
    (0x20, "POSE", UP, 0, (
        ("step", "u32", "tick"), ("x_um", "i32", "um"), ("y_um", "i32", "um"), ("heading_bam", "u16", "BAM"),
        ("odometry_x_um", "i32", "um"), ("odometry_y_um", "i32", "um"), ("odometry_heading_bam", "u16", "BAM"),
        ("state", "u8", ""), ("ir_state", "u8", ""), ("path_mm", "u32", "mm"),
        ("points", "u16", ""), ("vectors", "u16", ""), ("fixes", "u16", ""), ("bumps", "u16", ""))),
    (0x21, "STORE", UP, 0, (
        ("index", "u8", ""), ("name", "c12", ""), ("used", "u16", ""), ("capacity", "u16", ""),
        ("record_bytes", "u16", "B"), ("lost", "u16", ""))),
    (0x22, "VECTOR", UP, 0, (
        ("index", "u16", ""), ("chain", "u8", ""), ("kind", "u8", ""),
        ("x", "i16", "5 mm"), ("y", "i16", "5 mm"), ("x_end", "i16", "5 mm"), ("y_end", "i16", "5 mm"),
        ("sigma_mm", "u8", "mm"))),
    (0x23, "POINT", UP, 0, (
        ("order", "u16", ""), ("kind", "u8", ""), ("x", "i16", "5 mm"), ("y", "i16", "5 mm"), ("heading_bam", "u16", "BAM"))),
    (0x24, "LINK", UP, 0, (
        ("frames_in", "u32", ""), ("bytes_in", "u32", "B"), ("frames_out", "u32", ""), ("bytes_out", "u32", "B"),
        ("duplicates", "u16", ""), ("telemetry_dropped", "u16", ""),
        ("bad_cobs", "u16", ""), ("bad_crc", "u16", ""), ("bad_length", "u16", ""), ("bad_header", "u16", ""),
        ("bad_id", "u16", ""), ("bad_value", "u16", ""), ("overrun", "u16", ""))),
    (0x25, "MEMORY", UP, 0, (
        ("heap_bytes", "u32", "B"), ("heap_used_bytes", "u32", "B"), ("heap_locked", "u8", ""),
        ("allocated_after_boot_bytes", "u32", "B"))),
    # 30-3F map
    (0x30, "MAP_INFO", DOWN, 1, (("flags", "u8", ""),)),
    (0x31, "MAP_INFO_RSP", UP, 1, (
        ("generation", "u16", ""), ("size", "u32", "B"), ("crc_lo", "u16", ""), ("crc_hi", "u16", ""))),
    (0x32, "MAP_READ", DOWN, 1, (("generation", "u16", ""), ("offset", "u32", "B"))),
    (0x33, "MAP_DATA", UP, 1, (
        ("generation", "u16", ""), ("offset", "u32", "B"), ("data", "*", (("byte", "u8", ""),)))),
    (0x34, "NVM_DONE", DOWN, 1, (("request", "u16", ""), ("status", "u8", ""), ("data", "*", (("byte", "u8", ""),)))),
    (0x35, "NVM", UP, 1, (
        ("request", "u16", ""), ("operation", "u8", ""), ("kept", "u8", "bits"), ("address", "u32", "B"), ("size", "u16", "B"),
        ("data", "*", (("byte", "u8", ""),)))),
    # 50-5F parameters: (parameter, index) names one integer; the table is parameters.py
    (0x50, "PARAM_SET", DOWN, 1, (("parameter", "u8", ""), ("index", "u8", ""), ("value", "i32", ""))),
    (0x51, "PARAM_GET", DOWN, 1, (("parameter", "u8", ""), ("index", "u8", ""))),
    (0x52, "PARAM_LIST", DOWN, 1, (("parameter", "u8", ""),)),
    (0x53, "PARAM_VALUE", UP, 1, (
        ("parameter", "u8", ""), ("index", "u8", ""), ("status", "u8", ""), ("value", "i32", ""))),
    (0x54, "PARAM_INFO", UP, 1, (
        ("parameter", "u8", ""), ("count", "u8", ""), ("minimum", "i32", ""), ("maximum", "i32", ""),
        ("default", "i32", ""), ("unit", "c8", ""), ("name", "c24", ""))),
)

# Fields of which 0, an empty text or no item says as good as nothing. Where one of them is not known at the other end, it is read as
# that, and whoever does not know it sends that: so they may come and go without an update of both ends (translation.py).
OPTIONAL = (
    "STEP.ultrasonic_mm", "STEP.bump", "STEP.uwb", "STEP_RSP.ir_state", "STATUS.flags", "MAP_INFO.flags",
    "STATUS_RSP.degraded", "STATUS_RSP.closure_before_mm", "STATUS_RSP.closure_after_mm", "STATUS_RSP.bumps", "STATUS_RSP.path_mm",
    "STATUS_RSP.heap_bytes", "STATUS_RSP.heap_used_bytes", "STATUS_RSP.heap_locked", "STATUS_RSP.allocated_after_boot_bytes",
    "STATUS_RSP.late_ticks", "STATUS_RSP.late_ms",
    "POSE.odometry_x_um", "POSE.odometry_y_um", "POSE.odometry_heading_bam", "POSE.ir_state", "POSE.path_mm",
    "POSE.points", "POSE.vectors", "POSE.fixes", "POSE.bumps",
    "STORE.record_bytes", "STORE.lost", "VECTOR.chain", "VECTOR.kind", "VECTOR.sigma_mm", "POINT.kind", "POINT.heading_bam",
) + tuple("LINK." + field[0] for row in MESSAGES if row[1] == "LINK" for field in row[4])

# ERROR.code
ERROR_UNKNOWN_ID = 1
ERROR_STEP_ORDER = 2    # detail: the step number expected next
ERROR_RANGE = 3
ERROR_STALE = 4         # MAP_READ of another generation; detail: today's generation
ERROR_NOT_READY = 5     # MAP_INFO while the core is about to build the map: ask again; detail 0

# STATUS.flags
STATUS_BRIEF = 1        # no CRC of the map: the core need not code it for the answer, which takes as long as many steps

# NVM.operation: what the core wants of the non-volatile memory
NVM_NOTHING = 0
NVM_READ = 1
NVM_ERASE = 2           # the unit that begins at this address: all its bytes are 255 then
NVM_PROGRAM = 3         # bytes that are erased

NVM_UNIT = 1024         # bytes erased at once
NVM_PIECE = 64          # bytes read or programmed at once, at most

# NVM.kept: what became of what the memory keeps, bit by bit
NVM_KEPT = 1            # a record is in force: it was loaded, or written since
NVM_EXPLORED = 2        # it is that of a home that is explored
NVM_DAMAGED = 4         # a slot was passed over: neither whole nor empty
NVM_FOREIGN = 8         # a slot was passed over: another firmware's, or of a larger one
NVM_TOO_SMALL = 16      # the last record did not fit: not kept
NVM_FAILED = 32         # the memory refused an operation: given up

# PARAM_VALUE.status
PARAM_OK = 0
PARAM_UNKNOWN = 1
PARAM_OUT_OF_RANGE = 2  # the old value stays, and is in the answer
PARAM_LOCKED = 3        # the mission has begun
