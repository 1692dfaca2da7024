"""What `host_tools export` writes. Each is a context: add(record, message) until its end, then the file is whole."""

import contextlib
import csv
import json
import os

from host_tools.differences import as_json
from host_tools.hil_options import UsageError
from host_tools.whole_file import whole_file
from protocol.can_cutter import CanCutter
from protocol.host_link import stuff


class _Writer(contextlib.ExitStack):
    def _file(self, path, **how):
        """To be written beside, and put in its place at the end."""
        return self.enter_context(open(self.enter_context(whole_file(path)), **how))


# NAME.csv of each kind that comes: time, epoch and number of the frame, then the fields in the schema's order and units. The eight
# infrared readings are columns of their own; a group is a cell of JSON, bytes are one of hexadecimal digits.
class CsvWriter(_Writer):
    def __init__(self, folder, kinds):
        super().__init__()
        self._folder = folder
        self._tables = {}
        try:
            os.makedirs(folder, exist_ok=True)
        except OSError as error:
            raise UsageError("--csv %s is no folder to write to (%s); give another name" % (
                folder, (error.strerror or str(error)).lower())) from None
        for kind in kinds:  # a table of another log must not pass for one of this
            with contextlib.suppress(FileNotFoundError):
                os.unlink(self._path(kind.NAME))

    def _path(self, name):
        return os.path.join(self._folder, name + ".csv")

    def add(self, record, message):
        table = self._tables.get(message.NAME)
        if table is None:
            table = self._tables[message.NAME] = csv.writer(self._file(self._path(message.NAME), mode="w", encoding="utf-8", newline=""))
            table.writerow(["t_s", "epoch", "seq", *_columns(message)])
        table.writerow(["%.6f" % (record.t_us / 1e6), record.frame[0] >> 5 & 3, record.frame[1], *_cells(message)])


def _columns(message):
    for name, kind, _ in message.FIELDS:
        yield from ("%s_%d" % (name, i) for i in range(8)) if kind == "p10" else (name,)


def _cells(message):
    for value, (_, kind, _) in zip(message, message.FIELDS):
        if kind == "p10":
            yield from value
        elif isinstance(value, bytes):
            yield value.hex()
        elif kind == "*":
            yield json.dumps([item._asdict() for item in value])
        else:
            yield value


# The frames as they are, or would be, on a CAN bus.
class CandumpWriter(_Writer):
    def __init__(self, path, fd):
        super().__init__()
        self._out = self._file(path, mode="w", encoding="ascii")
        self._cutters = [CanCutter(way, int(fd)) for way in (0, 1)]
        self._form = "(%.6f) can0 %03X##1%s\n" if fd else "(%.6f) can0 %03X#%s\n"

    def add(self, record, message):
        wire = b"\0" + stuff(record.frame) + b"\0"
        cutter = self._cutters[record.direction]
        cutter.begin(wire, len(wire))
        while cutter.next():
            self._out.write(self._form % (record.t_us / 1e6, cutter.can_id, bytes(cutter.data[:cutter.size]).hex().upper()))


# A channel for each kind of message, JSON in it, with a JSON schema that names the units.
class McapWriter(_Writer):
    def __init__(self, path, kinds, notes):
        super().__init__()
        try:
            from mcap.writer import CompressionType, Writer
        except ImportError:
            raise UsageError("--mcap needs the package mcap; pip install 'tvslam[mcap]' gets it") from None
        self._mcap = Writer(self._file(path, mode="wb"), compression=CompressionType.NONE)
        self._mcap.start(library="tvslam")
        self.callback(self._mcap.finish)
        self._mcap.add_metadata("tvslam", notes)
        self._channels = {}
        for kind in kinds:
            told = self._mcap.register_schema(kind.NAME, "jsonschema", json.dumps(_json_schema(kind)).encode())
            topic = "/%s/%s" % (("down", "up")[kind.DIRECTION], kind.NAME.lower())
            self._channels[kind.NAME] = self._mcap.register_channel(topic, "json", told)

    def add(self, record, message):
        self._mcap.add_message(self._channels[message.NAME], log_time=record.t_us * 1000, publish_time=record.t_us * 1000,
                               sequence=record.frame[1], data=json.dumps(as_json(message)).encode())


def _json_schema(kind):
    fields = {}
    for name, type_, unit in kind.FIELDS:
        plain = "array" if type_ in ("p10", "*") else "string" if type_[0] == "c" else "integer"
        fields[name] = {"type": plain, "description": unit if isinstance(unit, str) else ""}
    return {"title": kind.NAME, "type": "object", "properties": fields}
