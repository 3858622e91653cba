"""QGroundControl's plans for a VTOL, uploaded and flown: a survey with its camera, landing patterns, returns."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest

from protocol.dialect import mavlink as m
from protocol.names import Mode
from protocol.plans import load
from protocol.plans.plan import MissionItem
from protocol.tlog.reader import read_tlog
from sitl.autopilot.settings import Settings
from sitl.mavlink.flight_recorder import FlightRecorder
from tests.support.paths import DATA
from tests.support.vehicle.fake_station import Bench
from tests.support.vehicle.mission_items import NAN, global_item

SURVEY = load(DATA / "survey.plan").items
ACCEPTED, DENIED, UNSUPPORTED = m.MAV_RESULT_ACCEPTED, m.MAV_RESULT_DENIED, m.MAV_RESULT_UNSUPPORTED


def plain(command, *params, x=0, y=0, z=0.0):
    """An item without a place."""
    values = tuple(map(float, (*params, *[0.0] * (4 - len(params)))))
    return MissionItem(command=command, frame=m.MAV_FRAME_MISSION, params=values, x=x, y=y, z=float(z))


def place(command, north, east, up, *params):
    """An item at a place, relative to home."""
    values = tuple(map(float, (*params, *[0.0] * (4 - len(params)))))
    return replace(global_item(command, north, -east, frame=3, z=float(up)), params=values)


def waypoint(north, east, up):
    return place(m.MAV_CMD_NAV_WAYPOINT, north, east, up, 0, 0, 0, NAN)


def flying(folder, items, **options):
    """A station whose vehicle flies a mission from where it hovers."""
    bench = Bench(folder, **options)
    ground = bench.station()
    assert ground.upload(list(items)) == m.MAV_MISSION_ACCEPTED, ground.texts()
    assert bench.autopilot.missions.start().accepted
    return ground


def until(ground, condition, limit):
    ground.bench.advance_until(condition, limit)


def images(ground):
    return [message for message in ground.heard if message.get_type() == "CAMERA_IMAGE_CAPTURED"]


@pytest.mark.long
def test_a_survey_is_flown_with_its_images_and_its_landing(tmp_path):
    ground = flying(tmp_path, SURVEY[2:], up=30.0, settings=Settings(disarm_after=0.0))
    autopilot = ground.bench.autopilot
    until(ground, lambda: not autopilot.armed, 300.0)
    assert autopilot.mission.finished
    assert math.dist(ground.bench.aircraft.view().p[:2], (0.0, 0.0)) < 3.0
    shots = images(ground)
    assert [shot.image_index for shot in shots] == list(range(28))
    assert {shot.capture_result for shot in shots} == {1}
    north = [math.radians(shot.lat * 1e-7) * 6378137.0 for shot in shots]
    for line in range(4):
        spacing = [abs(b - a) for a, b in pairwise(north[7 * line : 7 * line + 7])]
        assert spacing == pytest.approx([25.0] * 6, abs=0.8)  # over the ground 25.0: the lines are not quite straight
    assert [shot.relative_alt for shot in shots] == pytest.approx([30000] * 28, abs=700)
    ahead = [2.0 * (q[1] * q[3] - q[0] * q[2]) for q in (shot.q for shot in shots)]  # of the optical axis, down if -1
    assert min(-down for down in ahead) < -0.9 or max(ahead) > 0.9
    assert ground.command(m.MAV_CMD_REQUEST_MESSAGE, m.MAVLINK_MSG_ID_CAMERA_IMAGE_CAPTURED, 5) == ACCEPTED
    assert images(ground)[-1].image_index == 5


@pytest.mark.parametrize(
    "item",
    [
        plain(m.MAV_CMD_DO_SET_SERVO, 5, 1500),
        place(m.MAV_CMD_NAV_SPLINE_WAYPOINT, 50, 50, 30),
        plain(m.MAV_CMD_DO_GRIPPER, 1, 0),
        plain(m.MAV_CMD_DO_PARACHUTE, 2),
        plain(m.MAV_CMD_DO_WINCH, 1),
        plain(m.MAV_CMD_DO_SET_RELAY, 1, 1),
    ],
    ids=lambda item: str(item.command),
)
def test_what_the_vehicle_lacks_is_refused_by_name(tmp_path, item):
    ground = Bench(tmp_path).station()
    assert ground.upload([*SURVEY[:2], item]) == m.MAV_MISSION_UNSUPPORTED
    name = m.enums["MAV_CMD"][item.command].name.removeprefix("MAV_CMD_")
    assert f"Mission refused: item 2: {name} ({item.command}) is not supported: " in ground.texts()


LANDING = (
    plain(m.MAV_CMD_DO_LAND_START),
    waypoint(0, 60, 20),
    place(m.MAV_CMD_NAV_VTOL_LAND, 0, 30, 0, 0, 0, 0, NAN),
)


@pytest.mark.long
@pytest.mark.parametrize(("kind", "east"), [(1, 30.0), (0, 0.0)])
def test_a_return_flies_the_landing_of_the_mission_by_rtl_type(tmp_path, kind, east):
    settings = Settings(return_type=kind, disarm_after=0.0, leg_mode=1)
    ground = flying(tmp_path, [waypoint(40, 0, 12), *LANDING], up=12.0, settings=settings)
    autopilot = ground.bench.autopilot
    ground.bench.advance(3.0)
    assert autopilot.set_mode(Mode.RTL).accepted
    farthest = [0.0]

    def landed():
        farthest[0] = max(farthest[0], -autopilot.view.p[1])
        return not autopilot.armed

    until(ground, landed, 120.0)
    assert -autopilot.view.p[1] == pytest.approx(east, abs=1.0)
    assert (farthest[0] > 59.0) == (kind == 1)


def test_a_failsafe_returns_by_the_landing_of_the_mission(tmp_path):
    settings = Settings(link_action=2, link_timeout=1.0, leg_mode=1)
    ground = flying(tmp_path, [waypoint(40, 0, 12), *LANDING], up=12.0, settings=settings)
    ground.send(m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    ground.bench.advance(3.0)
    assert ground.bench.autopilot.mode is Mode.RTL
    until(ground, lambda: -ground.bench.autopilot.view.p[1] > 59.0, 60.0)


@pytest.mark.long
def test_the_return_item_of_a_mission_flies_its_landing_and_not_for_ever(tmp_path):
    items = [waypoint(5, 0, 12), plain(m.MAV_CMD_NAV_RETURN_TO_LAUNCH), *LANDING]
    ground = flying(tmp_path, items, up=12.0, settings=Settings(disarm_after=0.0, leg_mode=1))
    until(ground, lambda: not ground.bench.autopilot.armed, 120.0)
    assert -ground.bench.autopilot.view.p[1] == pytest.approx(30.0, abs=1.0)


def test_a_circle_to_a_height_is_left_there_towards_the_next_item(tmp_path):
    items = [place(m.MAV_CMD_NAV_LOITER_TO_ALT, 120, 0, 45, 1, 40, 0, 1), waypoint(400, 0, 45)]
    ground = flying(tmp_path, items, up=30.0)
    until(ground, lambda: ground.bench.autopilot.mission.current == 1, 90.0)
    view = ground.bench.autopilot.view
    assert view.forward
    assert view.p[2] == pytest.approx(45.0, abs=2.5)
    assert math.dist(view.p[:2], (120.0, 0.0)) == pytest.approx(40.0, abs=8.0)
    bearing = math.atan2(-view.p[1], 400.0 - view.p[0])
    assert abs(math.remainder(math.atan2(view.v[1], view.v[0]) - bearing, math.tau)) < math.radians(12.0)


def test_hovering_a_circle_to_a_height_is_its_point(tmp_path):
    items = [place(m.MAV_CMD_NAV_LOITER_TO_ALT, 10, 0, 9, 1, 40, 0, 1)]
    ground = flying(tmp_path, items, up=6.0, settings=Settings(leg_mode=1))
    until(ground, lambda: ground.bench.autopilot.mission.finished, 30.0)
    assert ground.bench.autopilot.view.p == pytest.approx((10.0, 0.0, 9.0), abs=0.6)


def test_a_hovering_vehicle_turns_to_a_region_of_interest_and_its_camera_looks_there(tmp_path):
    roi = place(m.MAV_CMD_DO_SET_ROI_LOCATION, 0, 30, 0)
    image = plain(m.MAV_CMD_IMAGE_START_CAPTURE, 0, 0, 1)
    ground = flying(tmp_path, [roi, waypoint(0, 0, 10), plain(m.MAV_CMD_NAV_DELAY, 8), image], up=10.0)
    until(ground, lambda: bool(images(ground)), 20.0)
    assert math.degrees(ground.bench.autopilot.view.heading) == pytest.approx(-90.0, abs=3.0)
    w, x, y, z = images(ground)[0].q
    assert math.degrees(math.asin(2.0 * (w * y - z * x))) == pytest.approx(-18.4, abs=1.0)  # 10 m down on 30 m
    assert math.degrees(math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))) == pytest.approx(90.0, abs=1.0)
    assert ground.command(m.MAV_CMD_DO_SET_ROI_NONE) == ACCEPTED
    assert ground.bench.autopilot._flight.roi is None


def test_an_item_moves_home_and_everyone_is_told(tmp_path):
    home = place(m.MAV_CMD_DO_SET_HOME, 5, -3, 0, 0)
    ground = flying(tmp_path, [home, plain(m.MAV_CMD_NAV_DELAY, 2)], up=5.0)
    ground.bench.advance(0.5)
    assert ground.bench.autopilot.world.home == pytest.approx((5.0, 3.0, 0.0), abs=0.02)
    assert "Home is 5.0 m north, -3.0 m east, 0.0 m up" in ground.texts()
    again = Bench(tmp_path, up=5.0)
    assert again.autopilot.world.home == pytest.approx((5.0, 3.0, 0.0), abs=0.02)


def test_a_home_that_cannot_be_is_refused_by_item_and_the_mission_goes_on(tmp_path):
    home = place(m.MAV_CMD_DO_SET_HOME, 5, 0, -50, 0)
    ground = flying(tmp_path, [home, waypoint(1, 0, 5)], up=5.0)
    ground.bench.advance(3.0)
    assert "Item 0: DO_SET_HOME denied: it would be 50.0 m under the ground" in ground.texts()
    assert ground.bench.autopilot.mission.finished


def test_an_item_takes_the_fence_out_of_force_until_the_vehicle_is_disarmed(tmp_path):
    bench = Bench(tmp_path, up=5.0, settings=Settings(fence_distance=40.0))
    ground = bench.station()
    off = plain(m.MAV_CMD_DO_FENCE_ENABLE, 0)
    ground.upload([off, plain(m.MAV_CMD_NAV_DELAY, 3), plain(m.MAV_CMD_DO_FENCE_ENABLE, 1)])
    bench.autopilot.missions.start()
    bench.advance(1.0)
    assert bench.autopilot.world.fence.max_distance == 0.0
    bench.advance(3.0)
    assert bench.autopilot.world.fence.max_distance == 40.0
    assert ground.command(m.MAV_CMD_DO_FENCE_ENABLE, 0) == ACCEPTED
    assert bench.autopilot.world.fence.max_distance == 0.0
    bench.autopilot.arming.disarm(force=True)
    bench.advance(1.0)
    assert bench.autopilot.world.fence.max_distance == 40.0


def test_a_fence_that_the_settings_have_off_is_not_put_in_force(tmp_path):
    ground = Bench(tmp_path, settings=Settings(fence_action=0)).station()
    assert ground.command(m.MAV_CMD_DO_FENCE_ENABLE, 1) == DENIED
    assert "DO_FENCE_ENABLE denied: GF_ACTION is 0 (off)" in ground.texts()


def test_images_are_in_the_flight_log(tmp_path):
    recorder = FlightRecorder(tmp_path / "logs", lambda: 1.7e9)
    bench = Bench(tmp_path / "state", node_options={"recorder": recorder})
    ground = bench.station()
    assert bench.autopilot.arming.arm().accepted
    bench.advance(0.1)
    assert ground.command(m.MAV_CMD_DO_DIGICAM_CONTROL) == ACCEPTED
    bench.advance(0.2)
    assert bench.autopilot.arming.disarm().accepted
    bench.advance(1.5)
    (log,) = recorder.logs()
    assert len(read_tlog(tmp_path / "logs" / log.name).rows("CAMERA_IMAGE_CAPTURED")) == 1


def test_images_stop_while_the_mission_is_left_and_a_restart_ends_them(tmp_path):
    items = [plain(m.MAV_CMD_IMAGE_START_CAPTURE, 0, 0.5, 0), plain(m.MAV_CMD_NAV_DELAY, 60)]
    ground = flying(tmp_path, items, up=5.0)
    ground.bench.advance(2.0)
    taken = len(images(ground))
    assert taken == pytest.approx(4, abs=1)
    ground.bench.autopilot.guided.hold()
    ground.bench.advance(3.0)
    assert len(images(ground)) == taken
    assert ground.bench.autopilot.missions.start().accepted
    ground.bench.advance(2.0)
    assert len(images(ground)) > taken


def test_commands_outside_a_mission_do_the_same(tmp_path):
    bench = Bench(tmp_path, up=5.0)
    ground = bench.station()
    assert ground.command(m.MAV_CMD_IMAGE_START_CAPTURE, 0, 1.0, 3) == ACCEPTED
    bench.advance(4.0)
    assert len(images(ground)) == 3
    assert ground.command(m.MAV_CMD_DO_MOUNT_CONTROL, -90, 0, 0, 0, 0, 0, 2) == ACCEPTED
    assert ground.command(m.MAV_CMD_DO_DIGICAM_CONTROL, 0, 0, 0, 0, 1) == ACCEPTED
    bench.advance(0.2)
    w, x, y, z = images(ground)[-1].q
    assert 2.0 * (w * y - z * x) == pytest.approx(-1.0)
    assert ground.command(m.MAV_CMD_SET_CAMERA_MODE, 0, 1) == ACCEPTED
    assert ground.command(m.MAV_CMD_VIDEO_START_CAPTURE) == ACCEPTED
    bench.advance(1.0)
    assert ground.command(m.MAV_CMD_REQUEST_CAMERA_CAPTURE_STATUS, 1) == ACCEPTED
    status = ground.last("CAMERA_CAPTURE_STATUS")
    assert (status.video_status, status.image_count) == (1, 4)
    assert status.recording_time_ms == pytest.approx(1000, abs=50)
    assert ground.command(m.MAV_CMD_REQUEST_MESSAGE, m.MAVLINK_MSG_ID_CAMERA_SETTINGS) == ACCEPTED
    assert ground.last("CAMERA_SETTINGS").mode_id == 1
    for older in (m.MAV_CMD_REQUEST_CAMERA_SETTINGS, m.MAV_CMD_REQUEST_STORAGE_INFORMATION):
        assert ground.command(older, 1) == ACCEPTED
    assert ground.command(m.MAV_CMD_REQUEST_CAMERA_INFORMATION, 1) == ACCEPTED
    assert ground.last("CAMERA_INFORMATION").camera_device_id == 1
    assert ground.command(m.MAV_CMD_REQUEST_MESSAGE, m.MAVLINK_MSG_ID_STORAGE_INFORMATION) == ACCEPTED
    assert ground.last("STORAGE_INFORMATION").used_capacity == 4 * 8.0
    assert ground.command(m.MAV_CMD_SET_CAMERA_MODE, 0, 7) == DENIED
    assert "SET_CAMERA_MODE denied: param2 is 7, not 0, 1 or 2 (CAMERA_MODE)" in ground.texts()
    assert ground.command(m.MAV_CMD_CONDITION_DELAY, 3) == UNSUPPORTED


def test_a_turn_on_command_keeps_its_heading(tmp_path):
    bench = Bench(tmp_path, up=5.0)
    ground = bench.station()
    assert ground.command(m.MAV_CMD_CONDITION_YAW, 90, 30, 1, 0) == ACCEPTED
    bench.advance(6.0)
    assert math.degrees(bench.autopilot.view.heading) == pytest.approx(-90.0, abs=3.0)
    assert bench.autopilot.guided.go_to((2.0, 0.0, 5.0)).accepted
    bench.advance(5.0)
    assert math.degrees(bench.autopilot.view.heading) == pytest.approx(-90.0, abs=3.0)
