"""One mission: the virtual robot and the core started, watched, and ended whatever happens."""

import json
import os
import queue
import signal
import time
from dataclasses import dataclass, field

from host_tools.can_bus import CanBus
from host_tools.core_starter import CoreStarter
from host_tools.hil_options import is_can
from host_tools.launch import robot_command, stm32_image
from host_tools.processes import Children
from host_tools.qemu import Emulator, EmulatorError
from host_tools.relay import Relay

LINK_S = 10.0  # for the robot to make its link
SILENT_GRACE_S = 0.3  # for one that has been silent for 3 s already
CORE_GRACE_S = 2.0  # for the core to see the hang-up by itself
ROBOT_GRACE_S = 10.0  # for the robot to write down what it has, on a busy machine
HUNG_UP = (3, -signal.SIGHUP)   # how a core ends from whose link the robot has gone


# How a mission went. `exit_code` as the virtual robot's: 0 finished, 1 not, 2 bad arguments, 3 a peer failed.
@dataclass
class Outcome:
    exit_code: int
    sentence: str = ""
    end: dict = field(default_factory=dict)
    interrupted: bool = False
    tick: dict = field(default_factory=dict)  # what the steps cost in instructions, where the target counts them
    memory: dict = field(default_factory=dict)  # flash and RAM, where the target tells them
    can: dict = field(default_factory=dict)  # what the CAN bus counted, where there is one
    began: bool = False  # the robot has emptied the files of this mission: what its log says is of this one

    @property
    def incomplete(self):
        """A sentence where the disk did not take the whole log, or the whole candump."""
        return "; ".join(filter(None, (part.get("incomplete") for part in (self.end, self.can))))


def run_mission(args, home_path, folder, log, truth, progress):
    """Run it to its end; Ctrl-C ends it early with what there is."""
    watch = _Watch(progress)
    outcome = _run(args, home_path, folder, log, truth, watch)
    outcome.began = watch.began
    return outcome


def _run(args, home_path, folder, log, truth, watch):
    link, progress = os.path.join(folder, "link"), watch.progress
    with Children() as children:
        device = args.target[len("port:"):] if args.target.startswith("port:") else None
        bus = watch.bus = CanBus(args.link, folder, getattr(args, "candump", None), device) if is_can(args.link) else None
        link = bus.robot_link if bus else link
        relay = starter = None
        try:
            # The port is opened first: a board that is not there is said before anything starts.
            relay = Relay(device, link, anew=True) if device and not bus else None
            image = stm32_image(args.heap, progress.note) if args.target == "stm32" else None
            argv, root = robot_command(args, home_path, link, log, truth)
            if bus:
                bus.start(children)
            watch.robot = children.start("the virtual robot", argv, on_line=watch.take, cwd=root)
            starter = CoreStarter(args, children, bus.core_link if bus else link, image, relay, progress.note)
            if image is None or _link_there(bus.core_path if bus else link, watch.robot):
                watch.relay, watch.reset = relay, starter.reset
                watch.core = starter.start()
            outcome = watch.outcome()
            # The link's name is ours alone: it tells a user nothing, and is gone by now.
            if bus:
                outcome.sentence, outcome.can = bus.named(outcome.sentence), bus.figures()
                if outcome.exit_code in (0, 1, 3) and bus.failure():    # robot and core only see that their adapter has gone
                    outcome.exit_code, outcome.sentence = 3, bus.failure()
            else:
                outcome.sentence = outcome.sentence.replace(link, relay.device if relay is not None else "the link")
            if starter.emulator is not None:
                outcome.tick, outcome.memory = starter.emulator.tick, starter.emulator.memory()
            return outcome
        except EmulatorError as error:
            return Outcome(3, str(error), watch.end)
        except KeyboardInterrupt:
            progress.note("Interrupted: ending the mission, keeping what there is.")
            if watch.robot is not None:
                watch.robot.stop()
            watch.drain()
            return Outcome(1, "interrupted", watch.end, interrupted=True, can=watch.bus.figures() if watch.bus else {})
        finally:
            progress.clear()
            if starter is not None:
                starter.stop()
            if relay is not None:
                relay.close()


def _link_there(link, robot):
    """The emulator opens the link by its name, which the robot makes. Without it the robot's outcome says why."""
    limit = time.monotonic() + LINK_S
    while not os.path.exists(link):
        if robot.poll() is not None or time.monotonic() > limit:
            return False
        time.sleep(0.01)
    return True


# Follows the events of the virtual robot and the life of the core until one of them ends.
class _Watch:
    def __init__(self, progress):
        self.progress = progress
        self.events = queue.Queue()
        self.robot = self.core = self.relay = self.bus = self.reset = None
        self.end, self.error, self.blames = {}, "", "core"
        self.began = False
        self.waiting = False  # the robot awaits the core's first word

    def take(self, text):
        """From the reader's thread: one line of the robot's stdout."""
        self.events.put(text)

    def outcome(self):
        while True:
            self._one_event(0.1)
            if self.robot.poll() is not None:
                self.drain()
                return self._robot_ended()
            if self.core is not None and self.core.poll() is not None:
                return self._core_ended()
            failure = self.relay and self.relay.failure or self.bus and self.bus.failure()
            if failure:
                self.robot.stop()
                self.drain()
                return Outcome(3, failure, self.end)

    def drain(self):
        """What the robot said last is still on its way when it has ended."""
        if self.robot is not None:
            self.robot.text()
        while not self.events.empty():
            self._one_event(0)

    def _one_event(self, timeout_s):
        try:
            text = self.events.get(timeout=timeout_s) if timeout_s else self.events.get_nowait()
        except queue.Empty:
            return
        try:
            event = json.loads(text)
            kind = event["event"]
        except (ValueError, TypeError, KeyError):
            return  # a line for people
        if kind == "progress":
            self.progress.show(event)
        elif kind == "end":
            self.end = event
            for item in event["missed"]:
                self.progress.note("--faults %s never came: the mission was over before." % item)
        elif kind == "error":
            self.error = event.get("sentence") or event.get("message") or text
            self.blames = event.get("blames", self.blames)
            self.end = event  # how far it came
        elif kind in ("schema", "degraded"):
            self.progress.note(event["text"])
        elif kind == "reset":
            self.progress.note(event["text"])
            if not event["here"]:
                self.core = self.reset()
        elif kind == "restart":
            self.progress.note("The core has started anew at step %d, where the robot stands." % event["step"])
        elif kind in ("ready", "start"):
            self.began = True
            self.waiting = kind == "ready"
            for sentence in event.get("storage", ()):
                self.progress.note(sentence)

    def _robot_ended(self):
        if self.bus is not None:
            self.bus.end()
        code = self.robot.popen.returncode
        if code == 3 and self.end.get("event") == "end":    # its mission came to its end, not so its log
            code = 0 if self.end["finished"] else 1
        # Without a mission there was nothing that the core could have seen the end of.
        emulated = isinstance(self.core, Emulator)
        grace_s = 0 if code == 2 else SILENT_GRACE_S if emulated and code == 3 else CORE_GRACE_S
        if self.core is not None and self.core.wait(grace_s) is None:
            self.core.stop(1.0)
        sentence = self.error or (last_line(self.robot.text()) if code else "")
        if (code == 3 and self.blames == "core" and self.core is not None and self.core.popen.returncode not in (0, None)
                and (emulated or self.core.text())):
            sentence = self._cause(sentence)
        if code == 130:  # somebody else's signal ended it
            return Outcome(1, "interrupted", self.end, interrupted=True)
        if code not in (0, 1, 2, 3):
            sentence = "the virtual robot ended with code %s: %s" % (code, sentence or "it said nothing")
            code = 3
        return Outcome(code, sentence, self.end)

    def _core_ended(self):
        """The core ended first. The robot may be ending too: what it says of its own arguments comes first."""
        # One that ended with its mission done, or was hung up on, has seen the robot close the link.
        hung_up = self.core.poll() in HUNG_UP and not isinstance(self.core, Emulator)
        limit = time.monotonic() + (ROBOT_GRACE_S if hung_up or self.core.poll() == 0 else CORE_GRACE_S)
        while self.robot.poll() is None and time.monotonic() < limit and (hung_up or not self.waiting):
            self._one_event(0.1)
        self.drain()
        if self.robot.poll() in (0, 1, 2) or self.blames != "core" or self.end.get("event") == "end":
            return self._robot_ended()
        self.robot.stop(1.0)
        self.drain()
        return Outcome(3, self._cause(self.error), self.end)

    def _cause(self, sentence):
        """What the core said as it ended, where the robot only saw that; the robot's, where the core only saw it give up."""
        if isinstance(self.core, Emulator):
            return "; ".join(filter(None, (sentence, core_sentence(self.core))))
        if sentence and self.core.popen.returncode in HUNG_UP and "while it was in use" not in sentence:
            return sentence
        return core_sentence(self.core)


def core_sentence(core):
    """What the core said when it gave up, as one sentence."""
    if isinstance(core, Emulator):
        return core.sentence()
    text, code = core.text(), core.popen.returncode
    if "MemoryError" in text and "Traceback" in text:
        return ("the core ran out of heap while it was loading (%s); give a larger --heap, 192k is the default"
                % last_line(text).removeprefix("MemoryError: "))
    if text:
        said = last_line(text).removeprefix("tvslam: ")
        return "the core failed: " + said if "Traceback" in text else said
    return "the core ended with code %s before the mission did, and said nothing" % code


def last_line(text):
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1].strip() if lines else ""
