"""Motive, bridge and vehicle: it waits for poses, takes off and hovers on nothing else, and lands without them."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.wire.signing import Keyring
from sitl.motion_capture.cameras import HallAxes
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import EXTERNAL_POSE, FIRST_DELAYED
from sitl.simulation.avionics import Navigation
from sitl.vehicle.parameters import WorldSettings
from tests.support.motion_capture.hall import Hall
from tests.support.vehicle.fake_station import FakeStation
from tests.support.vehicle.signed_station import KEY, T

TAKE_OFF, ARM = mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_COMPONENT_ARM_DISARM
EXTERNAL = {"navigation": Navigation.MOCAP, "world_settings": WorldSettings(motion_capture=0)}


@pytest.fixture
def standing(tmp_path):
    return FakeStation.with_vehicle(tmp_path, aligned=False, **EXTERNAL)


@pytest.fixture
def hovering(tmp_path):
    return FakeStation.with_vehicle(tmp_path, up=3.0, **EXTERNAL)


@pytest.mark.long
def test_it_takes_off_and_hovers_on_nothing_but_the_stream(standing):
    hall, off = Hall(standing, group="239.255.42.99", rate=100.0), []

    def compare():
        off.append(math.dist(standing.vehicle.estimate.position, standing.vehicle.truth.body.position))

    assert standing.command(ARM, 1) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert "waiting for poses of motion capture" in standing.texts()
    hall.fly(2.5)
    assert standing.command(ARM, 1) == mavlink.MAV_RESULT_ACCEPTED
    assert standing.command(TAKE_OFF) == mavlink.MAV_RESULT_ACCEPTED
    hall.fly(6.5, compare)
    assert math.dist(standing.vehicle.truth.body.position, (0.0, 0.0, 2.5)) < 0.3
    assert max(off) < 0.06
    assert "ODOMETRY refused" not in standing.texts()


@pytest.mark.long
@pytest.mark.parametrize(
    ("version", "axes"),
    [((3, 1), HallAxes()), ((4, 1), HallAxes("y", "right", -23.0, "left"))],
    ids=["3.1, ENAC", "4.1, y up and turned"],
)
def test_hovering_on_the_stream_it_knows_its_place_to_a_millimetre(hovering, version, axes):
    hall, off = Hall(hovering, version=version, axes=axes), []
    hall.fly(1.0)
    hall.fly(
        2.0, lambda: off.append(math.dist(hovering.vehicle.estimate.position, hovering.vehicle.truth.body.position))
    )
    assert math.sqrt(sum(each**2 for each in off) / len(off)) < 1e-3


@pytest.mark.long
def test_when_tracking_is_lost_in_flight_it_lands_and_both_sides_say_so(hovering):
    hall = Hall(hovering, events=["lost@1"], rate=100.0)
    hall.fly(4.0)
    assert "tracking lost: nothing is sent" in hall.bridge.said
    assert "No position for 2 s: landing" in hovering.texts()


@pytest.mark.long
def test_it_hovers_through_a_swap_of_markers_that_turns_the_body_half_round(hovering):
    hall, tilted = Hall(hovering, events=["swap@1+1"], rate=100.0), []
    hall.fly(3.5, lambda: tilted.append(hovering.bench.aircraft.view().tilt))
    assert any("the rigid body jumped" in line for line in hall.bridge.said)
    assert "the rigid body is back: poses are sent again" in hall.bridge.said
    assert max(tilted) < math.radians(15.0)
    assert math.dist(hovering.vehicle.truth.body.position, (0.0, 0.0, 3.0)) < 0.5


@pytest.mark.long
def test_it_hovers_through_frames_that_do_not_arrive(hovering):
    hall = Hall(hovering, events=["dropped@1+0.5"], dropout=0.2, rate=100.0)
    hall.fly(3.0)
    assert math.dist(hovering.vehicle.truth.body.position, (0.0, 0.0, 3.0)) < 0.5


@pytest.mark.long
@pytest.mark.parametrize(("clock", "used", "off"), [("auto", "server", 0.0025), ("vehicle", "vehicle", 0.005)])
def test_the_vehicle_takes_poses_as_of_their_exposure_however_late_they_come(hovering, clock, used, off):
    hall = Hall(hovering, rate=50.0, delay=0.03, jitter=0.004, clock=clock)
    hall.fly(2.5)
    assert hall.autopilot.clock == used
    sampled = hovering.vehicle.avionics.instruments["sampled"][EXTERNAL_POSE - FIRST_DELAYED] * PERIOD
    assert len(sampled) > 3
    assert max(abs(time - round(time * 50.0) / 50.0) for time in sampled) < off


@pytest.mark.parametrize(("key", "is_taken"), [(KEY, True), (None, False)])
def test_a_vehicle_with_a_key_takes_signed_poses_alone(tmp_path, key, is_taken):
    keyring = Keyring({None: KEY}, timestamp=T)
    station = FakeStation.with_vehicle(tmp_path, up=3.0, node_options={"keyring": keyring}, **EXTERNAL)
    hall = Hall(station, key=key, rate=50.0)
    hall.fly(1.0)
    assert hall.watch.is_seen(station.bench.now) == is_taken
    assert (station.vehicle.avionics.instruments["sampled"][EXTERNAL_POSE - FIRST_DELAYED].max() > 0) == is_taken
