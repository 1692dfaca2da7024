"""`host_tools SUBCOMMAND`: each subcommand is a module, imported only when it is asked for.

A module offers `add_arguments(parser)` and `run(args) -> exit code`.
Exit codes: 0 done, 1 the mission did not finish, 2 bad arguments, 3 a peer failed.
"""

import argparse
import importlib
import sys

from host_tools import __version__
from host_tools.progress import hush, say

SUBCOMMANDS = {
    # name: (module, help)
    "hil": ("host_tools.hil", "run one mission: virtual robot + core, scored against the home's truth"),
    "evaluate": ("host_tools.evaluate", "the paper's figures and tables again, with ours beside them"),
    "replay": ("host_tools.replay", "run a recorded mission again on any target, and compare each answer with the log"),
    "bisect": ("host_tools.bisect", "run a recorded mission on several targets at once: the first step and field that differ"),
    "export": ("host_tools.log_export", "a recorded mission for other tools: CSV, candump text, MCAP"),
    "monitor": ("host_tools.monitor", "watch a running core on a port or a tap"),
    "budget": ("host_tools.budget", "what each store and buffer of the core costs, byte by byte"),
    "param": ("host_tools.param", "list, read or set the core's parameters"),
    "flash": ("host_tools.flash", "build the firmware image with the core in its flash, and check it"),
    "homes": ("host_tools.homes", "list, check or draw homes"),
    "robot-drawing": ("host_tools.robot_drawing", "draw the sensor mounting from the robot's configuration"),
}


class _Parser(argparse.ArgumentParser):
    def error(self, message):
        """One sentence with the way out instead of the whole usage text."""
        self.exit(2, "%s: %s; see %s --help\n" % (self.prog, message, self.prog))


def main(argv=None):
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="replace")  # a terminal that cannot show a map's picture gets the table
    code = 0
    try:
        code = _run(argv)
        sys.stdout.flush()
    except KeyboardInterrupt:
        say("host_tools: interrupted", sys.stderr)
        code = 130
    except BrokenPipeError:
        hush(sys.stdout)  # the reader of our output (head, less) has gone: not an error
    return code


def _run(argv):
    argv = sys.argv[1:] if argv is None else list(argv)
    parser = _Parser(prog="host_tools", description="Tools for people around the TVSLAM core.", allow_abbrev=False)
    parser.add_argument("--version", action="version", version="host_tools " + __version__)
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", parser_class=_Parser)
    chosen = next((word for word in argv if not word.startswith("-")), None)
    module = None
    for name, (module_name, text) in SUBCOMMANDS.items():
        command = commands.add_parser(name, help=text, description=text, allow_abbrev=False)
        if name == chosen:
            module = importlib.import_module(module_name)
            module.add_arguments(command)
    args, unknown = parser.parse_known_args(argv)
    if unknown:
        (commands.choices[args.command] if args.command else parser).error("unrecognized arguments: " + " ".join(unknown))
    if module is None:
        parser.print_help()
        return 2
    return module.run(args)
