# The office floor of the paper's Fig. 7: what it must have, and that floors can be joined.

import json

import pytest
from shapely.geometry import Polygon

from sim_device.home import load_home
from sim_device.homes import __main__ as generator
from sim_device.homes.office import DEEP_M, LONG_M, SECTIONS, VECTORS, office


def test_it_has_the_papers_vectors_and_sections():
    home = load_home("office_458")
    assert (VECTORS, SECTIONS) == (458, 6)
    assert sum(len(ring) for ring in home.rings) == len(home.segments) == VECTORS
    assert len(home.rings) == SECTIONS and len(home.obstacles) == 5


def test_its_rooms_have_doors_of_90_cm_and_corridors_join_them():
    home = load_home("office_458")
    assert len(home.rooms) >= 25

    def pieces(width_m):
        region = home.free.buffer(-width_m / 2)
        return len(getattr(region, "geoms", [region]))

    assert pieces(0.86) == 1 and pieces(0.94) > 20
    areas = sorted(Polygon(room.polygon).area for room in home.rooms)
    assert areas[0] < 9 and 20 < areas[-2] < 40, "rooms of different sizes"


@pytest.mark.parametrize("columns, rows", [(2, 1), (1, 2), (2, 2), (4, 2)])
def test_floors_side_by_side_are_one_home_without_closed_doors(columns, rows):
    one, home = office().home(), office(columns, rows).home()  # home() raises where the disc's region is not in one piece
    assert home["bbox_m"] == [LONG_M * columns, DEEP_M * rows]
    tiles = columns * rows
    assert len(home["rooms"]) == tiles * len(one["rooms"])
    assert 0.97 * VECTORS * tiles < home["segments_total"] < 1.05 * VECTORS * tiles
    assert home["reach_area_m2"] == pytest.approx(tiles * one["reach_area_m2"], rel=0.02)


def test_the_generator_writes_them(tmp_path, capsys):
    generator.main([str(tmp_path), "--floors", "2x1"])
    assert load_home(tmp_path / "office_458_x2.json").name == "office_458_x2"
    assert json.loads((tmp_path / "office_458_x2.json").read_text())["segments_total"] > 900
    with pytest.raises(SystemExit) as ended:
        generator.main([str(tmp_path), "--floors", "0x2"])
    assert ended.value.code == 2 and "0x2 is not two numbers" in capsys.readouterr().err
