"""A mission from its log of raw frames and the virtual robot's truth file."""

import os

import numpy as np

from host_tools.mission import MissionBuilder
from protocol.dialect import SchemaError
from protocol.log import LogError as _HeadError
from protocol.log import LogReader
from protocol.messages import BY_ID, MessageError
from protocol.translation import of_log

CHUNK_BYTES = 1 << 20
TRUTH = np.dtype([("step", "<u4"), ("x_m", "<f8"), ("y_m", "<f8"), ("heading_rad", "<f8")])

WANTED = frozenset((
    "STEP", "STEP_RSP", "HELLO", "STATUS_RSP", "POSE", "POINT", "STORE", "LINK", "MAP_INFO_RSP", "MAP_DATA", "PARAM_SET", "PARAM_VALUE"))


class LogError(Exception):
    """One sentence: there is no mission to read."""


def read_mission(log_path, truth_path, *rest):
    """`rest`: files in which the log goes on, where they exist."""
    builder = MissionBuilder()
    reader = LogReader()
    kinds = None
    for record in _records(reader, [log_path, *filter(os.path.exists, rest)], builder):
        if kinds is None:
            kinds = _kinds(reader.told, builder)
        _take(builder, kinds, record)
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


def _kinds(told, builder):
    """{id: what unpacks it} of what is wanted, as the log has it; the parameters' numbers are its own, too."""
    try:
        translation = of_log(told)
    except SchemaError as error:
        raise LogError("The log cannot be read: its schema is none (%s)." % error) from None
    if translation is None:
        return {number: kind for number, kind in BY_ID.items() if kind.NAME in WANTED}
    builder.parameter_names, builder.names = tuple(row[0] for row in translation.theirs.parameters), translation.names
    return translation.readable(WANTED)


def _records(reader, paths, builder):
    path = paths[0]
    try:
        for path in paths:
            with open(path, "rb") as file:
                while chunk := file.read(CHUNK_BYTES):
                    yield from reader.feed(chunk)
    except FileNotFoundError:
        raise LogError("There is no log of a mission to score: it ended before its first frame.") from None
    except OSError as error:
        raise LogError("The log %s cannot be read (%s)." % (path, (error.strerror or str(error)).lower())) from None
    except _HeadError as error:
        raise LogError("The log %s cannot be read: %s." % (path, error)) from None
    if reader.told is None:
        raise LogError("There is no log of a mission to score: it ended before its first frame.")
    builder.damaged = reader.damage


def _take(builder, kinds, record):
    try:
        message = record.message(kinds)
    except MessageError:
        return  # its CRC is right, so it is of another schema: a log must not bring its reader down
    if message is None:
        return
    if message.NAME == "STEP":
        builder.step(record.t_us, message.step, message.left, message.right, message.ir, message.uwb)
    elif message.NAME == "STEP_RSP":
        builder.answer(record.t_us, message.step, message.state)
    else:
        builder.add(message.NAME, message._asdict())
