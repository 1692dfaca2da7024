"""One mission of an evaluation: what it is made of, and the name under which its figures are kept."""

import functools
import hashlib
import importlib.util
import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path

# What a run's figures depend on: these packages, and of the tools what scores (not what draws).
PACKAGES = ("firmware_py", "protocol", "sim_device")
SCORING = ("mission.py", "mission_log.py", "result.py", "score.py", "lines.py", "lower_bound.py", "map_file.py", "evaluation/worker.py",
           "peers")
PEER_LIBRARIES = ("filterpy", "gtsam")
FIGURES = "figures.json"
MAX_ROBOT_S = 14400  # as of a mission by hil
HOUR_S = 3600        # of robot time, for who asks how far off it is, not for the whole map


# `home` is a path. `settings`: flags, "name=on|off". `limits`: constants of the core other than its own, (name, value) each.
@dataclass(frozen=True)
class Run:
    home: str
    mode: str = "improved"
    uwb: str = "paper"
    odometry: str = "calibrated"
    seed: int = 1
    settings: tuple = ()
    limits: tuple = ()
    peers: bool = True
    max_robot_s: int = MAX_ROBOT_S

    @property
    def key(self):
        """The same for the same home, options and code: then the figures are the same, too."""
        told = asdict(self) | {"home": hashlib.sha256(Path(self.home).read_bytes()).hexdigest(), "code": code_hash()}
        if self.peers:
            told["libraries"] = [name for name in PEER_LIBRARIES if importlib.util.find_spec(name)]
        return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()[:16]

    @property
    def name(self):
        """For people: where it is, and what is not as by default."""
        parts = [Path(self.home).stem, self.mode, self.uwb, self.odometry, *self.settings, *("%s=%d" % pair for pair in self.limits),
                 "seed %d" % self.seed]
        return " ".join(parts)

    def asdict(self):
        return asdict(self)


def ended_well(run, figures):
    """Finished, or driven as long as it was to be."""
    robot_s = figures["result"]["time"]["robot_s"] or 0
    return figures["result"]["finished"] or run.max_robot_s == HOUR_S <= robot_s + 1


def from_dict(told):
    return Run(**told | {"settings": tuple(told["settings"]), "limits": tuple(tuple(pair) for pair in told["limits"])})


@functools.cache
def code_hash():
    digest = hashlib.sha256()
    for path in sorted(_code_files()):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def _code_files():
    for package in PACKAGES:
        folder = Path(list(importlib.util.find_spec(package).submodule_search_locations)[0])
        yield from (path for path in folder.rglob("*") if path.suffix in (".py", ".toml"))
    here = Path(__file__).parent.parent
    for name in SCORING:
        place = here / name
        yield from place.rglob("*.py") if place.is_dir() else (place,)


def kept(folder, run):
    """The figures of an earlier evaluation in that folder, or None."""
    try:
        with open(os.path.join(folder, run.key, FIGURES), encoding="utf-8") as file:
            return json.load(file)
    except (OSError, ValueError):
        return None
