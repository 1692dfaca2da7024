# One mission: the virtual robot and a core, in lockstep or each by its own clock, from HELLO to the map.

import contextlib
import time
from array import array

from protocol import parameters, schema, states
from protocol.dialect import name_of, names_of_bits
from protocol.messages import BY_NAME
from sim_device.free_run import TICK_MS, FreeRun
from sim_device.last_place import LastPlace
from sim_device.links.map_pull import MapPull
from sim_device.links.peer import DEAD_S, Peer
from sim_device.links.peer_errors import Interrupted, PeerError, Restarted
from sim_device.storage import Storage

STEP_S = 0.02
PROGRESS_S = 0.25
HEALTH_STEPS = 500      # 10 s of robot time; then the core is asked what it thinks of itself
ENDED = (states.DONE, states.FAILED)
FIRST_STEP = 1
_STATE = 3              # in a STEP_RSP

_POSE, _MEMORY, _LINK, _STORE = (BY_NAME[name] for name in ("POSE", "MEMORY", "LINK", "STORE"))
_IDENTIFY, _STORES_SECTION, _LINK_SECTION = BY_NAME["IDENTIFY"], 2, 3
_PARAM_SET, _PARAM_VALUE = BY_NAME["PARAM_SET"], BY_NAME["PARAM_VALUE"]
_STATUS, _STATUS_RSP = BY_NAME["STATUS"], BY_NAME["STATUS_RSP"]
_PLACES = {row[0]: i for i, row in enumerate(parameters.PARAMETERS)}  # in the order of this table they are told
_PARAM_STATUS = {
    schema.PARAM_UNKNOWN: "it does not know it", schema.PARAM_OUT_OF_RANGE: "the value is out of range",
    schema.PARAM_LOCKED: "its mission has begun already, start the core anew",
}


# Owns nothing that must be closed: pty, taps and files are the caller's. run()
# returns the end event (a dict) of a mission that came to an end of its own, by
# the time limit or by stop(); it raises PeerError where the core failed. What
# was learnt until then is in summary(). `stop` counts requests to end: the first ends the
# mission, the second also what is asked afterwards. `truth` gets the true pose of every step.
# A core that starts anew goes on where the robot stands: with what it finds in `nvm` (an Nvm; None: there is none), else its
# mission begins anew.
class Session:
    def __init__(self, pty, taps, robot, report, log=None, truth=None, settings=None,
                 realtime=False, max_robot_s=14400.0, stop=lambda: 0, nvm=None):
        self.robot = robot
        self.peer = Peer(pty, taps, log, self._stops)
        self.step = 0
        self.now = FIRST_STEP - 1   # the step being asked
        self.restarts = 0
        self.wall_s = 0.0
        self.state = states.BOOT
        self.status = None
        self.map_bytes = None
        self.storage = Storage(nvm)
        self._pull = MapPull()
        self._taps = taps
        self._report = report
        self._truth = truth
        self._settings = {**(settings or {}), **({"tick_ms": [TICK_MS]} if realtime else {})}
        self._realtime = realtime
        self._place = LastPlace(robot.parameters())
        self._degraded = set()
        self._free = None
        self._ticks_max = int(max_robot_s / STEP_S)
        self._stop = stop
        self._heed = True

    def run(self, wait_s):
        try:
            return self.summary(self._run(wait_s))
        finally:
            self.peer.keep()

    def _run(self, wait_s):
        hello = None
        while True:
            why = self._lead(hello, wait_s)
            self._heed = False  # what is asked from here on is short, and a second signal ends it
            try:
                if self.peer.hello is not None:
                    self._collect(why != "interrupted")
                return why
            except Interrupted:
                return "interrupted"
            except Restarted as again:
                if why == "interrupted":
                    return why
                hello = again.hello

    def _lead(self, hello, wait_s):
        """The mission; `hello` is that of a core which has started anew after its end."""
        self._heed = True
        try:
            if hello is None:
                self._start(self.peer.meet(wait_s))
            else:
                self._start_again(hello)
                if self.storage.loaded is None:
                    raise PeerError("the core on %s has started anew before its map was read, and had not stored it: start the mission "
                                    "again" % self.peer.path)
            return self._mission()
        except Interrupted:
            return "interrupted"

    def _start(self, hello, told=None):
        """Tells the core what it must know: at first, and again each time it has started anew."""
        while True:
            try:
                self._set_parameters(told or {})
                self.storage.begin(self.peer)
                if self._realtime:
                    self._free = FreeRun(self.peer, self.robot, self._ask_health, self._free)
                    self._free.join()
                break
            except Restarted as again:
                hello = self._join_again(again.hello)
        if self.peer.link.translation is not None:
            self._report.event("schema", text=self.peer.link.translation.summary())
        self._report.event("start", hello=hello._asdict(), parameters=len(self.robot.parameters()),
                           storage=self.storage.sentences(self.restarts > 0))

    def _start_again(self, hello):
        self._start(self._join_again(hello), self._place.dock())

    def _join_again(self, hello):
        self.restarts += 1
        self._report.event("restart", step=self.now)
        return self.peer.begin(hello)

    def _ask(self, values):
        """The answer to this STEP, from whichever core is there by then."""
        self.now = values[0]
        while True:
            try:
                answer = (self._free or self.peer).step(values)
                if answer[_STATE] == states.SAVE:
                    self.storage.serve(self.peer)
                if self._free is None:
                    self._ask_health()
                return answer
            except Restarted as again:
                self._start_again(again.hello)

    def _ask_health(self):
        """Now and then, where the core has nothing else to do: whoever watches sees it, and what is new of it is told."""
        if self.now % HEALTH_STEPS:
            return
        said = names_of_bits(self.peer.link.names["degraded"], self.peer.ask(_STATUS(schema.STATUS_BRIEF), _STATUS_RSP).degraded)
        new = [name for name in said if name not in self._degraded]
        if new:
            self._degraded.update(new)
            self._report.event("degraded", step=self.now, names=new, text="The core says at step %d that it is degraded: %s." % (
                self.now, ", ".join(new)))

    def summary(self, reason):
        """The end event's fields. `finished` is what the core says of itself, once its map is built, too."""
        peer, robot, status = self.peer, self.robot, self.status
        if not reason:
            code = states.REASON_NONE if status is None else status.reason
            reason = name_of(peer.link.names["reasons"], code, "reason")
        robot_s = self.step * STEP_S
        return {
            "finished": bool(status is not None and status.finished and status.state in ENDED), "reason": reason, "state": self._state_name,
            "steps": self.step, "robot_s": round(robot_s, 2), "wall_s": round(self.wall_s, 3),
            "real_time_factor": round(robot_s / self.wall_s, 1) if self.wall_s else None,
            "path_m": round(robot.path_m, 3), "contacts": robot.contacts,
            "frames": peer.frames, "bytes": peer.bytes, "dropped": peer.dropped_by_cause, "resent": peer.repeats,
            "core_resent": None if _LINK not in peer.newest else peer.newest[_LINK].duplicates, "restarts": self.restarts,
            "tap_dropped": self._taps.dropped, "free_run": self._free and self._free.figures(), "storage": self.storage.figures(),
            "status": None if status is None else status._asdict(),
            "stores": {name: store._asdict() for name, store in peer.stores.items()},
            "map_bytes": None if self.map_bytes is None else len(self.map_bytes),
        }

    @property
    def _state_name(self):
        return name_of(self.peer.link.names["states"], self.state, "state")

    def _set_parameters(self, dock):
        link = self.peer.link
        told = {**self.robot.parameters(), **self._settings, **self.storage.parameters(link), **dock}
        number_of = link.parameter
        rows = [(number, name, index, value) for name, values in sorted(told.items(), key=lambda item: _PLACES[item[0]])
                for index, value in enumerate(values) if (number := number_of(name, index, value)) is not None]
        answers = self.peer.ask_all([
            (_PARAM_SET(number, index, value), _PARAM_VALUE, lambda m, place=(number, index): (m.parameter, m.index) == place)
            for number, _, index, value in rows])
        for (_, name, index, value), answer in zip(rows, answers, strict=True):
            if answer.status != schema.PARAM_OK or answer.value != value:
                why = _PARAM_STATUS.get(answer.status, "it keeps %d" % answer.value)
                raise PeerError("the core refused parameter %s[%d] = %d: %s" % (name, index, value, why))

    def _mission(self):
        """Steps until the core says that it has ended: "" then, or why it was not waited for."""
        robot, ask, truth, place, newest = self.robot, self._ask, self._truth, self._place, self.peer.newest
        values = array("i", bytes(4 * schema.VALUES_MAX))
        clock = time.monotonic
        report_s = tap_s = start_s = clock()
        step = self.now
        if self.state in ENDED:
            robot.drive(0, 0)   # a core that has started anew after the end: the robot stood
        try:
            while robot.tick < self._ticks_max:
                step += 1
                values[0] = step
                robot.sense(values)
                if truth is not None:
                    truth.pose(step, robot.x_m, robot.y_m, robot.theta_rad)
                place.step(step, values[1], values[2])
                place.said(newest.get(_POSE))
                _, left_mm_s, right_mm_s, self.state, _, _ = ask(values)
                self.step += 1
                if self.state in ENDED:
                    return ""
                robot.drive(left_mm_s, right_mm_s)
                now_s = clock()
                if now_s > tap_s:
                    tap_s = now_s + STEP_S
                    self._look_up(now_s)
                    if now_s > report_s:
                        report_s = now_s + PROGRESS_S
                        self._progress(now_s - start_s)
            return "robot time limit"
        finally:
            self.wall_s += clock() - start_s

    def _look_up(self, now_s):
        self._taps.service(now_s)
        if self._stops():
            raise Interrupted

    def _stops(self):
        return self._heed and self._stop() or self._stop() > 1

    def _progress(self, wall_s):
        peer, robot = self.peer, self.robot
        pose, memory = peer.newest.get(_POSE), peer.newest.get(_MEMORY)
        robot_s = self.step * STEP_S
        heap = memory or peer.hello
        self._report.event(
            "progress", step=self.step, robot_s=round(robot_s, 2), wall_s=round(wall_s, 2),
            path_m=round(robot.path_m, 2), state=self._state_name, contacts=robot.contacts,
            x_m=round(robot.x_m, 3), y_m=round(robot.y_m, 3), theta_rad=round(robot.theta_rad, 4),
            points=pose and pose.points, vectors=pose and pose.vectors, fixes=pose and pose.fixes, bumps=pose and pose.bumps,
            estimate_x_m=pose and pose.x_um / 1e6, estimate_y_m=pose and pose.y_um / 1e6,
            memory={"used": heap.heap_used_bytes, "total": heap.heap_bytes},
            stores={name: [store.used, store.capacity, store.lost] for name, store in peer.stores.items()},
            frames=peer.frames, bytes=peer.bytes, resent=peer.repeats)

    def _collect(self, must):
        """What the core says at the end, and its map, if it has one. What has come of it stays if the core starts anew."""
        dead_s = DEAD_S if must else 1.0
        try:
            self.status = self.peer.ask(_STATUS(0), _STATUS_RSP, dead_s=dead_s)
            if not self.peer.link.flaw(("LINK",)):
                self.peer.ask(_IDENTIFY(_LINK_SECTION, 0), _LINK, dead_s=dead_s)
            if not self.peer.link.flaw(("STORE",)):
                self._ask_for_stores()
            self.map_bytes = self._pull.pull(self.peer, dead_s)
        except (PeerError, Interrupted):
            if must:
                raise

    def _ask_for_stores(self):
        """Those that a short mission, or a bad line, has not told of. No mission fails for want of them."""
        heard = {store.index for store in self.peer.stores.values()}
        with contextlib.suppress(PeerError):
            for index in set(range(self.peer.hello.stores)) - heard:
                self.peer.ask(_IDENTIFY(_STORES_SECTION, index), _STORE, lambda store, index=index: store.index == index)
