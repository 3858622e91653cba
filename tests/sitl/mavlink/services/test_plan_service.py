"""Fence and rally points over MAVLink: uploaded, in force, reported, stored, refused."""

import math

import pytest

from darko_gcs.state.values import LegChain
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason, LegMode
from protocol.names import Mode
from sitl.autopilot.settings import Settings
from sitl.errors import SitlError
from sitl.simulation.tuning import Tuning
from sitl.tools.persistence import StateFolder
from sitl.vehicle.parameters import Configuration, WorldSettings
from tests.support.gcs.linked_station import LinkedStation
from tests.support.gcs.messages import VEHICLE
from tests.support.vehicle.fake_station import Bench
from tests.support.vehicle.mission_items import global_item, polygon, waypoint

FENCE, RALLY = mavlink.MAV_MISSION_TYPE_FENCE, mavlink.MAV_MISSION_TYPE_RALLY
DISC, HOLE, RALLY_POINT = 5003, 5004, 5100
GEOFENCE = mavlink.MAV_SYS_STATUS_GEOFENCE


def test_an_uploaded_fence_is_in_force_at_once_and_after_a_restart(tmp_path):
    bench = Bench(tmp_path, up=5.0)
    ground = bench.station()
    assert ground.upload(polygon(), FENCE) == mavlink.MAV_MISSION_ACCEPTED
    north = global_item(16, 60.0, 0.0)
    ground.send(
        mavlink.MAVLink_command_int_message(1, 1, 6, 192, 0, 0, -1, 1, math.nan, math.nan, north.x, north.y, 5.0)
    )
    assert ground.last("COMMAND_ACK").result == mavlink.MAV_RESULT_DENIED
    assert "outside the fence" in ground.texts()
    assert ground.upload([waypoint(10.0, 0.0, 5.0), waypoint(0.0, 70.0, 5.0)]) == mavlink.MAV_MISSION_ACCEPTED
    assert ground.command(mavlink.MAV_CMD_MISSION_START) == mavlink.MAV_RESULT_DENIED
    assert "item 1 is outside the fence" in ground.texts()
    assert bench.autopilot.mode is Mode.HOLD
    again = Bench(tmp_path, up=5.0)
    assert again.autopilot.world.fence.breach([(60.0, 0.0, 5.0)]) is not None
    assert StateFolder(tmp_path).fence() == tuple(polygon())


def test_before_the_flight_the_vehicle_says_that_it_would_deny_its_mission(tmp_path):
    ground = Bench(tmp_path).station()
    assert ground.upload([waypoint(0.0, 70.0, 5.0)]) == mavlink.MAV_MISSION_ACCEPTED
    ground.command(mavlink.MAV_CMD_RUN_PREARM_CHECKS)
    assert "denied" not in ground.texts()
    assert ground.upload(polygon(), FENCE) == mavlink.MAV_MISSION_ACCEPTED
    ground.command(mavlink.MAV_CMD_RUN_PREARM_CHECKS)
    assert "Mission would be denied: item 0 is outside the fence" in ground.texts()
    assert "Pre-arm: ready" in ground.texts()
    assert ground.command(mavlink.MAV_CMD_MISSION_START) == mavlink.MAV_RESULT_DENIED


@pytest.mark.long
def test_a_breach_is_in_sys_status_and_fence_status(tmp_path):
    bench = Bench(tmp_path, up=5.0)
    ground = bench.station()
    bench.advance(1.2)
    assert ground.last("SYS_STATUS").onboard_control_sensors_health & GEOFENCE
    assert not ground.last("SYS_STATUS").onboard_control_sensors_enabled & GEOFENCE
    ground.upload([global_item(DISC, 40.0, 0.0, 10.0)], FENCE)
    bench.advance(1.2)
    assert not ground.last("SYS_STATUS").onboard_control_sensors_health & GEOFENCE
    assert ground.last("SYS_STATUS").onboard_control_sensors_enabled & GEOFENCE
    status = ground.last("FENCE_STATUS")
    assert (status.breach_status, status.breach_count, status.breach_type) == (1, 1, 3)
    ground.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 255))
    bench.advance(2.2)
    assert ground.last("SYS_STATUS").onboard_control_sensors_health & GEOFENCE
    assert ground.texts().count("Fence: outside the fence: holding") == 1
    assert StateFolder(tmp_path).fence() == ()


@pytest.mark.long
def test_a_breach_is_answered_by_a_flight_to_the_return_point(tmp_path):
    bench = Bench(tmp_path, up=6.0, settings=Settings(fence_action=3, fence_distance=500.0))
    ground = bench.station()
    point = global_item(mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT, 12.0, 3.0, frame=3, z=8.0)
    ground.upload([global_item(DISC, 12.0, 0.0, 10.0), point], FENCE)
    bench.advance(12.0)
    assert "Flying to the fence's return point" in ground.texts()
    assert bench.autopilot.mode is Mode.HOLD
    assert bench.autopilot.view.p == pytest.approx((12.0, 3.0, 8.0), abs=0.3)
    bench.advance(3.0)
    assert bench.autopilot.flying


def test_a_return_point_that_the_fence_action_leaves_unused_is_told(tmp_path):
    bench = Bench(tmp_path)
    ground = bench.station()
    ground.upload([global_item(mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT, 0.0, 0.0, frame=3, z=8.0)], FENCE)
    assert "Fence: 1 item received; its return point is flown to by GF_ACTION 3 alone" in ground.texts()
    bench.autopilot.configure(Settings(fence_action=3))
    ground.upload([global_item(mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT, 0.0, 0.0, frame=3, z=9.0)], FENCE)
    assert ground.texts().endswith("Fence: 1 item received")


def test_a_refused_fence_leaves_the_old_one_in_force(tmp_path):
    bench = Bench(tmp_path)
    ground = bench.station()
    ground.upload(polygon(), FENCE)
    assert ground.upload(polygon()[:3], FENCE) == mavlink.MAV_MISSION_INVALID_PARAM1
    assert "Fence refused: fence item 0: 4 corners" in ground.texts()
    assert bench.autopilot.world.fence.breach([(60.0, 0.0, 5.0)]) is not None
    assert StateFolder(tmp_path).fence() == tuple(polygon())


def test_outside_its_fence_it_does_not_arm(tmp_path):
    ground = Bench(tmp_path).station()
    ground.upload([global_item(HOLE, 0.0, 0.0, 10.0)], FENCE)
    assert ground.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert "in an exclusion zone" in ground.texts()


@pytest.mark.long
def test_a_return_goes_to_the_nearest_rally_point(tmp_path):
    bench = Bench(tmp_path, up=5.0)
    ground = bench.station()
    points = [global_item(RALLY_POINT, north, 0.0, frame=3, z=6.0) for north in (8.0, -6.0)]
    assert ground.upload(points, RALLY) == mavlink.MAV_MISSION_ACCEPTED
    assert bench.autopilot.guided.go_to((-5.0, 0.0, 5.0)).accepted
    bench.advance(6.0)
    assert ground.mode(Mode.RTL) == mavlink.MAV_RESULT_ACCEPTED
    bench.advance_until(lambda: not bench.autopilot.flying, 40.0)
    assert bench.aircraft.vehicle.truth.body.position[:2] == pytest.approx([-6.0, 0.0], abs=0.3)
    assert StateFolder(tmp_path).rally() == tuple(points)


def test_home_is_one_of_the_places_to_return_to(tmp_path):
    bench = Bench(tmp_path, up=5.0)
    bench.station().upload([global_item(RALLY_POINT, 8.0, 0.0, frame=3, z=6.0)], RALLY)
    assert bench.autopilot.world.safe_point((3.0, 0.0, 5.0)) == (0.0, 0.0, 0.0)
    assert bench.autopilot.world.safe_point((5.0, 0.0, 5.0)) == pytest.approx((8.0, 0.0, 6.0), abs=0.02)


@pytest.mark.parametrize(
    ("item", "result"),
    [
        (global_item(16, 0.0, 0.0, frame=3, z=5.0), 3),
        (global_item(RALLY_POINT, 0.0, 0.0, frame=1, z=5.0), 2),
        (global_item(RALLY_POINT, 0.0, 0.0, frame=3, z=math.nan), 12),
        (global_item(RALLY_POINT, 0.0, 0.0, frame=0, z=5.0), 5),  # 145 m below home
    ],
)
def test_an_invalid_rally_point_is_refused(tmp_path, item, result):
    ground = Bench(tmp_path).station()
    assert ground.upload([item], RALLY) == result
    assert "Rally points refused: rally item 0" in ground.texts()


def test_the_fence_action_that_terminates_the_flight_is_refused():
    with pytest.raises(SitlError, match="terminate"):
        Configuration(Settings(), Tuning(), WorldSettings()).replaced({"GF_ACTION": 4})


# DARKO_LEGS_REQUEST: what legs would take, without flying them.


FAR = LegChain(points=((0.0, 0.0, -10.0), (150.0, 0.0, -10.0)), asked=(LegMode.NONE,), heading=0.0)
NEAR = LegChain(points=((0.0, 0.0, -10.0), (3.0, 0.0, -10.0)), asked=(LegMode.NONE,), heading=0.0)


@pytest.fixture(scope="module")
def link(tmp_path_factory):
    linked = LinkedStation(tmp_path_factory.mktemp("vehicle"), up=10.0)
    linked.run(1.5)
    return linked


def predicted(link, *chains):
    link.station.predict_legs(chains, link.now)
    assert link.run(3.0, lambda: all(chain in link.snapshot.mission.leg_predictions for chain in chains))
    return [link.snapshot.mission.leg_predictions[chain] for chain in chains]


def test_a_long_leg_is_cheaper_in_forward_flight_and_a_short_one_has_no_room_for_it(link):
    (far,), (near,) = predicted(link, FAR, NEAR)
    assert far.forward_energy < far.hover_energy
    assert far.forward_time < far.hover_time
    assert (far.leg_mode, far.reason) == (LegMode.FORWARD, DecisionReason.ENERGY)
    assert far.chosen == (far.forward_time, far.forward_energy)
    assert near.leg_mode == LegMode.HOVER
    assert 1.0 < near.hover_time < far.hover_time


def test_a_leg_is_predicted_the_way_that_it_is_asked_for(link):
    ((leg,),) = predicted(link, FAR._replace(asked=(LegMode.HOVER,)))
    assert (leg.leg_mode, leg.reason) == (LegMode.HOVER, DecisionReason.COMMAND)
    assert leg.chosen == (leg.hover_time, leg.hover_energy)


def test_legs_without_a_stop_between_share_their_transitions(link):
    corner = FAR._replace(points=(*FAR.points, (150.0, 150.0, -10.0)), asked=(LegMode.NONE, LegMode.NONE))
    (both, (alone,)) = predicted(link, corner, FAR)
    assert both[0].leg_mode == both[1].leg_mode == LegMode.FORWARD
    assert both[0].forward_energy < alone.forward_energy


def test_a_slower_hover_takes_longer(link):
    (slow,), (own,) = predicted(link, FAR._replace(hover_speed=1.0), FAR)
    assert slow.hover_time > 1.5 * own.hover_time


def test_a_leg_near_the_ground_cannot_be_flown_forward(link):
    low = FAR._replace(points=((0.0, 0.0, -1.0), (150.0, 0.0, -1.0)))
    ((leg,),) = predicted(link, low)
    assert (leg.leg_mode, leg.reason) == (LegMode.HOVER, DecisionReason.TOO_LOW)
    assert math.isinf(leg.forward_time)


def test_nothing_is_flown_and_nothing_told_of_a_prediction(link):
    before = link.snapshot.guidance.decision, link.vehicle.aircraft.autopilot.mode
    predicted(link, FAR._replace(heading=1.0))
    assert (link.snapshot.guidance.decision, link.vehicle.aircraft.autopilot.mode) == before


@pytest.mark.long
def test_a_request_without_sense_is_not_answered(link):
    bad = FAR._replace(points=((0.0, 0.0, -10.0), (math.nan, 0.0, -10.0)))
    link.station.predict_legs([bad], link.now)
    link.run(3.0)
    assert bad not in link.snapshot.mission.leg_predictions
    link.run(11.0)  # the station rests
    predicted(link, FAR._replace(heading=2.0))


def test_only_so_many_requests_are_answered_in_a_second(link):
    chain = FAR._replace(heading=3.0)
    (before,) = predicted(link, chain)
    request, frames = link.sent[-1], 0
    link.station.predict_legs([chain], link.now)
    for _ in range(200):
        link.vehicle.receive(request, link.peer, link.now)
    frames = [VEHICLE.decode(data)[0].get_type() for _, data in link.vehicle.datagrams(link.now)]
    assert frames.count("DARKO_LEGS_PREDICTION") <= 20
    assert before
