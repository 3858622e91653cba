"""The fence: when it is breached, and that the vehicle stays inside, in hover and in forward flight."""

import math

import numpy as np
import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.names import Mode
from protocol.plans.plan import MissionItem
from sitl.autopilot.fence_watch import FenceWatch, path_to_stop
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, Circle, Fence, Polygon, World, make_fence
from sitl.defaults import HOME
from sitl.guidance.view import VehicleView
from tests.support.flights.recorded_flight import HIGH, Flight
from tests.support.vehicle.mission_items import FRAME, SQUARE, global_item, polygon


def at(p, v=(0.0, 0.0, 0.0), time=0.0, **rest):
    return VehicleView(time, p, v, 0.0, 0.0, False, 1.0, **rest)


def test_a_polygon_contains_the_points_of_non_zero_winding_number():
    rng = np.random.default_rng(3)
    angle = np.sort(rng.uniform(0.0, math.tau, 17))
    corners = np.column_stack([rng.uniform(10.0, 60.0, 17) * f(angle) for f in (np.cos, np.sin)])
    p = rng.uniform(-60.0, 60.0, (400, 2))
    away = corners[None] - p[:, None]
    bearing = np.arctan2(away[..., 1], away[..., 0])
    turn = np.angle(np.exp(1j * (np.roll(bearing, -1, axis=1) - bearing))).sum(axis=1)
    assert Polygon(corners).contains(p).tolist() == (np.abs(turn) > 1.0).tolist()


# When it is breached

DISC_OF_50 = Fence(inclusions=(Circle((0.0, 0.0), 50.0),))


def test_the_path_to_a_stop_is_longer_in_forward_flight():
    v = (15.0, 0.0, 0.0)
    views = (at((0.0, 0.0, 20.0), v, forward=forward, stopping_distance=60.0) for forward in (False, True))
    upright, flying = (path_to_stop(view)[-1][0] for view in views)
    assert upright == pytest.approx(22.5)
    assert flying == pytest.approx(60.0 + 0.3 * 15.0)


def test_a_breach_is_reported_once_before_it_happens_and_again_only_after_a_while_inside():
    watch = FenceWatch()
    towards = at((46.0, 0.0, 5.0), (3.0, 0.0, 0.0))
    assert "about to be" in watch.check(towards, DISC_OF_50).text
    assert watch.check(towards._replace(time=0.1), DISC_OF_50) is None
    assert watch.breached
    watch.check(at((40.0, 0.0, 5.0), time=0.5), DISC_OF_50)
    assert watch.breached
    watch.check(at((40.0, 0.0, 5.0), time=1.2), DISC_OF_50)
    assert not watch.breached
    assert watch.check(at((51.0, 0.0, 5.0), time=2.0), DISC_OF_50).text == "outside the fence"
    assert watch.count == 2


@pytest.mark.parametrize(("p", "kind"), [((0.0, 0.0, 31.0), 2), ((41.0, 0.0, 5.0), 3)])
def test_the_cylinder_about_home_is_a_fence_by_itself(p, kind):
    assert Fence(max_distance=40.0, max_height=30.0).breach([p]).kind == kind


# What the vehicle does about it


def flown_out(action, *, airspeed=15.0, wind=0.0, gusts=0.0):
    """A flight northwards in forward flight, towards a fence 200 m from home."""
    settings = Settings(leg_mode=LegMode.FORWARD, airspeed=airspeed)
    flight = Flight(settings=settings, wind_speed=wind, wind_from=180.0, gusts=gusts)
    assert flight.autopilot.guided.go_to((600.0, 0.0, HIGH)).accepted
    flight.fly(5.0)
    flight.autopilot.configure(settings._replace(fence_action=action, fence_distance=200.0))
    return flight


@pytest.mark.long(after=1)
@pytest.mark.parametrize(
    ("airspeed", "wind", "gusts"), [(8.0, 0.0, 0.0), (15.0, 0.0, 0.0), (20.0, 0.0, 0.0), (15.0, 4.0, 0.7)]
)
def test_in_forward_flight_it_stops_before_the_fence(airspeed, wind, gusts):
    flight = flown_out(2, airspeed=airspeed, wind=wind, gusts=gusts)
    flight.fly_until(lambda: flight.texts, 40.0)
    assert flight.texts[0] == "Fence: about to be farther than 200 m from home: holding"
    flight.fly(20.0)
    assert flight.autopilot.mode is Mode.HOLD
    assert not flight.autopilot.view.forward
    assert 190.0 < np.linalg.norm(flight.p[:, :2], axis=1).max() < 200.0
    assert len(flight.texts) == 1


def test_a_return_from_the_fence_stops_before_it_turns_round():
    flight = flown_out(3)
    flight.fly(45.0)
    assert flight.texts[0].endswith("returning")
    assert flight.autopilot.mode is Mode.RTL
    assert np.linalg.norm(flight.p[:, :2], axis=1).max() < 200.0
    assert np.abs(flight.p[:, 1]).max() < 15.0
    assert np.linalg.norm(flight.p[-1, :2]) < 1.0


def test_a_landing_at_the_fence_comes_down_inside():
    flight = flown_out(5)
    flight.fly(45.0)
    assert "Landed" in flight.texts
    assert not flight.failsafes
    assert np.linalg.norm(flight.p[:, :2], axis=1).max() < 200.0


def test_a_warning_is_only_a_warning():
    flight = flown_out(1)
    flight.fly(15.0)
    assert flight.texts == ["Fence: about to be farther than 200 m from home: going on"]
    assert flight.p[-1, 0] > 210.0


@pytest.mark.parametrize("level", [(3.0, 0.0), (2.0, 2.0)])
def test_in_hover_a_streamed_velocity_ends_before_the_fence(level):
    flight = Flight()
    flight.autopilot.load_fence(Fence(inclusions=(Circle((0.0, 0.0), 20.0),)))
    v = (*level, 0.0)

    def stream():
        flight.autopilot.offboard.set_velocity(v)

    stream()
    assert flight.autopilot.set_mode(Mode.OFFBOARD).accepted
    flight.fly(15.0, stream)
    assert flight.autopilot.mode is Mode.HOLD
    assert 14.0 < np.linalg.norm(flight.p[:, :2], axis=1).max() < 20.0


# Fences from plan items: what they allow, and that invalid ones are refused with a reason.


INSIDE, OUTSIDE, DISC, HOLE = 5001, 5002, 5003, 5004  # MAV_CMD_NAV_FENCE_...
RETURN = mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT
WORLD = World(FRAME, ARENAS["open"], home=(3.0, 0.0, 1.0))
BEYOND_THE_POLE = MissionItem(command=DISC, frame=0, params=(9.0, 0, 0, 0), x=910_000_000, y=0, z=0.0)


@pytest.mark.parametrize(
    ("items", "p", "inside"),
    [
        (polygon(), (0.0, 0.0, 5.0), True),
        (polygon(), (49.0, -49.0, 5.0), True),
        (polygon(), (51.0, 0.0, 5.0), False),
        (polygon(command=OUTSIDE), (0.0, 0.0, 5.0), False),
        (polygon(command=OUTSIDE), (0.0, 51.0, 5.0), True),
        ([global_item(DISC, 0.0, 0.0, 30.0)], (20.0, 20.0, 5.0), True),
        ([global_item(DISC, 0.0, 0.0, 30.0)], (22.0, 22.0, 5.0), False),
        ([global_item(HOLE, 40.0, 0.0, 30.0)], (11.0, 0.0, 5.0), False),
        ([*polygon(), global_item(DISC, 80.0, 0.0, 40.0)], (100.0, 0.0, 5.0), True),  # in one of two is enough
        ([*polygon(), global_item(HOLE, 0.0, 0.0, 10.0)], (0.0, 5.0, 5.0), False),
        (polygon(((0, 0), (50, 50), (20, 0), (50, -50))), (40.0, 0.0, 5.0), False),  # a notch
    ],
)
def test_a_point_is_allowed_in_one_inclusion_zone_and_no_exclusion_zone(items, p, inside):
    fence = make_fence(items, WORLD)
    assert (fence.breach([p]) is None) is inside


@pytest.mark.parametrize(
    ("items", "result", "reason"),
    [
        (polygon()[:3], 6, "4 corners"),
        ([*polygon()[:3], global_item(OUTSIDE, 0.0, 0.0, 4.0)], 13, "corner 4 of 4"),
        (polygon(SQUARE[:2]), 6, "param1 is 2, not a whole number from 3 to 1000 (number of corners)"),
        ([global_item(INSIDE, 0.0, 0.0, math.nan)], 6, "param1 is nan, not a whole number"),
        ([global_item(DISC, 0.0, 0.0, -3.0)], 6, "param1 is -3, not a number from 0.01 to 100000 m (radius)"),
        ([global_item(DISC, 0.0, 0.0, math.nan)], 6, "param1 is nan, not a number from 0.01 to 100000 m (radius)"),
        ([global_item(DISC, 0.0, 0.0, 9.0, frame=mavlink.MAV_FRAME_LOCAL_NED)], 2, "frame 1"),
        ([global_item(4999, 0.0, 0.0)], 3, "command 4999 is not supported"),
        ([*polygon(), global_item(RETURN, 60.0, 0.0)], 5, "item 4: the return point is wrong: outside the fence"),
        ([global_item(RETURN, 0.0, 0.0)] * 2, 13, "item 1: a second return point beside item 0"),
        ([global_item(RETURN, 0.0, 0.0, z=math.inf)], 12, "item 0: param7 is inf"),
        ([global_item(RETURN, 0.0, 0.0, frame=mavlink.MAV_FRAME_LOCAL_NED)], 2, "frame 1"),
        ([BEYOND_THE_POLE], 10, "param5 is 91, not a number from -90 to 90 deg (latitude)"),
    ],
)
def test_an_invalid_fence_is_refused_with_its_result_and_a_reason(items, result, reason):
    refusal = make_fence(items, WORLD)
    assert refusal.result == result
    assert reason in refusal.text


@pytest.mark.parametrize(
    ("frame", "z", "up"), [(3, 20.0, 21.0), (0, HOME.alt + 20.0, 20.0), (3, math.nan, 1.0)], ids=["home", "sea", "open"]
)
def test_the_return_point_is_where_its_frame_says(frame, z, up):
    fence = make_fence([global_item(RETURN, 10.0, -5.0, frame=frame, z=z), *polygon()], WORLD)
    assert fence.return_point == pytest.approx((10.0, -5.0, up), abs=0.02)
    assert fence.breach([(0.0, 0.0, 5.0)]) is None
