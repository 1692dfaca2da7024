# Maps for the tests of partition and topology: home files and generated floors as vector stores.

import math
import random

from tests.firmware_py.watched import watched

storage, graph_module, sight_module, partition_module, topology_module, way_module, image_module, crumbs_module = watched(
    "firmware_py.storage.vector_store", "firmware_py.storage.region_graph", "firmware_py.building.sight",
    "firmware_py.building.partition", "firmware_py.building.topology", "firmware_py.building.way",
    "firmware_py.storage.map_image", "firmware_py.storage.breadcrumbs",
)
UNIT_M = 0.005


class Floor:
    """A map in metres, built into regions and ways: outline and barriers counter-clockwise, as home files have them."""

    def __init__(self, outline, barriers=(), margin_mm=180):
        self.store = storage.VectorStore()
        self.graph = graph_module.RegionGraph()
        self.sight = sight_module.Sight(self.store)
        self._chain(outline, 4)
        for ring in barriers:
            self._chain(ring[::-1], 5)
        self.partition = partition_module.Partition(self.store, self.sight, self.graph)
        self.topology = topology_module.Topology(self.store, self.sight, self.graph, self.partition)
        self.way = way_module.Way(self.store, self.sight, self.graph, self.topology)
        self.margin = margin_mm // 5

    def _chain(self, ring, kind):
        self.store.open_chain(kind)
        for (x, y), (x1, y1) in zip(ring, [*ring[1:], ring[0]], strict=True):
            long = storage.LONG if math.dist((x, y), (x1, y1)) >= 1 else 0
            self.store.append(round(x / UNIT_M), round(y / UNIT_M), 3, long)

    def build(self):
        self.partition.begin()
        self.ticks = work(self.partition)
        self.topology.begin(self.margin)
        self.ticks += work(self.topology)
        return self

    def region_of(self, x, y):
        return self.partition.region_of(round(x / UNIT_M), round(y / UNIT_M))

    def areas_m2(self):
        return [self.graph.regions[6 * r + graph_module.AREA] / 100 for r in range(self.graph.region_count)]

    def nodes(self):
        g = self.graph
        return [(g.at(2 * n), g.at(2 * n + 1)) for n in range(g.node_count)]

    def edges(self):
        """[(node, node, region, cm)]"""
        found, nodes = [], self.nodes()
        for n, place in enumerate(nodes):
            about = self.graph.shared[graph_module.ABOUT + n]
            for k in range(about & 255, (about & 255) + (about >> 8)):
                to = self.graph.shared[graph_module.EDGES + k]
                found.append((n, to & 255, to >> 8, cost_cm(place, nodes[to & 255])))
        return found

    def way_cm(self, a, b):
        """The straight way between two places in map units, None if it is not free."""
        return cost_cm(a, b) if self.sight.free(*a, *b, self.margin) else None


def image_of(store, graph):
    """map.bin, as the device would send it."""
    image = image_module.MapImage(store, graph, crumbs_module.Breadcrumbs())
    image.begin()
    work_for(image)
    return bytes(image.byte(i) for i in range(image.size))


def work_for(image, pieces=7):
    while not image.step(pieces):
        pass


def cost_cm(a, b):
    return (math.isqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2) + 2) >> 1


def work(worker, limit=60000):
    for tick in range(limit):
        if worker.step():
            return tick
    raise AssertionError("it never ends")


def rooms_in_a_row(widths, door_m, wall_m=0.1, height=3.0, at=0.5):
    """Rooms side by side, a doorway between each two: one ring, counter-clockwise. -> (outline, centres)"""
    below, above, centres = [], [], []
    x = 0.0
    low = at * (height - door_m)
    for k, width in enumerate(widths):
        centres.append((x + width / 2, height / 2))
        if k:
            below += [(x - wall_m, 0), (x - wall_m, low), (x, low), (x, 0)]
            above += [(x - wall_m, height), (x - wall_m, low + door_m), (x, low + door_m), (x, height)]
        x += width + wall_m
    return [(0, 0), *below, (x - wall_m, 0), (x - wall_m, height), *above[::-1], (0, height)], centres


def varied(seed, noise_m, outline, barriers, places):
    """Turned by any angle, mirrored or not, every vertex moved a little. -> the same three"""
    luck = random.Random(seed)
    angle, mirror = luck.uniform(0, 2 * math.pi), luck.choice((-1, 1))
    cos, sin = math.cos(angle), math.sin(angle)

    def turned(place):
        x, y = place[0] * mirror, place[1]
        return x * cos - y * sin, x * sin + y * cos

    def ring(vertices):
        moved = [(x + luck.uniform(-noise_m, noise_m), y + luck.uniform(-noise_m, noise_m)) for x, y in map(turned, vertices)]
        return moved[::-1] if mirror < 0 else moved

    return ring(outline), [ring(b) for b in barriers], [turned(place) for place in places]
