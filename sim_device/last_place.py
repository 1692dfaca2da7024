# Where the robot is as far as anybody but the truth knows: what the core said last, carried on by the wheels.
#
# A core that starts anew knows nothing. It is told this place as the one it begins at, as a person would who
# presses its button without carrying the robot back to its dock.

import math
from collections import deque

BAM_RAD = 2 * math.pi / 65536


# step() each tick, said() for each POSE of the core; dock() then gives the parameters for a new start.
class LastPlace:
    def __init__(self, told):
        """`told`: the parameters that the mission began with."""
        self._mm_a_pulse = math.pi * told["wheel_diameter"][0] / 1000 / told["pulses_per_turn"][0]
        self._track_mm = told["track"][0] / 1000
        self._at = (told["dock_x"][0] / 1000, told["dock_y"][0] / 1000, told["dock_heading"][0] * BAM_RAD)
        self._since = deque()   # (step, left pulses, right pulses) that the place does not hold yet
        self._said = None

    def step(self, step, left, right):
        self._since.append((step, left, right))

    def said(self, pose):
        if pose is None or pose is self._said:
            return
        self._said = pose
        self._at = (pose.x_um / 1000, pose.y_um / 1000, pose.heading_bam * BAM_RAD)
        while self._since and self._since[0][0] <= pose.step:
            self._since.popleft()

    def dock(self):
        x_mm, y_mm, heading_rad = self._at
        for _, left, right in self._since:
            ahead_mm = (left + right) / 2 * self._mm_a_pulse
            turn_rad = (right - left) * self._mm_a_pulse / self._track_mm
            x_mm += ahead_mm * math.cos(heading_rad + turn_rad / 2)
            y_mm += ahead_mm * math.sin(heading_rad + turn_rad / 2)
            heading_rad += turn_rad
        self._at = (x_mm, y_mm, heading_rad)
        self._since.clear()
        return {"dock_x": [round(x_mm * 1000)], "dock_y": [round(y_mm * 1000)], "dock_heading": [round(heading_rad / BAM_RAD) & 65535]}
