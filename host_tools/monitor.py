"""`host_tools monitor PORT`: watch a mission live on the tap of the virtual robot.

On a terminal it is a full-screen view (monitor_app.py); with --plain, or where
the output is a pipe, one line a second. It listens only: of all it could say it
writes IDENTIFY alone.
"""

import argparse
import sys
import time

from host_tools.monitor_foreign import plain_lines
from host_tools.monitor_rows import plain_line, store_rows, summary
from host_tools.monitor_session import EXIT_OK, MonitorSession, WatchEnded, end_of_mission
from host_tools.processes import signals_as_interrupt
from host_tools.terminal_port import PortError, TerminalPort

READ_EVERY_S = 0.01     # a pty holds 4 KB, a mission at 100 times real time passes 300 KB/s
EXIT_USAGE = 2


def positive(text):
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < 1e6:
        raise argparse.ArgumentTypeError("%s is not a number above 0" % text)
    return value


def add_arguments(parser):
    parser.add_argument("port", metavar="PORT", help="the tap: a pty such as out/tap; waited for if it does not exist yet")
    parser.add_argument("--plain", action="store_true", help="one line a second instead of a full screen, for pipes")
    parser.add_argument("--rate", type=positive, default=10.0, metavar="HZ", help="screen updates a second (default 10)")
    parser.add_argument("--seconds", type=positive, default=None, metavar="N", help="stop after N seconds, exit 0")
    parser.add_argument("--wait", type=positive, default=60.0, metavar="N",
                        help="wait at most N seconds for the port, and for its first frame (default 60)")


def run(args):
    try:
        with signals_as_interrupt(), TerminalPort.wait(args.port, args.wait, say) as port:
            session = MonitorSession(port, args.wait)
            if args.plain or not sys.stdout.isatty():
                return watch_plain(session, args.seconds)
            return watch_screen(session, args)
    except PortError as error:
        say("monitor: %s" % error)
        return EXIT_USAGE
    except WatchEnded as end:
        print(end.sentence, file=sys.stdout if end.code == EXIT_OK else sys.stderr, flush=True)
        return end.code
    except KeyboardInterrupt:
        say("Stopped.")
        return EXIT_OK


def say(sentence):
    print(sentence, file=sys.stderr, flush=True)


def watch_screen(session, args):
    from host_tools.monitor_app import MonitorApp  # textual takes 0.3 s to import: pipes do without

    app = MonitorApp(session, rate_hz=args.rate, seconds=args.seconds)
    app.run()
    end = app.end
    if end is None:
        end = WatchEnded("Left at: %s." % summary(session.state), EXIT_OK)
    raise end


def watch_plain(session, seconds, clock=time.monotonic, sleep=time.sleep, out=None):
    """A line a second until the mission ends or `seconds` are over."""
    out = out or sys.stdout
    start = shown = clock()
    told = False
    print("Watching %s." % session.port.path, file=out, flush=True)
    while True:
        session.pump()
        now = clock()
        over = seconds is not None and now - start >= seconds
        finished = session.state.ended and (session.closed_after_end or session.quiet_s() > 1.0)
        if now - shown >= 1.0 or over or finished:
            shown = now
            if session.link.translation is not None and not told:
                told = True
                print("On %s %s." % (session.port.path, session.link.translation.summary()), file=out)
            print("\n".join([session.waiting_for() or plain_line(session.state), *plain_lines(session.link)]), file=out, flush=True)
        if finished or over:
            for name, text, _ in store_rows(session.state):
                print("  %-12s %s" % (name, text), file=out, flush=True)
            if not finished:
                print("Stopped after %g s: %s." % (seconds, summary(session.state)), file=out, flush=True)
                return EXIT_OK
            raise end_of_mission(session.state)
        sleep(READ_EVERY_S)
