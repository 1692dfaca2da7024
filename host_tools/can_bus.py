"""The CAN bus of a mission: a hub of SLCAN adapters as a process, and what robot and core call their ends of it."""

import importlib.util
import json
import os
import sys

from host_tools.hil_options import SLCAN


INCOMPLETE = 3      # the hub's exit code


# Contract: `core_link` and `robot_link` are the names that the two peers open, known before start(), `core_path` the
# pty of the core's adapter; end() ends the hub
# when the robot has gone, figures() is what it counted. Over socketcan and udp the robot is on that bus by itself, and
# the hub is the core's adapter there, as slcand is one for the kernel. With an `adapter` of metal, on whose bus the core
# is already, there is no hub.
class CanBus:
    def __init__(self, link, folder, candump, adapter=None):
        kind = link if link in SLCAN else "slcan"
        self.core_path = os.path.join(folder, "core.can")
        self._robot_end = os.path.join(folder, "robot.can")
        self.core_link = "%s:%s" % (kind, self.core_path)
        self.robot_link = "%s:%s" % (kind, self._robot_end) if link in SLCAN else link
        self._argv = [sys.executable, "-m", "sim_device.can_hub"]
        if link not in SLCAN:
            self._argv += ["--uplink", link]
        if candump:
            self._argv += ["--candump", os.path.abspath(candump)]
        self._argv += [self.core_path, self._robot_end] if link in SLCAN else [self.core_path]
        self._hub = None
        self._ended = False
        self._figures = {}
        if adapter:
            self._argv, self.robot_link = None, "%s:%s" % (kind, adapter)

    def start(self, children):
        if self._argv is None:
            return
        spec = importlib.util.find_spec("sim_device")  # found without importing it: it is for another process
        root = os.path.dirname(os.path.abspath(list(spec.submodule_search_locations)[0]))
        self._hub = children.start("the CAN bus", self._argv, on_line=self._take, cwd=root)

    def _take(self, text):
        try:
            event = json.loads(text)
        except ValueError:
            return
        if isinstance(event, dict) and event.pop("event", "") == "bus":
            self._figures = event

    def failure(self):
        """One sentence if the hub has failed, else nothing. That its candump is incomplete ends no mission: `incomplete` of figures()."""
        if self._hub is None or self._ended or self._hub.poll() in (None, 0, INCOMPLETE):
            return ""
        said = self._hub.text().splitlines()
        return said[-1].removeprefix("can_hub: ") if said else "the CAN bus ended with code %s" % self._hub.poll()

    def end(self):
        """The mission is over: the core sees its adapter go, as on a pty it would see the robot go."""
        if self._hub is not None and self._hub.poll() is None:
            self._ended = True
            self._hub.stop(1.0)

    def figures(self):
        self.end()
        if self._hub is not None:
            self._hub.text()    # its last line may still be on its way
        return self._figures

    def named(self, sentence):
        """The names of our own folder tell a user nothing."""
        return sentence.replace(self._robot_end, "the CAN adapter").replace(self.core_path, "the core's CAN adapter")
