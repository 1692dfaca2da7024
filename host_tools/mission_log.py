"""A mission from its log of raw frames and the virtual robot's truth file."""

from array import array

import numpy as np

from host_tools.message_fields import IDS, named
from host_tools.mission import MissionBuilder
from protocol.codec import decode_into
from protocol.log import LogError as _HeadError
from protocol.log import LogReader
from protocol.schema import VALUES_MAX

CHUNK_BYTES = 1 << 20
HEADER_BYTES = 5  # CTL SEQ ACK ID LEN
TRUTH = np.dtype([("step", "<u4"), ("x_m", "<f8"), ("y_m", "<f8"), ("heading_rad", "<f8")])

STEP, STEP_RSP = IDS["STEP"], IDS["STEP_RSP"]
STEP_UWB = 13  # place of the count of UWB records in a decoded STEP
WANTED = frozenset(IDS[name] for name in (
    "HELLO", "STATUS_RSP", "POSE", "POINT", "STORE", "LINK", "MAP_INFO_RSP", "MAP_DATA", "PARAM_SET", "PARAM_VALUE"))


class LogError(Exception):
    """One sentence: there is no mission to read."""


def read_mission(log_path, truth_path):
    builder = MissionBuilder()
    for frame in _frames(log_path, builder):
        _take(builder, frame)
    return builder.build(read_truth(truth_path))


def read_truth(path):
    """(n, 4) step, x_m, y_m, heading_rad; a record that its writer did not finish is left out."""
    try:
        with open(path, "rb") as file:
            data = file.read()
    except OSError:
        return np.zeros((0, 4))
    rows = np.frombuffer(data, TRUTH, len(data) // TRUTH.itemsize)
    return np.column_stack([rows[name].astype(float) for name in TRUTH.names])


def _frames(path, builder):
    reader = LogReader()
    try:
        with open(path, "rb") as file:
            while chunk := file.read(CHUNK_BYTES):
                for record in reader.feed(chunk):
                    yield record.frame
    except FileNotFoundError:
        raise LogError("There is no log of a mission to score: it ended before its first frame.") from None
    except OSError as error:
        raise LogError("The log %s cannot be read (%s)." % (path, (error.strerror or str(error)).lower())) from None
    except _HeadError as error:
        raise LogError("The log %s cannot be read: %s." % (path, error)) from None
    if reader.told is None:
        raise LogError("There is no log of a mission to score: it ended before its first frame.")
    if reader.damaged:
        builder.damaged = "%d damaged places, %d records lost" % (reader.damaged, reader.lost)


_VALUES = array("i", bytes(4 * VALUES_MAX))


def _take(builder, frame):
    if len(frame) < HEADER_BYTES:
        return
    message_id = frame[3]
    if message_id != STEP and message_id != STEP_RSP and message_id not in WANTED:
        return
    v = _VALUES
    if decode_into(message_id, frame, HEADER_BYTES, HEADER_BYTES + frame[4], v) < 0:
        return
    if message_id == STEP:
        count = v[STEP_UWB]
        at = STEP_UWB + 1
        builder.step(v[0], v[1], v[2], [tuple(v[at + 3 * i:at + 3 * i + 3]) for i in range(count)] if count else None)
    elif message_id == STEP_RSP:
        builder.answer(v[0], v[3])
    else:
        builder.add(*named(message_id, v))
