"""`host_tools param list | get NAME[.INDEX] | set NAME[.INDEX] VALUE`: the core's parameters.

Names, units, ranges and defaults come from the core itself (PARAM_INFO), not
from this program's table: a newer core's parameters are there too. What a core
of its own is told is gone when it ends; a core on port:DEVICE keeps it until
its mission begins and locks it.
"""

import argparse
import difflib
import sys

from host_tools import core_process
from host_tools.core_process import CoreError
from host_tools.core_session import CoreSession
from protocol import schema
from protocol.messages import BY_NAME

EXIT_OK = 0
EXIT_USAGE = 2
INT_LIMIT = 2 ** 30     # larger ones do not pass the wire


class ParamError(Exception):
    """One sentence on what the user asked for."""


def add_arguments(parser):
    core_process.add_arguments(parser)
    parser.set_defaults(action=None)
    actions = parser.add_subparsers(dest="action", metavar="list|get|set", parser_class=type(parser))
    every = actions.add_parser("list", help="a table of all: unit, range, default, value")
    get = actions.add_parser("get", help="one parameter, all its values if it is an array")
    get.add_argument("name", metavar="NAME[.INDEX]")
    put = actions.add_parser("set", help="set one value")
    put.add_argument("name", metavar="NAME[.INDEX]")
    put.add_argument("value", metavar="VALUE", type=whole)
    for action in (every, get, put):
        core_process.add_arguments(action, again=True)


def whole(text):
    try:
        return int(text, 0)
    except ValueError:
        raise argparse.ArgumentTypeError("'%s' is not a whole number: parameters are integers" % text) from None


def run(args):
    if args.action is None:
        print("param: say what to do: list, get NAME[.INDEX], or set NAME[.INDEX] VALUE.", file=sys.stderr)
        return EXIT_USAGE
    try:
        with core_process.running_core(args.target, args.heap, args.link) as port:
            core = CoreSession(port)
            core.handshake()
            parameters = Parameters(core)
            if args.action == "list":
                print("\n".join(parameters.table()))
            elif args.action == "get":
                print("\n".join(parameters.get(*split_name(args.name))))
            else:
                print(parameters.set(*split_name(args.name), args.value))
                if not args.target.startswith("port:"):
                    print("This core was started for the test alone and ends now: for a mission, set it in the robot's "
                          "configuration, or on a core at port:DEVICE.")
    except ParamError as error:
        print("param: %s" % error, file=sys.stderr)
        return EXIT_USAGE
    except CoreError as error:
        print("param: %s" % error, file=sys.stderr)
        return error.code
    return EXIT_OK


def split_name(text):
    """'ir_bearing.3' -> ('ir_bearing', 3); without index -> None."""
    name, dot, index = text.partition(".")
    if not dot:
        return name, None
    if not index.isdigit():
        raise ParamError("'%s' does not name a value: after the dot comes a number, as in ir_bearing.0." % text)
    return name, int(index)


class Parameters:
    """Contract: `core` answers ask(request, answer, fits); nothing is cached but the core's own table."""

    def __init__(self, core):
        self._core = core
        self.infos = []
        for parameter in range(core.hello.parameters):
            info = core.ask(BY_NAME["PARAM_LIST"](parameter), "PARAM_INFO",
                            lambda got, want=parameter: got.parameter == want)
            if info is None:
                raise CoreError("The core has %d parameters by its HELLO, but does not describe number %d." % (
                    core.hello.parameters, parameter))
            self.infos.append(info)

    def table(self):
        rows = [("parameter", "unit", "range", "default", "value")]
        for info in self.infos:
            count = info.count
            rows.append((info.name + ("[%d]" % count if count > 1 else ""), info.unit,
                         "%d to %d" % (info.minimum, info.maximum), str(info.default),
                         shorten([self._read(info, i) for i in range(count)])))
        widths = [max(len(row[i]) for row in rows) for i in range(4)]
        return ["  ".join([row[0].ljust(widths[0]), row[1].ljust(widths[1]), row[2].rjust(widths[2]),
                           row[3].rjust(widths[3]), row[4]]) for row in rows]

    def get(self, name, index=None):
        info = self._find(name)
        chosen = range(info.count) if index is None else [self._index(info, index)]
        return [label(info, i) + " = %d" % self._read(info, i) + unit(info) for i in chosen]

    def set(self, name, index, value):
        info = self._find(name)
        if index is None and info.count > 1:
            raise ParamError("%s holds %d values: name one, %s.0 to %s.%d." % (
                name, info.count, name, name, info.count - 1))
        index = self._index(info, index or 0)
        before = self._read(info, index)
        if not -INT_LIMIT < value < INT_LIMIT:
            raise ParamError(out_of_range(info, index, value, before))
        answer = self._value(BY_NAME["PARAM_SET"](info.parameter, index, value), info, index)
        status = answer.status
        if status == schema.PARAM_OUT_OF_RANGE:
            raise ParamError(out_of_range(info, index, value, answer.value))
        if status == schema.PARAM_LOCKED:
            raise ParamError("%s cannot be set any more: the mission has begun and its parameters are locked; restart the "
                             "core and set it before the first step." % label(info, index))
        if status != schema.PARAM_OK or answer.value != value:
            raise ParamError("The core did not take %s = %d (status %d, value %d)." % (
                label(info, index), value, status, answer.value))
        return "%s = %d%s (was %d)" % (label(info, index), value, unit(info), before)

    def _find(self, name):
        for info in self.infos:
            if info.name == name:
                return info
        near = difflib.get_close_matches(name, [info.name for info in self.infos], 1)
        raise ParamError("The core has no parameter '%s'%s; `host_tools param list` shows all %d." % (
            name, ": did you mean %s?" % near[0] if near else "", len(self.infos)))

    def _index(self, info, index):
        if index >= info.count:
            raise ParamError("%s has no value number %d: it holds %s." % (
                info.name, index, "one, number 0" if info.count == 1 else "numbers 0 to %d" % (info.count - 1)))
        return index

    def _read(self, info, index):
        answer = self._value(BY_NAME["PARAM_GET"](info.parameter, index), info, index)
        if answer.status == schema.PARAM_UNKNOWN:
            raise CoreError("The core lists %s, but answers that it does not know it." % label(info, index))
        return answer.value

    def _value(self, request, info, index):
        answer = self._core.ask(request, "PARAM_VALUE", lambda got: (
            got.parameter == info.parameter and got.index == index))
        if answer is None:
            raise CoreError("The core answers %s of %s with an ERROR." % (request.NAME, label(info, index)))
        return answer


def label(info, index):
    return "%s.%d" % (info.name, index) if info.count > 1 else info.name


def unit(info):
    return " " + info.unit if info.unit else ""


def out_of_range(info, index, value, stays):
    return "%s takes %d to %d%s: %d was refused and %d stays." % (
        label(info, index), info.minimum, info.maximum, unit(info), value, stays)


def shorten(values):
    """An array in a table's cell: all of a short one, one word for equal ones, the start of a long one."""
    if len(values) > 1 and len(set(values)) == 1:
        return "%d, all %d" % (values[0], len(values))
    if len(values) <= 8:
        return " ".join(map(str, values))
    return " ".join(map(str, values[:6])) + " ... %d values" % len(values)
