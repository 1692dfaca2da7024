# The whole SLAM: owns the storage, runs the layers once a step. The only file that joins them.

from .building.builder import Builder
from .building.closure import Closure
from .building.outline import Outline, CLOSING, ISLAND, STRAY, STALE, DONE as OUTLINE_DONE
from .building.partition import Partition
from .building.sight import Sight
from .building.tidy import Tidy
from .building.topology import Topology
from .building.walls import WallMapper
from .building.way import Way
from .collection.explorer import Explorer
from .collection.follower import Follower
from .collection.infrared import Infrared
from .collection.ir_state import IrState
from .collection.landmarks import Landmarks
from .collection.localization import Localization
from .collection.odometry import Odometry
from .collection.relocation import Relocation, FOUND, SEEKING
from .collection.search import Search
from .collection.sensor_watch import SensorWatch
from .collection.states import SELECT, SWEEP, BUILD, BUMP, FAILED, DONE, STUCK, LOST, SAVE
from .collection.states import REASON_CLOSED, REASON_NO_WALL, REASON_STORE_FULL, REASON_STUCK, REASON_TOO_LONG, REASON_LOST
from .collection.turning_points import TurningPoints
from .collection.uwb import Uwb
from .parameters import Parameters
from .record import Record
from .storage.barrier_list import BarrierList
from .storage.breadcrumbs import Breadcrumbs
from .storage.frame import Frame
from .storage.hit_ring import HitRing
from .storage.map_image import MapImage
from .storage.point_ring import PointRing
from .storage.region_graph import RegionGraph
from .storage.slots import Slots
from .storage.tally import Tally
from .storage.vector_store import VectorStore

# STATUS_RSP.degraded: which store ran full; the map is not kept; the bits between are sensor_watch.py's
DEGRADED_VECTORS = 1
DEGRADED_CHAINS = 2
DEGRADED_TOPOLOGY = 4
DEGRADED_SEARCH = 8
DEGRADED_STORAGE = 256

_IR = const(3)               # where things stand in the values of a STEP
_SONAR = const(11)
_BUMP = const(12)
_UWB = const(13)
_SIDE = const(5)             # I6, the mapping beam
_SIDE_MAX_MM = const(250)
_PAST_MM = const(1000)
_STRIFE = const(20)          # reports that contradict the estimate: 2 s
_PATH_MAX_MM = const(1500000)   # along one outline; then from one target to the next, of which there are so many and no more

# bits of parameter `flags`, protocol/parameters.py
_MIDPOINT = const(1)
_WALL_OFFSET = const(2)
_CORNERS = const(4)
_SPREAD = const(8)
_DISTANCE_FIXES = const(16)
_WEIGHTED = const(32)
_EQ1_LITERAL = const(64)
_FILTER = const(128)
_CALIBRATE = const(256)
_MANHATTAN = const(512)
_LANDMARKS = const(1024)
_SHADOWING = const(2048)
_KIDNAP = const(4096)


class Tvslam:
    # Tvslam() allocates everything; set_parameter(...); begin(); then step(values) once a tick, values as
    # STEP decodes (protocol/schema.py). Each step leaves left_mm_s, right_mm_s, state, ir_state, hash_lo,
    # hash_hi. finished, reason, degraded tell how the mission ended. step() allocates nothing and never raises.

    def __init__(self):
        self.left_mm_s = 0
        self.right_mm_s = 0
        self.state = 0
        self.ir_state = 0
        self.hash_lo = 0
        self.hash_hi = 0
        self.tick = 0
        self.finished = False
        self.reason = 0
        self.degraded = 0
        self._flags = 0
        self._since_mm = 0
        self._then = 0        # the state after SAVE
        self.vectors = VectorStore()
        self.hits = HitRing()
        self.points = PointRing()
        self.crumbs = Breadcrumbs()
        self.sight = Sight(self.vectors)
        self.graph = RegionGraph()
        self.tidy = Tidy(self.vectors)
        self.partition = Partition(self.vectors, self.sight, self.graph)
        self.topology = Topology(self.vectors, self.sight, self.graph, self.partition)
        self.way = Way(self.vectors, self.sight, self.graph, self.topology)
        self.search = Search(self.vectors, self.sight, BarrierList(), self.way, self.graph.shared)
        self.image = MapImage(self.vectors, self.graph, self.crumbs)
        self.frame = Frame()
        self.tally = Tally()
        self.parameters = Parameters()
        self.odometry = Odometry()
        self.uwb = Uwb()
        self.localization = Localization(self.odometry, self.uwb, self.frame)
        self.watch = SensorWatch()
        self.infrared = Infrared(self.hits)
        self.landmarks = Landmarks(self.vectors, self.sight, self.infrared, self.frame)
        self.directions = IrState()
        self.follower = Follower(self.hits)
        self.explorer = Explorer(self.odometry, self.hits, self.infrared, self.directions, self.follower,
                                 self.localization)
        self.relocation = Relocation(self.odometry, self.uwb, self.localization, self.hits, self.infrared, self.follower,
                                     self.explorer)
        self.walls = WallMapper(self.vectors, self.frame)
        self.turning_points = TurningPoints(self.points, self.walls, self.localization)
        self.closure = Closure(self.vectors)
        self.outline = Outline(self.vectors, self.crumbs, self.image, self.walls, self.closure, self.sight)
        self.builder = Builder(self.outline, self.tidy, self.partition, self.topology)
        self.record = Record(self)
        self.slots = Slots(self.record, self.parameters)

    def set_parameter(self, number, index, value):
        return self.parameters.set(number, index, value)

    def begin(self):
        # Parameters are taken over and locked: the mission starts.
        p = self.parameters
        p.locked = True
        flags = p.of("flags")
        if p.of("mode"):
            flags &= _EQ1_LITERAL
        self._flags = flags if flags & _FILTER else flags & ~_KIDNAP
        track_um = p.of("track")
        self.odometry.begin(p.of("dock_x"), p.of("dock_y"), p.of("dock_heading"), p.of("wheel_diameter"),
                            track_um // 2 if flags & _EQ1_LITERAL else track_um, p.of("pulses_per_turn"), flags & _MIDPOINT)
        self.infrared.begin(p.of("ir_radius"), p.values, p.first("ir_bearing"))
        self.explorer.begin(p.of("body_radius"), p.of("wall_gap"), p.of("speed_max"), p.of("turn_max"), track_um)
        self.uwb.begin(p, flags & _WEIGHTED, flags & _FILTER)
        self.localization.begin(p.of("fix_distance"), p.of("fix_angle"), flags & _WEIGHTED, flags & _FILTER,
                                flags & _CALIBRATE, flags & _MANHATTAN, flags & _SHADOWING)
        self.relocation.begin(p)
        self.landmarks.on = flags & _LANDMARKS and flags & _FILTER
        self.turning_points.between = flags & _DISTANCE_FIXES
        self.walls.begin(flags & _CORNERS)
        self.builder.begin(p.of("body_radius"))
        self.outline.spread = flags & _SPREAD != 0
        self.directions.threshold_mm = p.of("ir_threshold")
        self.watch.begin(p.of("uwb_source") > 0 and p.of("anchor_count") > 0, self.uwb.scope, self.odometry)
        if self.slots.begin():
            self.record.resume()

    def step(self, values):
        o = self.odometry
        e = self.explorer
        self.tick = self.tick + 1 & 0xFFFFFFF
        o.update(values[1], values[2])
        x_mm = o.x_um // 1000
        y_mm = o.y_um // 1000
        self.degraded |= self.watch.look(values, self.tick, o, self.localization, self.left_mm_s, self.right_mm_s)
        self.infrared.update(values, _IR, x_mm, y_mm, o.heading_bam, self.tick)
        self.directions.update(self.infrared.ranges_mm)
        if e.state == LOST:
            self._relocate(values)
        else:
            self.localization.update(values, _UWB)
            if self.uwb.strife >= _STRIFE and self._flags & _KIDNAP and (e.state < BUILD or e.state == BUMP or e.state == STUCK):
                self._lose()
            else:
                e.step(self.tick, values[_SONAR], values[_BUMP])
        if e.started:
            self.outline.begin(o.path_mm, self.localization.turn_bam)
        elif e.abandoned:
            self.outline.abandon()
        if e.inside:
            self._look_inside(values[_SONAR])
        if e.mapping:
            self._map(x_mm, y_mm)
        if e.state == BUILD:
            if self.builder.step():
                self._sealed()
        elif e.state == SAVE:
            if self.outline.settled() and self.slots.save():
                e.state = self._then
        elif e.state == FAILED and not self.reason:
            self._end(REASON_STUCK, e.inside)  # what is known of the home is built all the same
        elif o.path_mm - self._since_mm > _PATH_MAX_MM and e.state < BUILD:
            self._end(REASON_TOO_LONG if e.mapping or self.vectors.used else REASON_NO_WALL, e.inside)
        self.left_mm_s = e.motion.left_mm_s
        self.right_mm_s = e.motion.right_mm_s
        self.state = e.state
        self.ir_state = self.directions.state
        self.tally.step(self)

    def _lose(self):
        # The robot was carried away. Of the barrier that it followed nothing counts: where that would go on nobody knows.
        e = self.explorer
        if e.mapping:
            self.outline.abandon()
        e.started = False
        e.abandoned = False
        self.search.forget()
        e.end(LOST)
        self.relocation.lose()

    def _relocate(self, values):
        said = self.relocation.step(values, _UWB, self.tick, values[_SONAR], values[_BUMP])
        if said == FOUND:
            self.explorer.leave()
        elif said != SEEKING:
            self._end(REASON_LOST, self.explorer.inside)

    def _sealed(self):
        self.tally.mix(self.image.crc[0])
        self.tally.mix(self.image.crc[1])
        if self.graph.lost:
            self.degraded |= DEGRADED_TOPOLOGY
        if self.slots.lost():
            self.degraded |= DEGRADED_STORAGE
        self.explorer.end(DONE)

    def _save(self):
        # Where there is a memory, the robot stands until what is mapped by now is in it, and then does what it was about to do.
        if self.slots.ready and self.explorer.state != FAILED:
            self._then = self.explorer.state
            self.explorer.end(SAVE)

    def _map(self, x_mm, y_mm):
        e = self.explorer
        o = self.odometry
        self.turning_points.visit(e.state, o.path_mm)
        if self.infrared.ranges_mm[_SIDE] < _SIDE_MAX_MM:
            self.localization.wall(self.infrared.hit_x[_SIDE], self.infrared.hit_y[_SIDE])
            if self._flags & _WALL_OFFSET:
                x_mm = self.infrared.hit_x[_SIDE]
                y_mm = self.infrared.hit_y[_SIDE]
            self.frame.put(x_mm, y_mm)
            self.outline.add(x_mm, y_mm, self.frame.x, self.frame.y)
        if e.arcing:
            return  # no wall here: no loop can close
        came = self.outline.visit(self.localization, o.path_mm, self.localization.turn_bam)
        if came == CLOSING:
            e.closing = True
        elif came == OUTLINE_DONE:
            self.outline.finish()
            self.localization.closed(self.closure.x_mm, self.closure.y_mm)
            e.inside = True
            e.leave()
        elif came == STALE or came == ISLAND:
            if came == STALE:
                self.outline.give_up()
            e.leave()
        elif came == STRAY:
            e.be_wary(self.outline.loop_mm + _PAST_MM)
        elif self.vectors.lost or self.vectors.chains_lost:
            self._end(REASON_STORE_FULL, True)
        if e.state == SELECT and self.record.news():
            self._save()

    def _look_inside(self, sonar_mm):
        # The outline is known. What else stands here?
        e = self.explorer
        s = self.search
        if e.state == SELECT:
            self._since_mm = self.odometry.path_mm
            self.turning_points.visit(SELECT, self.odometry.path_mm)
            if self.outline.settled() and s.select(e, self.localization):
                self._end(REASON_CLOSED, True)
            return
        if e.state > SWEEP:
            return
        j = self.tick & 7
        if j == 0:
            s.passing(self.localization)
        if not e.mapping:
            self.turning_points.visit(e.state, self.odometry.path_mm)
        if self.landmarks.on:
            self.landmarks.look(self.localization, self.odometry.path_mm, -1 if e.mapping else j, sonar_mm)
        if self.infrared.ranges_mm[j] < _SIDE_MAX_MM and not (e.mapping and j == _SIDE):
            self.frame.put(self.infrared.hit_x[j], self.infrared.hit_y[j])
            s.note(self.frame.x, self.frame.y, e)

    def _end(self, reason, good):
        # In good order: what is mapped is finished, built and sealed.
        self.outline.finish()
        self.reason = reason
        self.finished = good
        if self.vectors.lost:
            self.degraded |= DEGRADED_VECTORS
        if self.vectors.chains_lost:
            self.degraded |= DEGRADED_CHAINS
        if self.explorer.inside and (reason != REASON_CLOSED or not self.search.complete()):
            self.degraded |= DEGRADED_SEARCH
        self.explorer.end(BUILD if good else FAILED)
        self._save()
