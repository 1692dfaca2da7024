# Wheel encoders: whole pulses from the true turning of the two wheels.

import math


# Counts of one wheel. The fraction of a pulse is carried in the running total,
# so no travel is ever lost: sum of all counts = floor(total turns * pulses).
class Encoder:
    def __init__(self, pulses_per_turn):
        self._scale = pulses_per_turn / (2 * math.pi)
        self._counted = 0

    def read(self, wheel_rad):
        """Pulses since the last read; wheel_rad is the wheel's angle since the start."""
        total = math.floor(wheel_rad * self._scale)
        pulses = total - self._counted
        self._counted = total
        return pulses
