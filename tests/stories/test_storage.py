# A furnished studio is mapped although the core is started anew and its power fails, again and again.

from host_tools.map_file import decode_map
from host_tools.score import HomeTruth, score_map
from sim_device.home import load_home
from tests.sim_device.faulty_mission import mission

STEPS = 60000


def test_a_studio_is_mapped_through_resets_and_power_cuts():
    # Before the outline is stored, while a barrier is written, on the way inside, when all is explored, and while the map is read.
    got = mission("studio", steps=STEPS, faults="reset@step=900,power@byte=2600,power@byte=4500,power@byte=7777,reset@step=12000,"
                                                "reset@step=16000,power@byte=20000")
    storage = got.session.storage.figures()
    found = [one["loaded"] for one in storage["found"]]
    assert found == [None, None] + ["outline"] * 6, storage
    assert got.session.status.finished and storage["kept"] == "explored"
    score = score_map(HomeTruth(load_home("studio")), decode_map(got.map_bytes))
    assert score["precision_5cm"] >= 0.95 and score["recall_5cm"] >= 0.95, score
    last = mission("studio", steps=STEPS, nvm=got.session.storage.nvm)
    assert last.map_bytes == got.map_bytes and last.session.step < 1000
    frames = last.session.peer.link.counters[2]
    again = mission("studio", steps=STEPS, nvm=got.session.storage.nvm, faults="reset@down=%d" % (frames - 1))
    assert again.map_bytes == got.map_bytes and len(again.restarts) == 1 and again.session._pull.resumed == 1
