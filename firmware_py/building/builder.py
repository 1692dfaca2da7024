# The end of a mission: what is mapped becomes rooms, ways, and the bytes of the map.

_ROOM_MM = const(10)    # beside the body, on a way of the topology


class Builder:
    # begin(body_radius_mm), then step() once a tick until True: long work in slices, from the closure error to the sealed image.
    # Allocates in __init__ only.

    def __init__(self, outline, tidy, partition, topology):
        self._outline = outline
        self._tidy = tidy
        self._partition = partition
        self._topology = topology
        self._margin = 36       # what a way of the topology keeps free on either side, in 5 mm
        self._stage = 0

    def begin(self, body_radius_mm):
        self._margin = (body_radius_mm + _ROOM_MM) // 5

    def step(self):
        if self._stage == 0:
            if self._outline.settled() and self._tidy.step():
                self._partition.begin()
                self._stage = 1
        elif self._stage == 1:
            if self._partition.step():
                self._topology.begin(self._margin)
                self._stage = 2
        elif self._stage == 2:
            if self._topology.step():
                self._stage = 3
        else:
            return self._outline.build()
        return False
