# Direction control (Paper 3.1, Fig. 2): the state machine that drives the robot round the outline.

from ..fixed import isqrt
from .bumper import Bumper, KNOWN, OFTEN
from .follower import NO_WALL, BOXED_IN
from .ir_state import TURN_LEFT, TURN_RIGHT, FREE, ENCLOSED_TURN
from .motion import Motion
from .states import INIT, FIND_WALL, ALIGN, FOLLOW, CORNER_IN, CORNER_OUT, CLOSE_CHECK, SELECT, GOTO, SWEEP, BUILD, BUMP, FAILED, STUCK
from .traveller import Traveller, AT_WALL, LOST
from .wall_end import WallEnd

_WINDOW_FOLLOW = const(3641)    # the reference lies from -200 to +20 degrees ...
_WINDOW_ALIGN = const(29100)    # ... but any wall will do to align with
_ALIGNED_BAM = const(2731)      # 15 degrees
_FRONT_MM = const(50)           # free way left when FIND_WALL calls it a wall
_SPIRAL_MM = const(20000)       # straight that far without a wall: spiral
_SPIRAL = const(73)             # 73 sqrt(256 s / mm) BAM = sqrt(4 pi s / m) rad: one metre wider each turn
_ARC_BAM = const(72818)         # 400 degrees: of arc without a wall, or to the left inside a pocket
_CLOSE_MM = const(8)
_BOXED_TICKS = const(400)       # 8 s
_WATCH_TICKS = const(150)       # 3 s: less than 4 cm in that time is dithering before a gap
_WATCH_MM = const(40)
_WARY_MM = const(24)            # wary: every gap under 45 cm is a wall
_WARY_PATH_MM = const(1500)
_STUCK_MAX = const(6)


class Explorer:
    # step() reads the sensors' interpreters and leaves left_mm_s, right_mm_s, state.
    # mapping: the mapping beam's hit belongs to the wall that is followed.
    # started, abandoned: set for the one tick in which a barrier's following begins / is given up.
    # Writes: the hit ring (bumps), Follower.disc_mm, tight_mm. Allocates nothing after __init__.

    def __init__(self, odometry, hits, infrared, ir_state, follower, here):
        self.state = INIT
        self.mapping = False
        self.closing = False      # the outline is closed; the overlap is walked for the closure error
        self.started = False
        self.abandoned = False
        self.inside = False       # the outline is known: what is left are the barriers inside
        self.outcome = 0          # of the last way gone (traveller.py)
        self.motion = Motion()
        self.bumper = Bumper(odometry, hits, follower, self.motion)
        self.traveller = Traveller()
        self._wall_end = WallEnd()
        self._here = here
        self.stuck = 0
        self.walls_tried = 0
        self._odometry = odometry
        self._hits = hits
        self._infrared = infrared
        self._ir_state = ir_state
        self._follower = follower
        self._disc_mm = 200
        self._resume = FIND_WALL
        self._leg_mm = 0          # path at the start of the present straight, arc or back-off
        self._leg_turn = 0
        self._course_turn = 0     # unwrapped heading to keep: FIND_WALL's, or the follower's last
        self._course_held = False
        self._sonar_mm = 0
        self.arcing = False       # no hit to roll along: round to the right until there is one
        self._looked_turn = 0
        self._ticks = 0
        self._boxed = 0
        self._wary_to_mm = 0      # path up to which no narrow passage is entered
        self._watch_tick = 0
        self._watch_mm = 0
        self._bump_held = False

    def begin(self, body_mm, gap_mm, speed_mm_s, turn_mrad_s, track_um):
        self._disc_mm = body_mm + gap_mm
        self._follower.body_mm = body_mm
        self._follower.disc_mm = self._disc_mm
        self.motion.begin(speed_mm_s, turn_mrad_s, track_um)

    def step(self, tick, ultrasonic_mm, bump):
        o = self._odometry
        f = self._follower
        state = self.state
        self.started = False
        self.abandoned = False
        if tick & 1:
            f.look(o.x_um // 1000, o.y_um // 1000, o.heading_bam, _WINDOW_FOLLOW if self.mapping else _WINDOW_ALIGN)
            self._looked_turn = o.turn_bam
        self._infrared.erase(tick & 7, f, tick)
        if state >= BUILD and state != BUMP and state != STUCK:
            self.motion.stop()
            return
        if ultrasonic_mm:
            self._sonar_mm = ultrasonic_mm  # it reports in one tick of three: hold it
        ultrasonic_mm = self._sonar_mm
        if bump and not self._bump_held and state != BUMP and state != STUCK:
            self._bumped(tick, bump)
            self.motion.stop()
        elif state == BUMP or state == STUCK:
            if self.bumper.back_off():
                self.state = self._resume
        elif state <= FIND_WALL:
            self._find_wall(tick, ultrasonic_mm)
            if self.state == INIT and tick > 1:
                self.state = FIND_WALL
        elif state == SELECT:
            self.motion.stop()
            self._watch_tick = tick  # who stands and plans is not held up
            self._watch_mm = o.path_mm
        elif GOTO <= state <= SWEEP:
            self._travel(tick, ultrasonic_mm)
        else:
            self._roll(tick, ultrasonic_mm)
        self._bump_held = bump != 0

    def leave(self):
        # The barrier is done with and was not the outline: look for another wall, away from it.
        # The course changes from try to try, so that no pair of islands can hold the robot.
        self.walls_tried = self.walls_tried + 1 & 0xFFFF
        self.mapping = False
        self.closing = False
        self.arcing = False
        self._start_leg()
        self._course_turn = self._odometry.turn_bam + 14000 - (self.walls_tried * 5461 & 0x3FFF)
        self.state = SELECT if self.inside else FIND_WALL

    def halt(self):
        # Whoever is on his way stops, and waits for something else to do.
        self.motion.stop()
        self.state = SELECT

    def go_to(self, x_mm, y_mm, wall, state):
        # state: GOTO to a barrier, SWEEP to a place that nobody has seen.
        self.traveller.begin(x_mm, y_mm, wall)
        self._course_held = False
        self.outcome = 0
        self.state = state

    def end(self, state):
        self.state = state
        self.mapping = False
        self.closing = False
        self.motion.stop()

    def _start_leg(self):
        self._leg_mm = self._odometry.path_mm
        self._leg_turn = self._odometry.turn_bam
        self._ticks = 0

    def _find_wall(self, tick, ultrasonic_mm):
        o = self._odometry
        f = self._follower
        if self.state == INIT:
            self._start_leg()
            self._course_turn = o.turn_bam
        error = self._course_turn - o.turn_bam
        far = o.path_mm - self._leg_mm
        if far > _SPIRAL_MM:
            # Archimedean, by the way made: who must turn on the spot first is waited for.
            error += isqrt(far - _SPIRAL_MM << 8) * _SPIRAL
        if f.gap_mm < _FRONT_MM and -3000 < error < 3000:
            self._start_leg()
            self.state = ALIGN
            return
        if not self._watch(tick):
            self.motion.head(error, f.gap_mm, ultrasonic_mm)

    def _travel(self, tick, ultrasonic_mm):
        o = self._odometry
        t = self.traveller
        if not tick & 1:
            said = t.step(self._here, self._follower, o.path_mm)
            if said:
                if said != LOST:
                    self.stuck = 0  # out of whatever it was
                self.outcome = said
                self.motion.stop()
                self._start_leg()
                self.state = ALIGN if said == AT_WALL else SELECT
                return
            if not t.around:
                self._leg_turn = o.turn_bam
                self._course_turn = self._looked_turn + t.heading_bam
                self._course_held = True
        if t.around:
            self._roll(tick, ultrasonic_mm)
        elif self._course_held and not self._watch(tick):
            self.motion.head(self._course_turn - o.turn_bam, self._follower.gap_mm, ultrasonic_mm)

    def _roll(self, tick, ultrasonic_mm):
        f = self._follower
        o = self._odometry
        f.disc_mm = self._disc_mm + self.bumper.keep_off_mm()
        f.tight_mm = f.body_mm + 4
        if self.state >= GOTO and o.turn_bam - self._leg_turn > _ARC_BAM:
            f.disc_mm = f.body_mm + _CLOSE_MM  # round the inside of a pocket: out by the gap that let it in
        if self._watch(tick):
            return
        if o.path_mm < self._wary_to_mm:
            f.disc_mm += _WARY_MM
            f.tight_mm = f.disc_mm
        if tick & 1:
            # Looked only; the solution comes in the next tick, the course goes on.
            if self._course_held:
                self.motion.head(self._course_turn - o.turn_bam, f.gap_mm, ultrasonic_mm)
            return
        heading = f.solve()
        self._course_held = heading < NO_WALL
        if heading == BOXED_IN:
            self.motion.stop()
            self._boxed += 2
            if self._boxed > _BOXED_TICKS:
                self._boxed = 0
                self._got_stuck()
            return
        if self._boxed:
            self._boxed -= 2
        if heading == NO_WALL:
            if self.state >= GOTO:
                self.traveller.around = False
                return
            if not self.arcing:
                self._start_leg()
            self.arcing = True
            self.state = CORNER_OUT
            self.motion.arc_right(self._disc_mm)
            if self._leg_turn - o.turn_bam > _ARC_BAM:
                self.abandoned = self.mapping  # before that nothing was begun
                self.leave()
            return
        self.arcing = False
        self._course_turn = self._wall_end.limit(o, f, self._looked_turn, self._looked_turn + heading)
        heading = self._course_turn - o.turn_bam
        self.motion.head(heading, f.gap_mm, ultrasonic_mm)
        if self.mapping:
            self._mode()
        elif self.state < GOTO:
            self._align(heading)

    def _watch(self, tick):
        # A gap that is just passable can look open and shut in turn. Decide: it is shut, for a while.
        # -> True when that did not help: stuck
        o = self._odometry
        if tick - self._watch_tick < _WATCH_TICKS:
            return False
        stuck = False
        if o.path_mm - self._watch_mm < _WATCH_MM and not self._boxed:
            if o.path_mm < self._wary_to_mm:
                stuck = True
                self._got_stuck()
            self.be_wary(_WARY_PATH_MM)
        self._watch_tick = tick
        self._watch_mm = o.path_mm
        return stuck

    def be_wary(self, path_mm):
        self._wary_to_mm = self._odometry.path_mm + path_mm

    def _align(self, heading):
        f = self._follower
        self.state = ALIGN
        if -_ALIGNED_BAM < heading < _ALIGNED_BAM and f.reference_bearing < 0:
            self._ticks += 1
        else:
            self._ticks = 0
        if self._ticks > 2:
            self.mapping = True
            self.started = True
            self.state = FOLLOW

    def _mode(self):
        if self.closing:
            self.state = CLOSE_CHECK
            return
        action = self._ir_state.action
        if action == TURN_LEFT or action == ENCLOSED_TURN:
            self.state = CORNER_IN
        elif action == TURN_RIGHT or action == FREE:
            self.state = CORNER_OUT
        else:
            self.state = FOLLOW

    def _bumped(self, tick, bump):
        if self.state <= FIND_WALL:
            self._start_leg()
            self.state = ALIGN
        said = self.bumper.touch(tick, bump)
        if said == OFTEN:
            self._got_stuck()
        elif said != KNOWN:
            self._resume = self.state
            self.state = BUMP

    def _got_stuck(self):
        self._hits.clear()
        self.stuck += 1
        if self.stuck > _STUCK_MAX:
            self.end(FAILED)
            return
        self._resume = FOLLOW if self.mapping else SELECT if self.inside else ALIGN
        self.outcome = LOST
        self.bumper.begin()
        self.state = STUCK
