# What the core tells without being asked: one small frame a step, each kind in its turn.

from protocol.tables import POSE, VECTOR, POINT, LINK, MEMORY

from .inventory import STORES

_LINK_COUNTERS = const(13)


class Telemetry:
    # after_step() sends at most one frame, so that no step carries more than one: of five steps the last
    # tells POSE (10 Hz), others what is new of vectors and points. Twice a second a vector goes out again,
    # so that a late viewer sees the whole map, as do the link's counts; five times a second a store, each 5 s
    # the memory. The long frames go where a step has least to do: a store in every second step with a UWB
    # report, where the follower only looks.

    def __init__(self, core, device):
        self._core = core
        self._device = device
        self._store = 0
        self._vector = 0       # next one never sent
        self._again = 0
        self._points = 0

    def after_step(self, step):
        phase = step % 5
        if phase == 0:
            if step % 10 == 0:
                return
            self._device.send_store(self._store)
            self._store = self._store + 1 if self._store + 1 < STORES else 0
        elif phase == 1:
            self._point()
        elif phase == 2:
            self._next_vector(step % 25 == 2)
        elif phase == 3:
            if step % 250 == 3:
                self._device.send_memory(MEMORY)  # seldom: to count what is used, the whole heap is walked
            elif step % 25 == 3:
                self.tell_link()
        else:
            self._pose(step)

    def _pose(self, step):
        core = self._core
        o = core.odometry
        here = core.localization
        out = self._device.link.out
        out[0] = step
        out[1] = here.x_mm * 1000 if -500000 < here.x_mm < 500000 else 0
        out[2] = here.y_mm * 1000 if -500000 < here.y_mm < 500000 else 0
        out[3] = here.heading_bam
        out[4] = o.x_um
        out[5] = o.y_um
        out[6] = o.heading_bam
        out[7] = core.state
        out[8] = core.ir_state
        out[9] = o.path_mm
        out[10] = core.points.count
        out[11] = core.vectors.used
        out[12] = here.fixes
        out[13] = core.explorer.bumper.bumps
        self._device.send(POSE)

    def _next_vector(self, again):
        v = self._core.vectors
        if self._vector > v.used:
            self._vector = 0     # a stray was dropped: tell all again
        i = self._vector
        if i + 1 < v.used:
            self._vector = i + 1
        elif again and v.used > 1:
            i = self._again if self._again < v.used else 0
            self._again = i + 1
        else:
            return
        end = v.next_of(i)
        if end < 0:
            return
        chain = v.chain_of(i)
        out = self._device.link.out
        out[0] = i
        out[1] = chain
        out[2] = v.kinds[chain]
        out[3] = v.xs[i]
        out[4] = v.ys[i]
        out[5] = v.xs[end]
        out[6] = v.ys[end]
        out[7] = v.sigmas[i]
        self._device.send(VECTOR)

    def tell_link(self):
        link = self._device.link
        for i in range(_LINK_COUNTERS):
            link.out[i] = link.counters[i]
        self._device.send(LINK)

    def _point(self):
        p = self._core.points
        if self._points == p.count:
            return
        i = self._points % p.CAPACITY
        if (p.count - self._points & 0xFFFF) > p.CAPACITY:
            self._points = p.count - p.CAPACITY & 0xFFFF
            i = self._points % p.CAPACITY
        self._points = self._points + 1 & 0xFFFF
        out = self._device.link.out
        out[0] = p.orders[i]
        out[1] = p.kinds[i]
        out[2] = p.xs[i]
        out[3] = p.ys[i]
        out[4] = p.headings[i]
        self._device.send(POINT)
