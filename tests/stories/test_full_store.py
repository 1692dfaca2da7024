"""Homes larger than the stores: the mission ends in good order with what fits, whatever it was about when the store filled up."""

import pytest

from firmware_py import pipeline
from firmware_py.collection import explorer
from firmware_py.storage import vector_store
from protocol import states
from tests.stories.mission import drive_mission


@pytest.mark.parametrize("vectors", [8, 9, 10, 11, 12, 13, 17, 24, 31, 40, 60, 90])
def test_a_full_map_is_built_and_sealed(monkeypatch, vectors):
    monkeypatch.setattr(vector_store, "VECTORS_MAX", vectors)
    mission = drive_mission.__wrapped__("studio")
    core = mission.core
    assert core.state == states.DONE and core.finished
    assert core.degraded & pipeline.DEGRADED_VECTORS
    assert core.vectors.used <= vectors and all(core.vectors.counts[:core.vectors.chains])
    assert sum(len(chain.xy) for chain in mission.vector_map.chains) == core.vectors.used


@pytest.mark.parametrize("chains", [1, 2, 3, 5])
def test_so_is_one_with_too_many_barriers(monkeypatch, chains):
    monkeypatch.setattr(vector_store, "CHAINS_MAX", chains)
    core = drive_mission.__wrapped__("studio").core
    assert core.state == states.DONE and core.finished and core.vectors.chains <= chains
    assert core.degraded & pipeline.DEGRADED_CHAINS


def test_who_is_stuck_for_good_inside_keeps_what_is_known(monkeypatch):
    def stuck(self, *to):
        set_out(self, *to)
        self.stuck = explorer._STUCK_MAX
        self._got_stuck()

    set_out = explorer.Explorer.go_to
    monkeypatch.setattr(explorer.Explorer, "go_to", stuck)
    core = drive_mission.__wrapped__("studio").core
    assert core.state == states.DONE and core.finished and core.reason == states.REASON_STUCK
    assert core.degraded == pipeline.DEGRADED_SEARCH and core.graph.ready and core.graph.region_count >= 1
