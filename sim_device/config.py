# robot.toml, read and checked: what the virtual robot is built from and what the
# core is told of its own body.

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path

from protocol.parameters import PARAMETERS

DEFAULT = Path(__file__).with_name("robot.toml")
INFRARED = 8
_KINDS = {"infrared": INFRARED, "ultrasonic": 1, "uwb": 1}  # kind -> how many the robot has
_LIMITS = {name: (minimum, maximum, unit) for name, unit, _, minimum, maximum, _ in PARAMETERS}


class RobotError(Exception):
    """One sentence: the file, the key, what is wrong, the way out."""


@dataclass(frozen=True)
class Sensor:
    name: str
    kind: str
    bearing_deg: float
    radius_m: float
    part: str

    @property
    def bearing_rad(self):
        return math.radians(self.bearing_deg)


@dataclass(frozen=True)
class RobotConfig:
    name: str
    path: str
    radius_m: float
    wheel_diameter_m: float
    track_m: float
    pulses_per_turn: int
    encoder_part: str
    motor_time_constant_s: float
    speed_m_s: float
    turn_rad_s: float
    wall_gap_m: float
    infrared_hit_m: float
    sensors: tuple

    def of_kind(self, kind):
        return [sensor for sensor in self.sensors if sensor.kind == kind]

    def parameters(self):
        """{parameter name: [ints]} of protocol/parameters.py: the robot's own share."""
        infrared = self.of_kind("infrared")
        return {
            "wheel_diameter": [round(self.wheel_diameter_m * 1e6)],
            "track": [round(self.track_m * 1e6)],
            "pulses_per_turn": [self.pulses_per_turn],
            "body_radius": [round(self.radius_m * 1000)],
            "ir_radius": [round(infrared[0].radius_m * 1000)],
            "ir_bearing": [(round(s.bearing_deg * 65536 / 360) + 32768) % 65536 - 32768 for s in infrared],
            "speed_max": [round(self.speed_m_s * 1000)],
            "turn_max": [round(self.turn_rad_s * 1000)],
            "wall_gap": [round(self.wall_gap_m * 1000)],
            "ir_threshold": [round(self.infrared_hit_m * 1000)],
        }


def load_robot(path=None):
    """The RobotConfig of a TOML file, by default the one that ships. Raises RobotError."""
    path = Path(path) if path is not None else DEFAULT
    try:
        with open(path, "rb") as file:
            data = tomllib.load(file)
    except OSError as error:
        raise RobotError(f"{path}: cannot be read ({error.strerror}); give a readable robot TOML file.") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise RobotError(f"{path}: not TOML ({error}); mend that place, {DEFAULT.name} shows the form.") from None
    return _Reader(path, data).robot()


# Checks one parsed file key by key; the first fault raises RobotError.
class _Reader:
    def __init__(self, path, data):
        self.path = path
        self.data = data

    def robot(self):
        robot = RobotConfig(
            name=self._text(self.data, "name", ""),
            path=str(self.path),
            radius_m=self._number("body", "radius_m"),
            wheel_diameter_m=self._number("drive", "wheel_diameter_m"),
            track_m=self._number("drive", "track_m"),
            pulses_per_turn=self._number("drive", "pulses_per_turn", whole=True),
            encoder_part=self._text(self._table("drive"), "encoder_part", "drive."),
            motor_time_constant_s=self._number("drive", "motor_time_constant_s"),
            speed_m_s=self._number("limits", "speed_m_s"),
            turn_rad_s=self._number("limits", "turn_rad_s"),
            wall_gap_m=self._number("thresholds", "wall_gap_m"),
            infrared_hit_m=self._number("thresholds", "infrared_hit_m"),
            sensors=self._sensors(),
        )
        self._check(robot)
        return robot

    def _fail(self, key, what, way_out):
        raise RobotError(f"{self.path}: '{key}' {what}; {way_out}.")

    def _table(self, name):
        table = self.data.get(name)
        if table is None:
            self._fail(name, "is missing", f"add a [{name}] table as in {DEFAULT.name}")
        if not isinstance(table, dict):
            self._fail(name, "is not a table", f"write it as [{name}] as in {DEFAULT.name}")
        return table

    def _value(self, table, key, where):
        if key not in table:
            self._fail(where + key, "is missing", f"add it as in {DEFAULT.name}")
        return table[key]

    def _text(self, table, key, where):
        value = self._value(table, key, where)
        if not isinstance(value, str):
            self._fail(where + key, f"is {value!r}", "write it as text in quotes")
        return value

    def _number(self, name, key, whole=False):
        return self._checked(self._value(self._table(name), key, name + "."), f"{name}.{key}", whole)

    def _checked(self, value, key, whole=False):
        if isinstance(value, bool) or not isinstance(value, int if whole else (int, float)):
            self._fail(key, f"is {value!r}", "give a whole number" if whole else "give a number")
        if not math.isfinite(value):
            self._fail(key, f"is {value!r}", "give a finite number")
        return value if whole else float(value)

    def _sensors(self):
        rows = self.data.get("sensor")
        if not isinstance(rows, list) or not rows:
            self._fail("sensor", "is missing", f"add [[sensor]] tables as in {DEFAULT.name}")
        sensors = []
        for i, row in enumerate(rows):
            where = f"sensor[{i}]."
            if not isinstance(row, dict):
                self._fail(f"sensor[{i}]", "is not a table", "write each as [[sensor]]")
            kind = self._text(row, "kind", where)
            if kind not in _KINDS:
                self._fail(where + "kind", f"is {kind!r}", "give one of " + ", ".join(_KINDS))
            bearing = self._checked(self._value(row, "bearing_deg", where), where + "bearing_deg")
            if not -180 <= bearing <= 180:
                self._fail(where + "bearing_deg", f"is {bearing:g}", "give -180 to 180, left positive")
            radius = self._checked(self._value(row, "radius_m", where), where + "radius_m")
            sensors.append(Sensor(self._text(row, "name", where), kind, bearing, radius, self._text(row, "part", where)))
        for kind, wanted in _KINDS.items():
            have = sum(sensor.kind == kind for sensor in sensors)
            if have != wanted:
                self._fail("sensor", f"lists {have} of kind {kind}", f"the robot has exactly {wanted}")
        return tuple(sensors)

    def _check(self, robot):
        infrared = robot.of_kind("infrared")
        for i, sensor in enumerate(infrared, 1):
            if sensor.name != f"I{i}":
                self._fail("sensor", f"has an infrared sensor {sensor.name!r} in place {i}", "list I1 to I8 in order")
            if sensor.radius_m != infrared[0].radius_m:
                self._fail("sensor", f"mounts {sensor.name} at {sensor.radius_m:g} m and I1 at {infrared[0].radius_m:g} m",
                           "mount all infrared sensors at one radius")
        for sensor in robot.sensors:
            if not 0 <= sensor.radius_m <= robot.radius_m:
                self._fail("sensor", f"mounts {sensor.name} at {sensor.radius_m:g} m, outside the body of {robot.radius_m:g} m",
                           "keep 0 <= radius_m <= body.radius_m")
        if not 0 <= robot.motor_time_constant_s <= 1:
            self._fail("drive.motor_time_constant_s", f"is {robot.motor_time_constant_s:g}", "give 0 to 1 s")
        for name, values in robot.parameters().items():
            minimum, maximum, unit = _LIMITS[name]
            for value in values:
                if not minimum <= value <= maximum:
                    self._fail(_KEYS[name], f"makes the core's parameter '{name}' {value} {unit}",
                               f"it must lie between {minimum} and {maximum} {unit}")


_KEYS = {  # parameter -> the key of robot.toml that sets it
    "wheel_diameter": "drive.wheel_diameter_m", "track": "drive.track_m", "pulses_per_turn": "drive.pulses_per_turn",
    "body_radius": "body.radius_m", "ir_radius": "sensor.radius_m", "ir_bearing": "sensor.bearing_deg",
    "speed_max": "limits.speed_m_s", "turn_max": "limits.turn_rad_s", "wall_gap": "thresholds.wall_gap_m",
    "ir_threshold": "thresholds.infrared_hit_m",
}
