# Short missions in this process on a virtual clock: robot, faulty link, and the core that the product has.

import functools
import sys

from sim_device.config import load_robot
from sim_device.faults import parse
from sim_device.home import load_home
from sim_device.links.faulty import FaultyLink
from sim_device.links.memory import MemoryLink
from sim_device.links.peer_errors import PeerError
from sim_device.links.tap import Taps
from sim_device.nvm import Nvm
from sim_device.sensors.faulty import FaultySensors
from sim_device.session import STEP_S, Session
from sim_device.virtual_robot import VirtualRobot

CORE = "firmware_py.device:Device"


# What a mission leaves behind. Two of them are equal when every true place, the core's hashes and the map are, bit by bit.
class Outcome:
    def __init__(self, session, truth, link, done, told):
        self.truth = truth
        self.hashes = session.status and session.status[5:9]
        self.map_bytes = session.map_bytes
        self.session, self.link, self.done = session, link, done
        self.restarts = [fields["step"] for name, fields in told if name == "restart"]

    def same_as(self, other):
        return (self.truth, self.hashes, self.map_bytes) == (other.truth, other.hashes, other.map_bytes)


class Truth(list):
    def pose(self, *place):
        self.append(place)


class Told(list):
    def event(self, name, **fields):
        self.append((name, fields))


@functools.lru_cache(None)
def home_of(name):
    return load_home(name)


def mission(home="studio", seed=1, faults="", fault_seed=1, steps=200, link=None, nvm=None):
    """An Outcome; PeerError where the robot gave up."""
    plan, done = parse(faults), []
    link = bare = link or MemoryLink(CORE)
    if plan.of_the_link:
        link = FaultyLink(link, plan, fault_seed, lambda byte: bare.restart(), done.append)
    robot = VirtualRobot(home_of(home), load_robot(), seed)
    if plan.sensors:
        robot = FaultySensors(robot, plan.sensors, seed)
    if plan.power:
        nvm = nvm or Nvm(power=plan.power, seed=fault_seed)
        nvm.lose_power = link.lose_power
    truth, told = Truth(), Told()
    session = Session(link, Taps([]), robot, told, truth=truth, max_robot_s=(steps + 0.5) * STEP_S, nvm=nvm)
    try:
        session.run(5.0)
    except PeerError as error:
        error.done = done
        raise
    return Outcome(session, truth, link, done, told)


@functools.lru_cache(None)
def calm(home="studio", seed=1, steps=200):
    return mission(home, seed, steps=steps)


def shrunk(items, fails):
    """The fewest of these faults with which fails(items) still holds: halves, quarters, ... are left out while it does."""
    size = len(items)
    while size:
        at = 0
        while at < len(items):
            fewer = items[:at] + items[at + size:]
            if fails(fewer):
                items = fewer
            else:
                at += size
        size //= 2
    return items


def campaign(missions, homes, steps, first_seed=1):
    """So many missions of faults up to 30 %, each compared with the calm one. -> counts; a failing schedule is shrunk and kept."""
    counts = {"missions": 0, "frames": 0, "faults": 0, "repeats": 0, "epochs": 0, "different": 0}
    for number in range(missions):
        faults = spec(first_seed + number)
        home, seed = homes[number % len(homes)], 1 + number % 3
        try:
            got = mission(home, seed, faults, first_seed + number, steps)
            same, done = got.same_as(calm(home, seed, steps)), got.done
        except PeerError as error:
            print("seed", first_seed + number, faults, error, file=sys.stderr)
            same, done, got = False, error.done, None
        counts["missions"] += 1
        counts["faults"] += len(done)
        counts["different"] += not same
        if got:
            counts["frames"] += got.session.peer.frames
            counts["repeats"] += got.session.peer.repeats
            counts["epochs"] += got.session.peer.reopened
        if not same:
            counts["schedule"] = keep(home, seed, steps, done)
            break
    return counts


def spec(seed):
    """drop, dup, reorder and delay, each of 0 to 30 %, and hit frames up to 5 %, from a seed."""
    import random
    draw = random.Random(seed).uniform
    return "drop=%.3f,dup=%.3f,reorder=%.3f,delay=%dms:%.3f,flip=%.3f" % (
        draw(0, 0.3), draw(0, 0.3), draw(0, 0.3), draw(1, 60), draw(0, 0.3), draw(0, 0.05))


def keep(home, seed, steps, done):
    """The fewest of these faults that still make the mission differ, as a file for --faults @FILE."""
    def differs(items):
        try:
            return not mission(home, seed, ",".join(items), steps=steps).same_as(calm(home, seed, steps))
        except PeerError:
            return True
    items = shrunk(done, differs) if differs(done) else done
    path = "faults-%s-%d.txt" % (home, seed)
    with open(path, "w", encoding="utf-8") as file:
        file.write("# hil %s --seed %d --target cpython --link memory --max-robot-s %g --faults @%s\n" % (home, seed, steps * STEP_S, path))
        file.write("".join(item + "\n" for item in items))
    return path
