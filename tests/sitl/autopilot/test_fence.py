"""The fence: what it is, when it is breached, and that the vehicle stays within it, upright and on the wing."""

import math

import numpy as np
import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Way
from protocol.modes import Mode
from protocol.plans.mission import MissionItem
from sitl.autopilot.fence import Circle, Fence, FenceWatch, Polygon, make_fence, way_to_a_stop
from sitl.autopilot.guidance import View
from sitl.autopilot.settings import Settings
from sitl.errors import SitlError
from sitl.memory import Memory
from sitl.parameters import Bindings, Surroundings
from sitl.simulation.simulation import Tuning
from tests.support.station import FRAME, Sky
from tests.support.wing_flight import HIGH, Flight, waypoint

FENCE, RALLY = mavlink.MAV_MISSION_TYPE_FENCE, mavlink.MAV_MISSION_TYPE_RALLY
INSIDE, OUTSIDE, DISC, HOLE, RALLY_POINT = 5001, 5002, 5003, 5004, 5100
GEOFENCE = mavlink.MAV_SYS_STATUS_GEOFENCE
SQUARE = ((-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0))


def located(command, north, west, first=0.0, *, frame=0, z=0.0):
    """An item of a fence or rally plan at a place in world NWU [m]."""
    here = FRAME.to_geodetic((north, -west, 0.0))
    return MissionItem(command, frame, (first, 0.0, 0.0, 0.0), round(here.lat_deg * 1e7), round(here.lon_deg * 1e7), z)


def polygon(corners=SQUARE, command=INSIDE):
    return [located(command, *corner, float(len(corners))) for corner in corners]


def at(p, v=(0.0, 0.0, 0.0), time=0.0, **rest):
    return View(time, p, v, 0.0, 0.0, False, 1.0, **rest)


# What a fence is


@pytest.mark.parametrize(
    ("items", "p", "kept"),
    [
        (polygon(), (0.0, 0.0, 5.0), True),
        (polygon(), (49.0, -49.0, 5.0), True),
        (polygon(), (51.0, 0.0, 5.0), False),
        (polygon(command=OUTSIDE), (0.0, 0.0, 5.0), False),
        (polygon(command=OUTSIDE), (0.0, 51.0, 5.0), True),
        ([located(DISC, 0.0, 0.0, 30.0)], (20.0, 20.0, 5.0), True),
        ([located(DISC, 0.0, 0.0, 30.0)], (22.0, 22.0, 5.0), False),
        ([located(HOLE, 40.0, 0.0, 30.0)], (11.0, 0.0, 5.0), False),
        ([*polygon(), located(DISC, 80.0, 0.0, 40.0)], (100.0, 0.0, 5.0), True),  # in one of two is enough
        ([*polygon(), located(HOLE, 0.0, 0.0, 10.0)], (0.0, 5.0, 5.0), False),
        (polygon(((0, 0), (50, 50), (20, 0), (50, -50))), (40.0, 0.0, 5.0), False),  # a notch
    ],
)
def test_a_place_is_allowed_in_one_zone_to_stay_in_and_in_none_to_stay_out_of(items, p, kept):
    fence = make_fence(items, FRAME)
    assert (fence.breach([p]) is None) is kept


def test_a_polygon_contains_what_its_winding_number_says():
    rng = np.random.default_rng(3)
    angle = np.sort(rng.uniform(0.0, math.tau, 17))
    corners = np.column_stack([rng.uniform(10.0, 60.0, 17) * f(angle) for f in (np.cos, np.sin)])
    p = rng.uniform(-60.0, 60.0, (400, 2))
    away = corners[None] - p[:, None]
    bearing = np.arctan2(away[..., 1], away[..., 0])
    turn = np.angle(np.exp(1j * (np.roll(bearing, -1, axis=1) - bearing))).sum(axis=1)
    assert Polygon(corners).contains(p).tolist() == (np.abs(turn) > 1.0).tolist()


@pytest.mark.parametrize(
    ("items", "result", "said"),
    [
        (polygon()[:3], 6, "4 corners"),
        ([*polygon()[:3], located(OUTSIDE, 0.0, 0.0, 4.0)], 13, "corner 4 of 4"),
        (polygon(SQUARE[:2]), 6, "2 corners"),
        ([located(INSIDE, 0.0, 0.0, math.nan)], 6, "nan corners"),
        ([located(DISC, 0.0, 0.0, -3.0)], 6, "-3 m is no radius"),
        ([located(DISC, 0.0, 0.0, math.nan)], 6, "nan m is no radius"),
        ([located(DISC, 0.0, 0.0, 9.0, frame=mavlink.MAV_FRAME_LOCAL_NED)], 2, "frame 1"),
        ([located(5000, 0.0, 0.0)], 3, "command 5000 is not supported"),
        ([MissionItem(DISC, 0, (9.0, 0, 0, 0), 910_000_000, 0, 0.0)], 10, "on the globe"),
    ],
)
def test_what_is_no_fence_is_refused_with_its_result_and_a_reason(items, result, said):
    refusal = make_fence(items, FRAME)
    assert refusal.result == result
    assert said in refusal.text


# When it is breached

DISC_OF_50 = Fence(within=(Circle((0.0, 0.0), 50.0),))


def test_the_way_to_a_stop_is_longer_on_the_wing():
    v = (15.0, 0.0, 0.0)
    upright, flying = (
        way_to_a_stop(at((0.0, 0.0, 20.0), v, forward=forward, stopping=60.0))[-1][0] for forward in (False, True)
    )
    assert upright == pytest.approx(22.5)
    assert flying == pytest.approx(60.0 + 0.3 * 15.0)


def test_a_breach_is_told_once_before_it_happens_and_again_only_after_a_while_inside():
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
def test_the_cylinder_about_home_is_a_fence_of_its_own(p, kind):
    assert Fence(reach=40.0, ceiling=30.0).breach([p]).kind == kind


# What is done about it


def flown_out(action, *, airspeed=15.0, wind=0.0, gusts=0.0):
    """A flight on the wing northwards that its fence, 200 m from home, was put in the way of."""
    settings = Settings(way=Way.FORWARD, airspeed=airspeed)
    flight = Flight(settings=settings, wind_speed=wind, wind_from=180.0, gusts=gusts)
    assert flight.autopilot.go_to((600.0, 0.0, HIGH)).accepted
    flight.fly(5.0)
    flight.autopilot.apply(settings._replace(fence_action=action, fence_reach=200.0))
    return flight


@pytest.mark.parametrize(
    ("airspeed", "wind", "gusts"), [(8.0, 0.0, 0.0), (15.0, 0.0, 0.0), (20.0, 0.0, 0.0), (15.0, 4.0, 0.7)]
)
def test_on_the_wing_it_stops_before_the_fence(airspeed, wind, gusts):
    flight = flown_out(2, airspeed=airspeed, wind=wind, gusts=gusts)
    flight.fly_until(lambda: flight.said, 40.0)
    assert flight.said[0] == "Fence: about to be farther than 200 m from home: holding"
    flight.fly(20.0)
    assert flight.autopilot.mode is Mode.HOLD
    assert not flight.autopilot.view.forward
    assert 190.0 < np.linalg.norm(flight.p[:, :2], axis=1).max() < 200.0
    assert len(flight.said) == 1


def test_returning_from_the_fence_stops_before_it_turns_round():
    flight = flown_out(3)
    flight.fly(45.0)
    assert flight.said[0].endswith("returning")
    assert flight.autopilot.mode is Mode.RTL
    assert np.linalg.norm(flight.p[:, :2], axis=1).max() < 200.0
    assert np.abs(flight.p[:, 1]).max() < 15.0
    assert np.linalg.norm(flight.p[-1, :2]) < 1.0


def test_landing_at_the_fence_comes_down_upright_within_it():
    flight = flown_out(5)
    flight.fly(45.0)
    assert "Landed" in flight.said
    assert not flight.failsafes
    assert np.linalg.norm(flight.p[:, :2], axis=1).max() < 200.0


def test_a_warning_is_only_a_warning():
    flight = flown_out(1)
    flight.fly(15.0)
    assert flight.said == ["Fence: about to be farther than 200 m from home: going on"]
    assert flight.p[-1, 0] > 210.0


@pytest.mark.parametrize("level", [(3.0, 0.0), (2.0, 2.0)])
def test_upright_a_streamed_velocity_ends_before_the_fence(level):
    flight = Flight()
    flight.autopilot.load_fence(Fence(within=(Circle((0.0, 0.0), 20.0),)))
    v = (*level, 0.0)

    def stream():
        flight.autopilot.set_offboard_velocity(v)

    stream()
    assert flight.autopilot.set_mode(Mode.OFFBOARD).accepted
    flight.fly(15.0, stream)
    assert flight.autopilot.mode is Mode.HOLD
    assert 14.0 < np.linalg.norm(flight.p[:, :2], axis=1).max() < 20.0


# On the wire


def test_a_fence_goes_up_bars_the_way_and_is_there_again_after_a_restart(tmp_path):
    sky = Sky(tmp_path, up=5.0)
    ground = sky.station()
    assert ground.upload(polygon(), FENCE) == mavlink.MAV_MISSION_ACCEPTED
    north = located(16, 60.0, 0.0)
    ground.send(
        mavlink.MAVLink_command_int_message(1, 1, 6, 192, 0, 0, -1, 1, math.nan, math.nan, north.x, north.y, 5.0)
    )
    assert ground.last("COMMAND_ACK").result == mavlink.MAV_RESULT_DENIED
    assert "outside the fence" in ground.texts()
    assert ground.upload([waypoint(10.0, 0.0, 5.0), waypoint(0.0, 70.0, 5.0)]) == mavlink.MAV_MISSION_ACCEPTED
    assert ground.command(mavlink.MAV_CMD_MISSION_START) == mavlink.MAV_RESULT_DENIED
    assert "item 1 is outside the fence" in ground.texts()
    assert sky.autopilot.mode is Mode.HOLD
    again = Sky(tmp_path, up=5.0)
    assert again.autopilot.world.fence.breach([(60.0, 0.0, 5.0)]) is not None
    assert Memory(tmp_path).fence() == tuple(polygon())


def test_a_breach_is_in_sys_status_and_fence_status(tmp_path):
    sky = Sky(tmp_path, up=5.0)
    ground = sky.station()
    sky.advance(1.2)
    assert ground.last("SYS_STATUS").onboard_control_sensors_health & GEOFENCE
    assert not ground.last("SYS_STATUS").onboard_control_sensors_enabled & GEOFENCE
    ground.upload([located(DISC, 40.0, 0.0, 10.0)], FENCE)
    sky.advance(1.2)
    assert not ground.last("SYS_STATUS").onboard_control_sensors_health & GEOFENCE
    assert ground.last("SYS_STATUS").onboard_control_sensors_enabled & GEOFENCE
    status = ground.last("FENCE_STATUS")
    assert (status.breach_status, status.breach_count, status.breach_type) == (1, 1, 3)
    ground.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 255))
    sky.advance(2.2)
    assert ground.last("SYS_STATUS").onboard_control_sensors_health & GEOFENCE
    assert ground.texts().count("Fence: outside the fence: holding") == 1
    assert Memory(tmp_path).fence() == ()


def test_a_refused_fence_leaves_the_old_one_in_force(tmp_path):
    sky = Sky(tmp_path)
    ground = sky.station()
    ground.upload(polygon(), FENCE)
    assert ground.upload(polygon()[:3], FENCE) == mavlink.MAV_MISSION_INVALID_PARAM1
    assert "Fence refused: fence item 0: 4 corners" in ground.texts()
    assert sky.autopilot.world.fence.breach([(60.0, 0.0, 5.0)]) is not None
    assert Memory(tmp_path).fence() == tuple(polygon())


def test_outside_its_fence_it_does_not_arm(tmp_path):
    ground = Sky(tmp_path).station()
    ground.upload([located(HOLE, 0.0, 0.0, 10.0)], FENCE)
    assert ground.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert "in a zone to stay out of" in ground.texts()


def test_a_return_goes_to_the_nearest_rally_point(tmp_path):
    sky = Sky(tmp_path, up=5.0)
    ground = sky.station()
    points = [located(RALLY_POINT, north, 0.0, frame=3, z=6.0) for north in (8.0, -6.0)]
    assert ground.upload(points, RALLY) == mavlink.MAV_MISSION_ACCEPTED
    assert sky.autopilot.go_to((-5.0, 0.0, 5.0)).accepted
    sky.advance(6.0)
    assert ground.mode(Mode.RTL) == mavlink.MAV_RESULT_ACCEPTED
    sky.advance_until(lambda: not sky.autopilot.flying, 40.0)
    assert sky.craft.vehicle.truth.body.position[:2] == pytest.approx([-6.0, 0.0], abs=0.3)
    assert Memory(tmp_path).rally() == tuple(points)


def test_home_itself_is_a_place_to_return_to(tmp_path):
    sky = Sky(tmp_path, up=5.0)
    sky.station().upload([located(RALLY_POINT, 8.0, 0.0, frame=3, z=6.0)], RALLY)
    assert sky.autopilot.world.safe_point((3.0, 0.0, 5.0)) == (0.0, 0.0, 0.0)
    assert sky.autopilot.world.safe_point((5.0, 0.0, 5.0)) == pytest.approx((8.0, 0.0, 6.0), abs=0.02)


@pytest.mark.parametrize(
    ("item", "result"),
    [
        (located(16, 0.0, 0.0, frame=3, z=5.0), 3),
        (located(RALLY_POINT, 0.0, 0.0, frame=1, z=5.0), 2),
        (located(RALLY_POINT, 0.0, 0.0, frame=3, z=math.nan), 12),
        (located(RALLY_POINT, 0.0, 0.0, frame=0, z=5.0), 5),  # 145 m below home
    ],
)
def test_what_is_no_rally_point_is_refused(tmp_path, item, result):
    ground = Sky(tmp_path).station()
    assert ground.upload([item], RALLY) == result
    assert "Rally points refused: rally item 0" in ground.texts()


def test_terminating_flight_is_no_action_of_this_vehicle():
    with pytest.raises(SitlError, match="terminate"):
        Bindings(Settings(), Tuning(), Surroundings()).replaced({"GF_ACTION": 4})
