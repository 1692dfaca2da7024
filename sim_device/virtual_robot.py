# The virtual robot: body, world and sensors joined; a tick is sense(), drive().

from sim_device.config import RobotError
from sim_device.robot import ODOMETRY, Body
from sim_device.sensors.encoder import Encoder
from sim_device.sensors.infrared import Infrared
from sim_device.sensors.ultrasonic import Ultrasonic
from sim_device.sensors.uwb import PRESETS, Uwb
from sim_device.world import Nearby, World


# One robot in one home. The same (home, config, seed, uwb, odometry) and the
# same speeds give bit-identical readings and truth, run after run. Call sense()
# once a tick, then drive(). It starts at home.start with heading 0.
class VirtualRobot:
    def __init__(self, home, config, seed=1, uwb="paper", odometry="calibrated"):
        if uwb not in PRESETS:
            raise ValueError(f"unknown UWB preset {uwb!r}: give one of {', '.join(PRESETS)}")
        if odometry not in ODOMETRY:
            raise ValueError(f"unknown odometry preset {odometry!r}: give one of {', '.join(ODOMETRY)}")
        self.home = home
        self.config = config
        self.world = World(home)
        infrared = config.of_kind("infrared")
        ultrasonic = config.of_kind("ultrasonic")[0]
        self._infrared = Infrared([s.bearing_rad for s in infrared], infrared[0].radius_m, seed)
        self._ultrasonic = Ultrasonic(self.world, ultrasonic.bearing_rad, ultrasonic.radius_m, seed)
        self._uwb = Uwb(home, uwb, seed)
        self._left = Encoder(config.pulses_per_turn)
        self._right = Encoder(config.pulses_per_turn)
        self._nearby = Nearby(self.world, self._infrared.reach_m)
        gap = self.world.clearance(*home.start, config.radius_m + 1)
        if gap < config.radius_m:
            raise RobotError(f"{config.path}: 'body.radius_m' is {config.radius_m:g}, but at the start of {home.name} a wall is "
                             f"{gap:.3f} m away; make the body smaller or move 'start' in {home.path}.")
        self.body = Body(config, self._nearby, home.start, odometry, seed)
        self.tick = 0

    def sense(self, values):
        """Fill values[1:] as a decoded STEP: encoders, infrared, ultrasonic, bump, UWB."""
        body = self.body
        x = body.x_m
        y = body.y_m
        values[1] = self._left.read(body.left_rad)
        values[2] = self._right.read(body.right_rad)
        self._infrared.read(values, 3, self._nearby.at(x, y), x, y, body.cos, body.sin)
        values[11] = self._ultrasonic.read(self.tick, x, y, body.cos, body.sin)
        values[12] = body.bump
        self._uwb.read(values, 13, self.tick, x, y)

    def drive(self, left_mm_s, right_mm_s):
        """Advance the truth by one tick of 20 ms under these commanded wheel speeds."""
        self.body.drive(left_mm_s, right_mm_s)
        self.tick += 1

    def kidnap(self, x_m, y_m, theta_rad):
        """Lift the robot and set it down there, standing; its wheels do not notice."""
        gap = self.world.clearance(x_m, y_m, self.config.radius_m + 1)
        if gap < self.config.radius_m:
            raise RobotError(f"the robot cannot be set down at ({x_m:g}, {y_m:g}) in {self.home.name}: a wall is {gap:.3f} m away; "
                             f"its radius is {self.config.radius_m:g} m.")
        self.body.put(x_m, y_m, theta_rad)

    def parameters(self):
        """{parameter name: [ints]}: everything that the core must be told before the first step."""
        x, y = self.home.start
        told = self.config.parameters()
        told.update(dock_x=[round(x * 1e6)], dock_y=[round(y * 1e6)], dock_heading=[0])
        told.update(self._uwb.parameters())
        return told

    @property
    def anchors(self):
        """Transmitters as (x, y, z) in metres."""
        return self._uwb.anchors

    @property
    def x_m(self):
        return self.body.x_m

    @property
    def y_m(self):
        return self.body.y_m

    @property
    def theta_rad(self):
        return self.body.theta_rad

    @property
    def contacts(self):
        return self.body.contacts

    @property
    def path_m(self):
        return self.body.path_m
