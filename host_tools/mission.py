"""What one mission's frames said, as arrays by step: the input of every figure.

`MissionBuilder.add(message, fields)` takes the decoded messages in the order of the log;
`build(truth)` gives the Mission. Where they come from is mission_log.py's business.
"""

import math
import zlib
from dataclasses import dataclass, field

import numpy as np

from protocol import states
from protocol.dialect import CODES
from protocol.parameters import PARAMETERS

STEP_S = 0.02
UWB_RECORDS_MAX = 15
SAME_TURN_STEPS = 25
BAM_RAD = 2 * math.pi / 65536
POSE_FIELDS = ("step", "x_m", "y_m", "heading_rad", "state", "path_m", "points", "vectors", "fixes", "bumps")
TURNING_STATES = (states.CORNER_IN, states.CORNER_OUT)


def hashes(status):
    """hash.steps and hash.map of the result file, from the fields of a STATUS_RSP."""
    return {"steps": "%04x%04x" % (status["steps_hi"], status["steps_lo"]), "map": "%04x%04x" % (status["map_hi"], status["map_lo"])}


# Contract: `step` ascends without repeats, and left, right, state have its length (state is -1
# where no answer was seen). Lists of telemetry are in the order received. What never came is
# None or empty. Angles in radians, places in metres.
@dataclass
class Mission:
    step: np.ndarray
    left: np.ndarray
    right: np.ndarray
    state: np.ndarray
    uwb_row: np.ndarray  # row in `step` of each report
    uwb_anchor: np.ndarray  # (reports, 15), -1 where no record
    uwb_strength_cdb: np.ndarray
    uwb_range_mm: np.ndarray
    pose: np.ndarray  # (n, len(POSE_FIELDS))
    truth: np.ndarray  # (n, 4): step, x_m, y_m, heading_rad
    turn_rows: np.ndarray
    ir: np.ndarray  # (n, 8) raw readings of the infrared sensors
    tick_us: np.ndarray  # from a STEP sent to its answer, as the robot's end saw it
    parameters: dict = field(default_factory=dict)
    stores: dict = field(default_factory=dict)
    status: dict | None = None
    hello: dict | None = None
    link: dict | None = None
    map_bytes: bytes | None = None
    damaged: str = ""  # how the log broke off, if it did
    names: dict = field(default_factory=lambda: CODES)  # of reasons and degraded bits, by number

    def parameter(self, name, index=0):
        """The value sent to the core, else the default that it started with."""
        values = self.parameters.get(name, {})
        if index in values:
            return values[index]
        return next(row[5] for row in PARAMETERS if row[0] == name)

    @property
    def dock(self):
        return (self.parameter("dock_x") / 1e6, self.parameter("dock_y") / 1e6, self.parameter("dock_heading") * BAM_RAD)

    @property
    def geometry(self):
        """wheel_diameter_m, track_m, pulses_per_turn"""
        return self.parameter("wheel_diameter") / 1e6, self.parameter("track") / 1e6, self.parameter("pulses_per_turn")

    @property
    def anchors(self):
        """(n, 3) x, y, height above the receiver, in metres"""
        rows = [[self.parameter(name, i) / 1000 for name in ("anchor_x", "anchor_y", "anchor_height")]
                for i in range(self.parameter("anchor_count"))]
        return np.array(rows, float).reshape(-1, 3)

    @property
    def uwb_model(self):
        return {"source": self.parameter("uwb_source"), "level_1m_db": self.parameter("uwb_level_1m") / 100,
                "gamma": self.parameter("uwb_gamma") / 1000, "sigma_db": self.parameter("uwb_sigma") / 100,
                "level_min_db": self.parameter("uwb_level_min") / 100}

    @property
    def robot_s(self):
        return len(self.step) * STEP_S

    def visited(self, state):
        """Whether the mission was ever in this state, as far as the answers and the telemetry tell."""
        return bool((self.state == state).any() or (self.pose[:, POSE_FIELDS.index("state")] == state).any())

    def matched_poses(self):
        """(estimate, truth) rows of equal steps: (n, POSE_FIELDS) and (n, 4)."""
        _, at, of = np.intersect1d(self.pose[:, 0], self.truth[:, 0], return_indices=True)
        return self.pose[at], self.truth[of]


class MissionBuilder:
    def __init__(self):
        self._steps, self._states, self._reports, self._poses = [], {}, [], []
        self._sent, self._ticks_us = {}, []
        self._seen, self._turns, self._points, self._ir = set(), set(), set(), []
        self._parameters, self._stores, self._chunks = {}, {}, {}
        self._status = self._hello = self._link = self._info = None
        self.damaged = ""
        self.parameter_names = tuple(row[0] for row in PARAMETERS)   # by the numbers that the messages carry
        self.names = CODES

    def step(self, t_us, step, left, right, ir, records):
        """One STEP; a repeated one is the link's business, not the mission's."""
        if step in self._seen:
            return
        self._seen.add(step)
        self.goes_on()
        self._sent[step] = t_us
        self._steps.append((step, left, right))
        self._ir.append(ir)
        if records:
            self._reports.append((len(self._steps) - 1, records))

    def goes_on(self):
        """What the core has said of itself until now is not what it says at the end."""
        self._status = None

    def answer(self, t_us, step, state):
        before = self._states.get(step - 1)
        if step in self._sent:
            self._ticks_us.append(t_us - self._sent.pop(step))
        self._states[step] = state
        if state in TURNING_STATES and before not in (None, state):
            self._turns.add(step)

    def add(self, name, fields):
        """Any other message, its fields by the schema's names."""
        handler = getattr(self, "_on_" + name.lower(), None)
        if handler is not None:
            handler(fields)

    def _on_pose(self, m):
        self._poses.append((m["step"], m["x_um"] / 1e6, m["y_um"] / 1e6, m["heading_bam"] * BAM_RAD, m["state"],
                            m["path_mm"] / 1000, m["points"], m["vectors"], m["fixes"], m["bumps"]))

    def _on_point(self, m):
        # A point carries no step: it was recorded at or just before the last one answered (whether the next was sent by
        # then is chance). Repeats are refreshes.
        if m["order"] not in self._points and self._states:
            self._points.add(m["order"])
            self._turns.add(next(reversed(self._states)))

    def _on_store(self, m):
        self._stores[m["name"]] = {key: m[key] for key in ("index", "used", "capacity", "record_bytes", "lost")}

    def _on_hello(self, m):
        if self._hello is not None and self._hello["boot_id"] != m["boot_id"]:
            self._points = set()  # another core begins to count
        self._hello = m

    def _on_status_rsp(self, m):
        self._status = m

    def _on_link(self, m):
        self._link = m

    def _on_param_set(self, m):
        self._set(m)

    def _on_param_value(self, m):
        if m["status"] == 0:
            self._set(m)

    def _set(self, m):
        if m["parameter"] < len(self.parameter_names):
            self._parameters.setdefault(self.parameter_names[m["parameter"]], {})[m["index"]] = m["value"]

    def _on_map_info_rsp(self, m):
        if self._info is None or self._info["generation"] != m["generation"]:
            self._chunks = {}
        self._info = m

    def _on_map_data(self, m):
        if self._info is not None and m["generation"] == self._info["generation"]:
            self._chunks[m["offset"]] = bytes(m["data"])

    def _map(self):
        """The map's bytes if all of them came and they end with the checksum that was announced for them."""
        if self._info is None:
            return None
        data = bytearray()
        while len(data) in self._chunks and self._chunks[len(data)]:
            data += self._chunks[len(data)]
        crc = zlib.crc32(data[:-4])
        whole = len(data) == self._info["size"] and (self._info["crc_lo"], self._info["crc_hi"]) == (crc & 0xFFFF, crc >> 16)
        return bytes(data) if whole else None

    def _turn_rows(self, row):
        """A turn is told twice, by the state and by its point some steps later: one within half a second."""
        rows = []
        for at in sorted(row[step] for step in self._turns if step in row):
            if not rows or at - rows[-1] >= SAME_TURN_STEPS:
                rows.append(at)
        return np.array(rows, np.int64)

    def build(self, truth=None):
        steps = np.array(self._steps, np.int64).reshape(-1, 3)
        row = {int(step): i for i, step in enumerate(steps[:, 0])}
        padded = np.full((3, len(self._reports), UWB_RECORDS_MAX), -1, np.int64)
        for i, (_, records) in enumerate(self._reports):
            for j, record in enumerate(records[:UWB_RECORDS_MAX]):
                padded[:, i, j] = record
        poses = np.array(self._poses, float).reshape(-1, len(POSE_FIELDS))
        poses = poses[np.unique(poses[:, 0], return_index=True)[1]]
        return Mission(
            steps[:, 0], steps[:, 1], steps[:, 2],
            np.array([self._states.get(int(step), -1) for step in steps[:, 0]], np.int64),
            np.array([at for at, _ in self._reports], np.int64), padded[0], padded[1], padded[2],
            poses, np.zeros((0, 4)) if truth is None else truth,
            self._turn_rows(row), np.array(self._ir, np.int16).reshape(len(steps), len(self._ir[0]) if self._ir else 0),
            np.array(self._ticks_us, float),
            self._parameters, self._stores, self._status, self._hello, self._link, self._map(), self.damaged, self.names)
