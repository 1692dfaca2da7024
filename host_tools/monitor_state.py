"""What the monitor knows of a running core: the newest of everything that passed the tap.

Contract: `apply(message)` takes one message (protocol.messages) of either direction
and never raises on what a core may send. Everything grows only to the bound named
below; a new boot, or a step number that goes back, starts the map afresh. No
terminal, no clock of its own, no port: monitor_rows.py turns this into text.
"""

import math

from protocol import states
from protocol.dialect import CODES, name_of, names_of_bits
from protocol.parameters import PARAMETERS

UNIT_M = 0.005            # map coordinates on the wire are in 5 mm
PATH_STEP_M = 0.05        # the path is drawn from points this far apart
PATH_POINTS_MAX = 20000   # 1 km; beyond it every second point goes
VECTORS_MAX = 65536       # what the u16 index can name

# Mounting of the infrared sensors I1..I8, degrees left of ahead, until a PARAM_SET tells better.
IR_BEARINGS_DEG = (0.0, 60.0, -18.0, -40.0, -65.0, -90.0, -120.0, 180.0)

ENDED = (states.DONE, states.FAILED)


class MonitorState:
    def __init__(self):
        self.hello = None
        self.ir_bearings_deg = list(IR_BEARINGS_DEG)
        self.anchors = {}          # index -> [x_mm, y_mm]
        self.anchor_count = 0
        self.messages = 0
        self.names = CODES      # of states and bits by number, and those of the parameters: the core's own, once it is known
        self.parameter_names = tuple(row[0] for row in PARAMETERS)
        self.forget_mission()

    def forget_mission(self):
        """A core that begins anew has none of this yet."""
        self.pose = None
        self.step = None           # newest STEP, what the sensors say
        self.answer = None         # newest STEP_RSP
        self.status = None
        self.link = None
        self.memory = None
        self.error = None
        self.stores = {}
        self.vectors = {}
        self.points = {}
        self.path_m = []

    @property
    def state(self):
        """The mission's state number, or None before the core said it."""
        newest = [m for m in (self.answer, self.pose, self.status) if m is not None]
        return max(newest, key=lambda m: m.step).state if newest else None

    @property
    def state_name(self):
        number = self.state
        if number is None:
            return "no state yet"
        return name_of(self.names["states"], number, "state")

    @property
    def degraded(self):
        """What made the mission's result the poorer, by name, once the core has been asked for its status."""
        return names_of_bits(self.names["degraded"], self.status.degraded) if self.status is not None else []

    @property
    def ended(self):
        return self.state in ENDED

    @property
    def steps(self):
        return max([m.step for m in (self.step, self.answer, self.pose, self.status) if m is not None], default=0)

    @property
    def robot_s(self):
        return self.steps * 0.02  # a control step is 20 ms of robot time

    @property
    def ir_state(self):
        newest = self.answer or self.pose
        return newest.ir_state if newest else None

    def apply(self, message):
        self.messages += 1
        take = getattr(self, "_take_" + message.NAME.lower(), None)
        if take is not None:
            take(message)

    def _take_hello(self, message):
        if self.hello is not None and self.hello.boot_id != message.boot_id:
            self.forget_mission()
        self.hello = message

    def _take_step(self, message):
        if self.step is not None and message.step < self.step.step and message.step <= 1:
            self.forget_mission()
        self.step = message

    def _take_step_rsp(self, message):
        self.answer = message

    def _take_pose(self, message):
        if self.pose is not None and message.step < self.pose.step:
            self.forget_mission()
        self.pose = message
        x_m, y_m = message.x_um * 1e-6, message.y_um * 1e-6
        if not self.path_m or math.dist(self.path_m[-1], (x_m, y_m)) >= PATH_STEP_M:
            self.path_m.append((x_m, y_m))
            if len(self.path_m) > PATH_POINTS_MAX:
                del self.path_m[1::2]

    def _take_store(self, message):
        self.stores[message.index] = message

    def _take_vector(self, message):
        if message.index < VECTORS_MAX:
            self.vectors[message.index] = message

    def _take_point(self, message):
        self.points[message.order & 0xFFFF] = message

    def _take_link(self, message):
        self.link = message

    def _take_memory(self, message):
        self.memory = message

    def _take_error(self, message):
        self.error = message

    def _take_status_rsp(self, message):
        self.status = self.memory = message     # it has all of MEMORY's fields

    def _take_parameter(self, message):
        if message.parameter >= len(self.parameter_names):
            return
        name, index, value = self.parameter_names[message.parameter], message.index, message.value
        if name == "ir_bearing" and index < 8:
            self.ir_bearings_deg[index] = value * 360 / 65536
        elif name == "anchor_count":
            self.anchor_count = value
        elif name in ("anchor_x", "anchor_y"):
            self.anchors.setdefault(index, [0, 0])[name == "anchor_y"] = value

    _take_param_set = _take_parameter

    def _take_param_value(self, message):
        if message.status == 0:
            self._take_parameter(message)

    def heading_rad(self):
        return self.pose.heading_bam * math.tau / 65536 if self.pose else 0.0

    def position_m(self):
        return (self.pose.x_um * 1e-6, self.pose.y_um * 1e-6) if self.pose else None

    def walls_m(self):
        """The vectors as (x0, y0, x1, y1) in metres."""
        return [(v.x * UNIT_M, v.y * UNIT_M, v.x_end * UNIT_M, v.y_end * UNIT_M)
                for v in self.vectors.values()]

    def bounds_m(self):
        """The smallest box around walls, path and robot, with 0.3 m to spare."""
        xs = [x for x, _ in self.path_m]
        ys = [y for _, y in self.path_m]
        for x0, y0, x1, y1 in self.walls_m():
            xs += (x0, x1)
            ys += (y0, y1)
        if not xs:
            return -1.0, -1.0, 1.0, 1.0
        return min(xs) - 0.3, min(ys) - 0.3, max(xs) + 0.3, max(ys) + 0.3
