"""Frames such as pass a tap during a mission round a rectangular room: for the monitor's tests.

`python -m tests.host_tools.tap_story PATH [SPEED]` plays them on a pty for a look by hand.
"""

import math
import os
import sys
import time
import tty

from protocol import schema_hash, states
from protocol.host_link import HostLink
from protocol.messages import BY_NAME

WIDTH_M, HEIGHT_M = 4.0, 3.0
SPEED_M_S = 0.3
STORES = (("vectors", 768, 6), ("chains", 64, 4), ("points", 64, 12), ("hits", 64, 8))


class Story:
    """Contract: `frames(step)` gives the frames of one step as bytes; after `last_step` the state is `end_state`."""

    def __init__(self, end_state=states.DONE, boot_id=7):
        self.codec = HostLink()
        self.codec.epoch = 1
        self.end_state = end_state
        self.boot_id = boot_id
        self.corners = [(0.0, 0.0), (WIDTH_M, 0.0), (WIDTH_M, HEIGHT_M), (0.0, HEIGHT_M)]
        self.perimeter_m = 2 * (WIDTH_M + HEIGHT_M)
        self.last_step = int(self.perimeter_m / SPEED_M_S * 50)

    def frame(self, name, fields):
        return self.codec.encode(BY_NAME[name](**fields))

    def hello(self, **changes):
        low, high = schema_hash.halves()
        fields = dict(protocol_min=1, protocol_max=1, schema_lo=low, schema_hi=high, firmware_lo=1, firmware_hi=2,
                      boot_id=self.boot_id, reset_cause=0, body_max=96, window_down=4, window_up=2, capabilities=0,
                      stores=len(STORES), parameters=26, heap_bytes=196608, heap_used_bytes=61000, heap_code_bytes=40000)
        return self.frame("HELLO", dict(fields, **changes))

    def pose_at(self, step):
        """(x, y, heading, side) on the way round, 20 cm inside the walls as a follower drives."""
        along = min(step / 50 * SPEED_M_S, self.perimeter_m)
        for side in range(4):
            (x0, y0), (x1, y1) = self.corners[side], self.corners[(side + 1) % 4]
            length = math.dist((x0, y0), (x1, y1))
            if along <= length or side == 3:
                t = along / length
                return x0 + (x1 - x0) * t, y0 + (y1 - y0) * t, math.atan2(y1 - y0, x1 - x0), side
            along -= length

    def frames(self, step):
        out = self.frame("STEP", dict(step=step, left=13, right=13, ir=[90, 60, 120, 210, 320, 560, 200, 40],
                                    ultrasonic_mm=1200, bump=0, uwb=()))
        state = self.state_at(step)
        out += self.frame("STEP_RSP", dict(step=step, left_mm_s=300, right_mm_s=298, state=state, ir_state=4, hash16=step & 0xFFFF))
        if step % 5 == 0:
            out += self.pose(step, state)
        if step % 50 == 0:
            out += self.telemetry(step)
        return out

    def state_at(self, step):
        return self.end_state if step >= self.last_step else states.FOLLOW

    def pose(self, step, state):
        x, y, heading, side = self.pose_at(step)
        bam = round(heading / math.tau * 65536) & 0xFFFF
        return self.frame("POSE", dict(
            step=step, x_um=round(x * 1e6), y_um=round(y * 1e6), heading_bam=bam, odometry_x_um=round(x * 1.01e6),
            odometry_y_um=round(y * 1e6), odometry_heading_bam=bam, state=state, ir_state=4,
            path_mm=step * 6, points=side + 1, vectors=side, fixes=side, bumps=0))

    def telemetry(self, step):
        side = self.pose_at(step)[3]
        done = 4 if step >= self.last_step else side
        out = b"".join(self.vector(i) for i in range(done))
        for index, (name, capacity, size) in enumerate(STORES):
            out += self.frame("STORE", dict(index=index, name=name, used=min(done + index, capacity), capacity=capacity,
                                         record_bytes=size, lost=0))
        out += self.frame("LINK", dict(
            frames_in=step, bytes_in=step * 35, frames_out=step, bytes_out=step * 24, duplicates=0, telemetry_dropped=0,
            bad_cobs=0, bad_crc=1, bad_length=0, bad_header=0, bad_id=0, bad_value=0, overrun=0))
        return out + self.frame("MEMORY", dict(heap_bytes=196608, heap_used_bytes=61234, heap_locked=1, allocated_after_boot_bytes=0))

    def vector(self, index):
        margin = 0.2    # walls lie outside of the robot's way
        sign = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        ends = [(self.corners[i % 4][0] + margin * sign[i % 4][0], self.corners[i % 4][1] + margin * sign[i % 4][1])
                for i in (index, index + 1)]
        (x0, y0), (x1, y1) = ends
        return self.frame("VECTOR", dict(index=index, chain=0, kind=0, x=round(x0 / 0.005), y=round(y0 / 0.005),
                                      x_end=round(x1 / 0.005), y_end=round(y1 / 0.005), sigma_mm=4))


def play(path, speed):
    """The whole story on a pty at `path`, `speed` times real time."""
    master, slave = os.openpty()
    tty.setraw(slave)
    if os.path.lexists(path):
        os.unlink(path)
    os.symlink(os.ttyname(slave), path)
    story = Story()
    os.write(master, story.hello())
    for step in range(story.last_step + 51):
        os.write(master, story.frames(step))
        time.sleep(0.02 / speed)
    time.sleep(2)
    os.unlink(path)


if __name__ == "__main__":
    play(sys.argv[1], float(sys.argv[2]) if len(sys.argv) > 2 else 1.0)
