"""Modes by name, orbits and refusals, on the wire."""

import math

import pytest
from pymavlink.dialects.v20 import all as published

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.names import Mode, custom_mode
from sitl.mavlink.standard_modes import AVAILABLE_MODES, STANDARD_MODES
from tests.support.vehicle.fake_station import HOME, FakeStation


def command(ground, number, *params):
    """Send a COMMAND_LONG; the result of its acknowledgement."""
    full = [*params, *[0.0] * (7 - len(params))]
    ground.send(mavlink.MAVLink_command_long_message(1, 1, number, 0, *full))
    ack = ground.last("COMMAND_ACK")
    assert ack.command == number
    return ack.result


def orbit(ground, radius, speed, height, frame=mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT):
    place = (round(HOME.lat_deg * 1e7), round(HOME.lon_deg * 1e7), height)
    nothing = math.nan
    ground.send(mavlink.MAVLink_command_int_message(1, 1, frame, 34, 0, 0, radius, speed, 0.0, nothing, *place))
    return ground.last("COMMAND_ACK").result


@pytest.fixture
def standing(tmp_path):
    return FakeStation.with_vehicle(tmp_path)


@pytest.fixture
def hovering(tmp_path):
    return FakeStation.with_vehicle(tmp_path, up=3.0)


@pytest.mark.parametrize("name", ["available_modes", "current_mode"])
def test_the_messages_are_those_of_the_published_dialect(name):
    ours, theirs = (getattr(dialect, f"MAVLink_{name}_message") for dialect in (mavlink, published))
    assert (ours.id, ours.crc_extra) == (theirs.id, theirs.crc_extra)
    assert (ours.ordered_fieldnames, ours.lengths) == (theirs.ordered_fieldnames, theirs.lengths)


def test_all_modes_and_laws_are_listed_once_and_by_name(standing):
    assert command(standing, 512, 435, 0) == mavlink.MAV_RESULT_ACCEPTED
    listed = [m for m in standing.heard if m.get_type() == "AVAILABLE_MODES"]
    assert [m.mode_index for m in listed] == list(range(1, len(AVAILABLE_MODES) + 1))
    assert {m.number_modes for m in listed} == {len(AVAILABLE_MODES)}
    assert len({m.custom_mode for m in listed}) == len(listed)
    assert {m.standard_mode for m in listed if not m.mode_name} == set(STANDARD_MODES.values())
    named = {m.mode_name: m.properties for m in listed if m.mode_name}
    assert {"Hold", "Offboard", "Law: hover zero moment", "Law: to forward"} <= set(named)
    hidden = [name for name, flags in named.items() if flags & mavlink.MAV_MODE_PROPERTY_NOT_USER_SELECTABLE]
    assert len(hidden) == len(Law)


def test_one_mode_is_sent_by_its_number_and_a_wrong_number_is_denied(standing):
    assert command(standing, 512, 435, 3) == mavlink.MAV_RESULT_ACCEPTED
    assert command(standing, 512, 435, len(AVAILABLE_MODES) + 1) == mavlink.MAV_RESULT_DENIED
    sent = [m.mode_index for m in standing.heard if m.get_type() == "AVAILABLE_MODES"]
    assert sent == [3]


def test_the_current_mode_is_sent_at_once_with_the_requested_one(hovering):
    assert hovering.last("CURRENT_MODE") is None
    hovering.ask_for("AVAILABLE_MODES")  # as QGroundControl does when it connects
    assert command(hovering, 262, mavlink.MAV_STANDARD_MODE_LAND) == mavlink.MAV_RESULT_ACCEPTED
    sent = hovering.last("CURRENT_MODE")
    assert sent.custom_mode == sent.intended_custom_mode == custom_mode(Mode.LAND)
    assert sent.standard_mode == mavlink.MAV_STANDARD_MODE_LAND


@pytest.mark.parametrize("wanted", [mavlink.MAV_STANDARD_MODE_CRUISE, mavlink.MAV_STANDARD_MODE_NON_STANDARD, 77, -1])
def test_an_unavailable_standard_mode_fails(hovering, wanted):
    assert command(hovering, 262, wanted) == mavlink.MAV_RESULT_FAILED
    assert hovering.node.aircraft.autopilot.mode is Mode.HOLD


@pytest.mark.parametrize(
    ("height", "frame", "up"), [(25.0, 3, 25.0), (HOME.alt + 25.0, 3, 25.0), (HOME.alt + 25.0, 0, 25.0)]
)
def test_an_orbit_is_flown_at_the_intended_height(hovering, height, frame, up):
    assert orbit(hovering, 40.0, 15.0, height, frame) == mavlink.MAV_RESULT_ACCEPTED
    hovering.advance(0.1)
    path = hovering.node.aircraft.autopilot.reference.path
    assert path.start == pytest.approx((0.0, 0.0, up), abs=0.02)
    assert abs(path.radius) == 40.0


@pytest.mark.parametrize(
    ("radius", "speed", "height"),
    [(2.0, 15.0, 25.0), (40.0, 3.0, 25.0), (40.0, 80.0, 25.0), (math.inf, 15.0, 25.0), (40.0, 15.0, 9000.0)],
)
def test_an_orbit_that_cannot_be_flown_is_denied_and_nothing_changes(hovering, radius, speed, height):
    before = hovering.node.aircraft.autopilot.reference
    assert orbit(hovering, radius, speed, height) == mavlink.MAV_RESULT_DENIED
    assert hovering.node.aircraft.autopilot.reference is before
    assert "Orbit denied" in "".join(m.text for m in hovering.heard if m.get_type() == "STATUSTEXT")


def test_an_orbit_from_the_ground_is_temporarily_rejected(standing):
    assert orbit(standing, 40.0, 15.0, 25.0) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED


def test_flight_termination_is_unsupported_and_explained(standing):
    assert command(standing, mavlink.MAV_CMD_DO_FLIGHTTERMINATION, 1.0) == mavlink.MAV_RESULT_UNSUPPORTED
    assert standing.last("STATUSTEXT") is not None


def test_the_identity_is_in_the_heartbeat_and_the_modes_stay(tmp_path):
    options = {"autopilot_type": mavlink.MAV_AUTOPILOT_GENERIC}
    ground = FakeStation.with_vehicle(tmp_path, node_options=options)
    ground.advance(0.1)
    sent = ground.last("HEARTBEAT")
    assert (sent.autopilot, sent.custom_mode) == (mavlink.MAV_AUTOPILOT_GENERIC, custom_mode(Mode.HOLD))
