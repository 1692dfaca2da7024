"""`host_tools export LOG`: a recorded log for other tools: CSV, candump text, MCAP.

Exit code 0 when what is sound of the log was written, 2 on bad arguments, a file that is no log or a full disk.
"""

import contextlib
import os
import sys

from host_tools.hil_options import UsageError, check_file
from host_tools.log_writers import CandumpWriter, CsvWriter, McapWriter
from host_tools.processes import signals_as_interrupt
from protocol.dialect import CODES, SchemaError, dialect_of
from protocol.log import LogError, LogReader
from protocol.messages import MessageError
from protocol.schema_hash import canonical

CHUNK_BYTES = 1 << 20


def add_arguments(parser):
    parser.add_argument("log", metavar="LOG", help="a log that `hil --log` has written, over whatever link")
    parser.add_argument("--csv", metavar="DIR", help="a table NAME.csv of each kind of message")
    parser.add_argument("--candump", metavar="FILE", help="as CAN frames, as `candump -L` keeps them: for `cantools decode`")
    parser.add_argument("--fd", action="store_true", help="--candump as CAN FD")
    parser.add_argument("--mcap", metavar="FILE", help="as MCAP with JSON in it: for Foxglove and its like (pip install 'tvslam[mcap]')")


def run(args):
    try:
        with signals_as_interrupt(), contextlib.ExitStack() as stack:
            reader = LogReader()
            records = _records(args.log, reader)
            first = next(records, None)     # the head is there, or it is no log
            dialect = _dialect(args.log, reader.told)
            writers = [stack.enter_context(writer) for writer in _writers(args, reader.told, dialect)]
            written, strange = _copy(first, records, dialect.by_id, writers)
    except (UsageError, LogError) as error:
        print("export: %s" % error, file=sys.stderr)
        return 2
    except OSError as error:
        why = (error.strerror or str(error)).lower()
        print("export: %s could not be written: %s" % (error.filename or "the file", why), file=sys.stderr)
        return 2
    print("exported        %d messages of %s" % (written, args.log))
    if strange:
        print("export: %d frames of the log are no messages of its own schema; they were left out" % strange, file=sys.stderr)
    if reader.damage:
        print("export: the log %s; what is sound was exported" % reader.damage, file=sys.stderr)
    return 0


def _records(path, reader):
    try:
        with open(path, "rb") as file:
            while chunk := file.read(CHUNK_BYTES):
                yield from reader.feed(chunk)
    except OSError as error:
        raise LogError("the log %s cannot be read: %s" % (path, (error.strerror or str(error)).lower())) from None
    except LogError as error:
        raise LogError("the log %s cannot be exported: %s" % (path, error)) from None
    if reader.told is None:
        raise LogError("the log %s cannot be exported: it ends within its head" % path)


def _dialect(path, told):
    """The log's own schema, which need not be today's."""
    try:
        return dialect_of(told)
    except SchemaError as error:
        raise LogError("the log %s cannot be exported: the schema in its head is not understood (%s)" % (path, error)) from None


def _writers(args, told, dialect):
    kinds = dialect.by_id.values()
    wanted = [(name, path) for name, path in (("--csv", args.csv), ("--candump", args.candump), ("--mcap", args.mcap)) if path]
    if not wanted:
        raise UsageError("nothing to write; give --csv DIR, --candump FILE or --mcap FILE")
    if args.fd and not args.candump:
        raise UsageError("--fd is how --candump writes its frames; give --candump FILE, too")
    taken = {os.path.realpath(args.log): "the log"}
    for name, path in wanted:
        other = taken.setdefault(os.path.realpath(path), "that of " + name)
        if other != "that of " + name:
            raise UsageError("%s %s is %s, which would be overwritten; give another name" % (name, path, other))
        if name != "--csv":
            check_file(name, path)
    if args.candump:
        if canonical(dialect.messages) != canonical():
            raise UsageError("--candump: the log was written with another schema than this program's, and its CAN frames "
                             "would be other ones; use the version that wrote it")
        yield CandumpWriter(args.candump, args.fd)
    if args.csv:
        yield CsvWriter(args.csv, kinds)
    if args.mcap:
        notes = {key: str(value) for key, value in told.items() if key not in ("messages", "parameters", "optional", *CODES)}
        yield McapWriter(args.mcap, kinds, notes)


def _copy(first, records, kinds, writers):
    """(messages written, frames that are none)"""
    written = strange = 0
    while first is not None:
        try:
            message = first.message(kinds)
        except MessageError:
            message = None
        if message is None:
            strange += 1
        else:
            written += 1
            for writer in writers:
                writer.add(first, message)
        first = next(records, None)
    return written, strange
