# From a wanted heading to the speeds of the two wheels.

_GAIN = const(479)           # mrad/s a 1000 BAM of error: 5 rad/s a radian
_SLOW_BAM = const(7282)      # 40 degrees of error: turn on the spot
_CREEP_MM_S = const(40)
_BRAKE = const(3)            # mm/s of speed a millimetre of free way
_SONAR_MM = const(400)


class Motion:
    # left_mm_s, right_mm_s: what the last call asked for, within speed_max and turn_max.

    def __init__(self):
        self.left_mm_s = 0
        self.right_mm_s = 0
        self._speed = 300
        self._turn = 2000
        self._half_track_um = 117500

    def begin(self, speed_mm_s, turn_mrad_s, track_um):
        self._speed = speed_mm_s
        self._turn = turn_mrad_s
        self._half_track_um = track_um // 2

    def head(self, error_bam, gap_mm, ultrasonic_mm):
        # Turn by error_bam (left positive, unwrapped), as fast as error and free way allow.
        size = error_bam if error_bam >= 0 else -error_bam
        speed = 0
        if size < _SLOW_BAM:
            speed = self._speed * (_SLOW_BAM - size) // _SLOW_BAM
            free = _CREEP_MM_S + _BRAKE * (gap_mm if gap_mm > 0 else 0)
            if speed > free:
                speed = free
            if 0 < ultrasonic_mm < _SONAR_MM and speed > 200:
                speed = 200
        turn = error_bam if size < 8000 else 8000 if error_bam > 0 else -8000
        self.drive(speed, turn * _GAIN // 1000)

    def arc_right(self, radius_mm):
        speed = self._speed // 2
        self.drive(speed, -(speed * 1000 // radius_mm))

    def drive(self, speed_mm_s, turn_mrad_s):
        if turn_mrad_s > self._turn:
            turn_mrad_s = self._turn
        elif turn_mrad_s < -self._turn:
            turn_mrad_s = -self._turn
        rim = turn_mrad_s * (self._half_track_um // 100) // 10000
        self.left_mm_s = speed_mm_s - rim
        self.right_mm_s = speed_mm_s + rim

    def stop(self):
        self.left_mm_s = 0
        self.right_mm_s = 0
