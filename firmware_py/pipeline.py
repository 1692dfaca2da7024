# The whole SLAM: owns the storage, runs the layers once a step.

from array import array
from protocol.parameters import PARAMETERS
from .collection.explorer import Explorer, BUILD, DONE, FAILED, FOLLOW, ALIGN
from .collection.follower import Follower
from .collection.infrared import Infrared
from .collection.ir_state import IrState
from .collection.localization import Localization
from .collection.uwb import Uwb
from .collection.odometry import Odometry
from .building.walls import WallMapper
from .storage.breadcrumbs import Breadcrumbs, OUTLINE_CLOSED, ISLAND_CLOSED
from .storage.frame import Frame
from .storage.hit_ring import HitRing
from .storage.point_ring import PointRing
from .storage.tally import Tally
from .storage.vector_store import VectorStore


class Tvslam:
    def __init__(self):
        self.hits = HitRing()
        self.points = PointRing()
        self.vectors = VectorStore()
        self.crumbs = Breadcrumbs()
        self.frame = Frame()
        self.tally = Tally()
        self.odometry = Odometry()
        self.uwb = Uwb()
        self.localization = Localization(self.odometry, self.uwb, self.frame)
        self.last_fix = 0; self.last_state = 0
        self.infrared = Infrared(self.hits)
        self.ir_state_machine = IrState()
        self.follower = Follower(self.hits)
        self.explorer = Explorer(self.odometry, self.hits, self.infrared, self.ir_state_machine, self.follower)
        self.walls = WallMapper(self.vectors, self.frame)
        self.session = 0
        self.session_chain = 0
        n = 0
        for p in PARAMETERS:
            n += p[2]
        self.params = array("i", bytes(4 * n))
        self.first = array("H", bytes(2 * len(PARAMETERS)))
        n = 0
        for i in range(len(PARAMETERS)):
            self.first[i] = n
            for k in range(PARAMETERS[i][2]):
                self.params[n] = PARAMETERS[i][5]
                n += 1
        self.tick = 0
        self.left_mm_s = self.right_mm_s = self.state = 0

    def p(self, name, k=0):
        for i in range(len(PARAMETERS)):
            if PARAMETERS[i][0] == name:
                return self.params[self.first[i] + k]

    def set_parameter(self, i, k, v):
        self.params[self.first[i] + k] = v
        return 0

    def begin(self):
        p = self.p
        self.odometry.begin(p("dock_x"), p("dock_y"), p("dock_heading"), p("wheel_diameter"), p("track"), p("pulses_per_turn"))
        for i in range(len(PARAMETERS)):
            if PARAMETERS[i][0] == "ir_bearing":
                self.infrared.begin(p("ir_radius"), self.params, self.first[i])
        self.explorer.begin(p("body_radius"), p("wall_gap"), p("speed_max"), p("turn_max"), p("track"))
        idx = {q[0]: self.first[i] for i, q in enumerate(PARAMETERS)}
        self.uwb.begin(p("uwb_source"), p("anchor_count"), self.params, idx["anchor_x"], idx["anchor_y"], idx["anchor_height"], p("uwb_level_1m"), p("uwb_level_min"), p("uwb_gamma"), p("uwb_sigma"))
        self.localization.begin(p("fix_distance"), p("fix_angle"))
        self.threshold = p("ir_threshold")

    def step(self, v):
        o = self.odometry
        self.tick += 1
        o.update(v[1], v[2])
        x = o.x_um // 1000
        y = o.y_um // 1000
        self.infrared.update(v, 3, x, y, o.heading_bam, self.tick)
        self.ir_state_machine.update(self.infrared.ranges_mm, self.threshold)
        e = self.explorer
        self.localization.update(v, 13)
        if (e.state != self.last_state and e.state in (5, 6)) or o.path_mm - self.last_fix > 1500:
            if o.path_mm - self.last_fix > 100:
                self.localization.fix()
                self.last_fix = o.path_mm
        self.last_state = e.state
        e.step(self.tick, v[11], v[12])
        if e.started:
            self.session = self.vectors.used
            self.session_chain = self.vectors.chains
            self.crumbs.clear(o.path_mm, o.turn_bam)
            self.walls.kind = 0
        if e.abandoned:
            self.walls.finish()
            self.vectors.drop(self.session, self.vectors.used)
        if e.mapping:
            if self.infrared.ranges_mm[5] < 250:
                self.walls.add(self.infrared.hit_x[5], self.infrared.hit_y[5])
            r = self.crumbs.visit(self.localization.x_mm, self.localization.y_mm, self.localization.heading_bam, o.turn_bam, o.path_mm, self.vectors.used, 150)
            if r == ISLAND_CLOSED:
                self.walls.finish()
                for c in range(self.session_chain, self.vectors.chains):
                    self.vectors.kinds[c] = 5
                e.leave()
            elif r == OUTLINE_CLOSED:
                self.walls.finish()
                self.vectors.drop(self.session, self.crumbs.vectors[self.crumbs.closed_at])
                e.state = DONE
                e.motion.stop()
        self.left_mm_s = e.motion.left_mm_s
        self.right_mm_s = e.motion.right_mm_s
        self.state = e.state
