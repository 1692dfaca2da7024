"""The monitor's full screen: a map on the left, everything else in rows on the right.

Only layout, keys and timers are here; what the rows say is monitor_rows.py, and
how a watch ends is monitor_session.py. A finished mission stays on the screen
until q, so that its map can be looked at.
"""

import asyncio
import signal
import time

from rich.text import Text
from textual.app import App
from textual.binding import Binding
from textual.containers import Horizontal, VerticalScroll
from textual.widgets import Footer, Static

from host_tools import monitor_foreign
from host_tools import monitor_rows as rows
from host_tools.monitor_session import EXIT_OK, WatchEnded, end_of_mission

PUMP_EVERY_S = 0.01     # a pty holds 4 KB: read it more often than the screen is drawn
ZOOMS = (1.0, 2.0, 4.0, 8.0)
SIDE_COLUMNS = 50
LABEL_COLUMNS = 12

_MOODS = {"": "", "good": "green", "warn": "yellow", "bad": "bold red", "dim": "dim"}
_KINDS = {"blank": "", "wall": "bold", "path": "cyan", "robot": "bold green", "anchor": "magenta",
          "beam": "yellow", "body": "bold"}


class MonitorApp(App):
    ENABLE_COMMAND_PALETTE = False
    CSS = """
    #map { width: 1fr; height: 1fr; }
    #side { width: %d; height: 1fr; border-left: solid $primary; padding: 0 1; }
    #status { height: 1; background: $boost; padding: 0 1; }
    """ % (SIDE_COLUMNS + 5)
    BINDINGS = [
        Binding("q", "leave", "quit"),
        Binding("p", "pause", "pause"),
        Binding("m", "zoom", "map zoom"),
        Binding("s", "side", "side on/off"),
        Binding("down", "roll(3)", "scroll", key_display="↑↓"),
        Binding("up", "roll(-3)", show=False),
        Binding("pagedown", "roll(15)", show=False),
        Binding("pageup", "roll(-15)", show=False),
        Binding("ctrl+c", "leave", "quit", show=False),
    ]

    def __init__(self, session, rate_hz=10.0, seconds=None, clock=time.monotonic):
        super().__init__()
        self.session = session
        self.end = None
        self.paused = False
        self.zoom = 0
        self._map, self._rows, self._status = Static(id="map"), Static(id="rows"), Static(id="status")
        self._rate_hz = rate_hz
        self._seconds = seconds
        self._clock = clock
        self._start = clock()
        self._speed = (clock(), 0, 0.0)     # when, robot steps then, robot seconds a second

    def compose(self):
        with Horizontal():
            yield self._map
            with VerticalScroll(id="side", can_focus=False):  # the keys are ours, and stand in the footer
                yield self._rows
        yield self._status
        yield Footer()

    def on_mount(self):
        for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):   # as q; an exception would come out of textual's midst
            asyncio.get_running_loop().add_signal_handler(number, self.action_leave)
        self.set_interval(PUMP_EVERY_S, self._pump)
        self.set_interval(1 / self._rate_hz, self.draw)
        self.draw()

    def action_leave(self):
        if self.session.state.ended:
            self.end = end_of_mission(self.session.state)
        self.exit()

    def action_pause(self):
        """The picture stands still; what comes is still taken in, so that nothing is missed."""
        self.paused = not self.paused
        self.draw(force=True)

    def action_zoom(self):
        self.zoom = (self.zoom + 1) % len(ZOOMS)
        self.draw(force=True)

    def action_side(self):
        """In a narrow terminal the map needs the whole width."""
        side = self.query_one("#side")
        side.display = not side.display
        self.call_after_refresh(self.draw, force=True)

    def action_roll(self, lines):
        """The rows are more than a usual terminal is high."""
        self.query_one("#side").scroll_relative(y=lines, animate=False)

    def _pump(self):
        try:
            self.session.pump()
        except WatchEnded as end:
            self.end = end
            self.exit()
            return
        if self._seconds is not None and self._clock() - self._start >= self._seconds:
            self.end = end_of_mission(self.session.state) if self.session.state.ended else WatchEnded(
                "Stopped after %g s: %s." % (self._seconds, rows.summary(self.session.state)), EXIT_OK)
            self.exit()

    def draw(self, force=False):
        if not self.is_running or not self._map.is_attached or (self.paused and not force):
            return      # a last tick of the timer may come when the screen is already gone
        state = self.session.state
        area = self._map
        if area.size.width > 2 and area.size.height > 2:
            area.update(picture_text(rows.map_picture(state, area.size.width, area.size.height, ZOOMS[self.zoom])))
        link = self.session.link
        self._rows.update(side_text(state, link.counts(), monitor_foreign.sections(link)))
        self._status.update(self._status_text())

    def _status_text(self):
        state = self.session.state
        if state.ended:
            return Text("Press q. The mission ended: %s." % rows.summary(state), style="bold")
        waiting = self.session.waiting_for()
        text = waiting or "%s at %.0f times real time" % (self.session.port.path, self._measure_speed())
        zoom = "  zoom x%d" % ZOOMS[self.zoom] if self.zoom else ""
        return Text(text + zoom + ("  PAUSED" if self.paused else ""), style="yellow" if waiting else "")

    def _measure_speed(self):
        when, steps, speed = self._speed
        now = self._clock()
        if now - when >= 1.0:
            speed = max(0.0, (self.session.state.robot_s - steps) / (now - when))
            self._speed = (now, self.session.state.robot_s, speed)
        return speed


def side_text(state, tap, more=()):
    """All rows under their headings, with the robot's beams between them; `more` is what the core says beyond them."""
    text = Text()
    for title, part in (
        ("MISSION", rows.mission_rows(state)), ("INFRARED", None), ("STORES", rows.store_rows(state, 6)),
        ("MEMORY", rows.memory_rows(state, 12)), ("LINK", rows.link_rows(state, tap)), *more,
    ):
        text.append(title + "\n", style="bold underline")
        if part is None:
            _append_beside(text, rows.infrared_picture(state), rows.infrared_rows(state))
        else:
            for row in part:
                _append_row(text, row)
    return text


def _append_row(text, row):
    label, value, mood = row
    text.append(label[:LABEL_COLUMNS].ljust(LABEL_COLUMNS) + " ", style="dim")
    text.append(value + "\n", style=_MOODS[mood])


def _append_beside(text, picture, table):
    """The beams on the left, the readings on the right: one screen's height less."""
    for i in range(max(len(picture), len(table))):
        if i < len(picture):
            for run, kind in picture[i]:
                text.append(run, style=_KINDS[kind])
        else:
            text.append(" " * sum(len(run) for run, _ in picture[0]))
        if i < len(table):
            label, value, mood = table[i]
            text.append(" " + label.ljust(8) + " ", style="dim")
            text.append(value, style=_MOODS[mood])
        text.append("\n")


def picture_text(picture):
    text = Text(no_wrap=True)
    for line in picture:
        for run, kind in line:
            text.append(run, style=_KINDS[kind])
        text.append("\n")
    return text
