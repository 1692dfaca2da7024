"""A mission written frame by frame as the virtual robot writes it: a square drive with known errors.

The robot drives a square of `side_m` in steps of 6 mm and turns on the spot; the encoders are
exact; the estimate is the truth plus `offset_m`. No core and no virtual robot take part.
"""

import math
import struct
import zlib

import numpy as np

from protocol import parameters, states
from protocol.log import LogWriter
from protocol.messages import BY_NAME

GEOMETRY = (0.072, 0.235, 508)
STEP_M = math.pi * GEOMETRY[0] / GEOMETRY[2] * 13  # 13 pulses a tick
ANCHORS_MM = ((0, 0, 2300), (4000, 0, 2300), (4000, 4000, 2300), (0, 4000, 2300), (2000, 2000, 2300))
DOCK = (1.0, 1.0, 0.0)
GAMMA, LEVEL_DB = 1.7, -47.0
PARAMETER_IDS = {row[0]: i for i, row in enumerate(parameters.PARAMETERS)}


def frame(name, fields):
    message = BY_NAME[name]
    body = message(**fields).pack()
    raw = bytes([1 | message.DIRECTION << 2, 0, 0, message.ID, 5 + len(body) + 4]) + body
    return raw + struct.pack("<I", zlib.crc32(raw))


class SyntheticMission:
    def __init__(self, side_m=2.0, offset_m=(0.03, 0.04), source=2, repeat_steps=False):
        self.writer = LogWriter()
        self.log = bytearray(self.writer.head())
        self.truth = bytearray()
        self.t_us = 0
        self.offset_m, self.source, self.repeat_steps = offset_m, source, repeat_steps
        self.x, self.y, self.heading = DOCK
        self.number = 0
        self._parameters()
        self.state = states.FOLLOW
        for _ in range(4):
            self._leg(int(side_m / STEP_M))

    def say(self, message, **fields):
        self.t_us += 20000
        self.log += self.writer.record(self.t_us, 0, frame(message, fields))

    def set_parameter(self, name, value, index=0):
        self.say("PARAM_SET", parameter=PARAMETER_IDS[name], index=index, value=value)

    def _parameters(self):
        self.set_parameter("dock_x", round(DOCK[0] * 1e6))
        self.set_parameter("dock_y", round(DOCK[1] * 1e6))
        self.set_parameter("uwb_source", self.source)
        self.set_parameter("uwb_sigma", 0)
        self.set_parameter("anchor_count", len(ANCHORS_MM))
        for i, place in enumerate(ANCHORS_MM):
            for name, value in zip(("anchor_x", "anchor_y", "anchor_height"), place):
                self.set_parameter(name, value, i)

    def _leg(self, steps):
        for _ in range(steps):
            self._step(13, 13)
        # A quarter turn on the spot, in ticks of 26 pulses of difference, rounded to whole ticks.
        per_tick = 2 * STEP_M / GEOMETRY[1]
        self.state = states.CORNER_IN
        for _ in range(round(math.pi / 2 / per_tick)):
            self._step(-13, 13)
        self.state = states.FOLLOW

    def _step(self, left, right):
        metres = math.pi * GEOMETRY[0] / GEOMETRY[2]
        turn = (right - left) * metres / GEOMETRY[1]
        forward = (left + right) / 2 * metres
        self.x += forward * math.cos(self.heading + turn / 2)
        self.y += forward * math.sin(self.heading + turn / 2)
        self.heading += turn
        self.truth += struct.pack("<I3d", self.number, self.x, self.y, self.heading)
        records = self._uwb() if self.number % 5 == 0 else []
        for _ in range(2 if self.repeat_steps and self.number % 7 == 0 else 1):  # as after a lost answer
            self.say("STEP", step=self.number, left=left, right=right, ir=[0] * 8, ultrasonic_mm=0, bump=0, uwb=records)
            self.say("STEP_RSP", step=self.number, left_mm_s=0, right_mm_s=0, state=self.state, ir_state=0, hash16=0)
        if self.number % 5 == 0:
            self._pose()
        self.number += 1

    def _uwb(self):
        records = []
        for i, (x, y, z) in enumerate(ANCHORS_MM):
            slant = math.dist((self.x, self.y, 0), (x / 1000, y / 1000, z / 1000))
            level = LEVEL_DB - 10 * GAMMA * math.log10(slant)
            records.append((i, round(level * 100), round(slant * 1000)))
        return records

    def _pose(self):
        x, y = self.x + self.offset_m[0], self.y + self.offset_m[1]
        bam = round(self.heading * 65536 / (2 * math.pi)) & 65535
        self.say("POSE", step=self.number, x_um=round(x * 1e6), y_um=round(y * 1e6), heading_bam=bam, odometry_x_um=0,
                 odometry_y_um=0, odometry_heading_bam=0, state=self.state, ir_state=0, path_mm=0, points=1, vectors=2, fixes=3, bumps=0)

    def finish(self, map_bytes=None, finished=1, reason=states.REASON_CLOSED, drop_chunk=None, heap_bytes=196608, degraded=0,
               state=states.DONE):
        for index, (name, used, capacity, size) in enumerate((("points", 7, 64, 8), ("vectors", 4, 768, 6), ("chains", 1, 64, 4))):
            self.say("STORE", index=index, name=name, used=used, capacity=capacity, record_bytes=size, lost=0)
        self.say("STATUS_RSP", step=self.number - 1, state=state, finished=finished, reason=reason, degraded=degraded,
                 steps_lo=0xBEEF, steps_hi=0x00AD, map_lo=0x0002, map_hi=0x1000, closure_before_mm=123, closure_after_mm=4,
                 bumps=2, path_mm=8000, heap_bytes=heap_bytes, heap_used_bytes=heap_bytes // 2, heap_locked=1, allocated_after_boot_bytes=0,
                 late_ticks=0, late_ms=0)
        if map_bytes is not None:
            crc = zlib.crc32(map_bytes[:-4])  # the map's own, which ends it
            self.say("MAP_INFO_RSP", generation=1, size=len(map_bytes), crc_lo=crc & 0xFFFF, crc_hi=crc >> 16)
            for offset in range(0, len(map_bytes), 88):
                if offset != drop_chunk:
                    self.say("MAP_DATA", generation=1, offset=offset, data=map_bytes[offset:offset + 88])
        return self

    def save(self, folder):
        log, truth = folder / "mission.log", folder / "truth.bin"
        log.write_bytes(self.log)
        truth.write_bytes(self.truth)
        return log, truth

    @property
    def true_path(self):
        return np.frombuffer(bytes(self.truth), np.dtype([("step", "<u4"), ("pose", "<f8", 3)]))["pose"]
