"""Choice of a mission's landing for a return, by RTL_TYPE."""

import math

import pytest

from protocol.dialect import mavlink as m
from sitl.autopilot.mission.runner import return_pattern
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from tests.support.vehicle.mission_items import FRAME, item, waypoint

WORLD = World(FRAME, ARENAS["open"])
START = item(m.MAV_CMD_DO_LAND_START, frame=m.MAV_FRAME_MISSION)
CIRCLE = item(m.MAV_CMD_NAV_LOITER_TO_ALT, 200, 0, 25, (1.0, 40.0, 0.0, 1.0))
LANDING = item(m.MAV_CMD_NAV_VTOL_LAND, 100, 0, 0)
ITEMS = (
    waypoint(50, 0, 20),
    START,
    CIRCLE,
    LANDING,
    START,
    waypoint(-200, 0, 30),
    item(m.MAV_CMD_NAV_LAND, -100, 0, 0),
)


def pattern(north, kind=1, items=ITEMS, world=WORLD):
    return return_pattern(items, world, Settings(return_type=kind), (north, 0.0, 20.0))


def test_the_nearest_landing_is_flown():
    assert pattern(30.0).start == 1
    assert pattern(-30.0).start == 4
    assert pattern(-30.0).points == ((-200.0, 0.0, 30.0), (-100.0, 0.0, 30.0))


def test_the_energy_of_a_circle_counts():
    length = sum(math.dist(a, b) for a, b in zip(pattern(30.0).points, pattern(30.0).points[1:], strict=False))
    assert length == pytest.approx(100.0 + 40.0 + 80.0 + 80.0 + 40.0)


@pytest.mark.parametrize(("kind", "north", "start"), [(0, 150.0, None), (3, 150.0, 1), (3, 50.0, None), (1, 1.0, 1)])
def test_rtl_type_says_whether(kind, north, start):
    found = pattern(north, kind)
    assert (None if found is None else found.start) == start


def test_a_rally_point_may_be_nearer():
    assert pattern(150.0, 3, world=WORLD._replace(rally=((140.0, 0.0, 5.0),))) is None


@pytest.mark.parametrize("items", [(), ITEMS[:1], ITEMS[:3], (START, item(m.MAV_CMD_NAV_RETURN_TO_LAUNCH))])
def test_a_start_without_a_landing_is_none(items):
    assert pattern(30.0, items=items) is None
