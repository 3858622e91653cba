"""Flight by hand over the wire: our station's sticks fly the real vehicle, which leaves POSCTL when they stop."""

import pytest

from darko_gcs.state.parts import Identity
from darko_gcs.state.reduce import reduce
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from darko_gcs.state.sticks import STICK_PERIOD, Sticks
from darko_gcs.state.text import sensor_names
from darko_gcs.tui.screens.preflight_screen import hindrances
from protocol.dialect import mavlink
from protocol.names import Mode
from tests.support.gcs.linked_station import LinkedStation
from tests.support.gcs.messages import arrived

SILENCE = 0.5  # that the vehicle waits for sticks, COM_RC_LOSS_T [s]
HEARTBEAT = 1.0  # by which the station hears of a mode at the latest [s]


def steer(link, seconds, sticks):
    """Send the sticks as the screen does."""
    end = link.now + seconds
    while link.now < end:
        link.station.steer(sticks, link.now)
        link.run(STICK_PERIOD)


@pytest.fixture
def link(tmp_path):
    link = LinkedStation(tmp_path, up=8.0)
    assert link.run(5.0, lambda: link.station.snapshot.status.mode == Mode.HOLD.name)
    return link


def test_sticks_fly_the_vehicle_which_holds_within_half_a_second_of_silence(link):
    steer(link, 0.2, Sticks())
    link.station.set_mode(Mode.POSCTL, link.now)
    steer(link, 3.0, Sticks(forward=1.0))
    autopilot = link.vehicle.aircraft.autopilot
    assert link.station.snapshot.status.mode == Mode.POSCTL.name
    assert link.station.snapshot.position.v[0] > 1.5
    stopped = link.now
    assert link.run(2.0, lambda: autopilot.mode is Mode.HOLD)
    assert link.now - stopped <= SILENCE + 2 * 0.02
    assert link.run(HEARTBEAT, lambda: link.station.snapshot.status.mode == Mode.HOLD.name)


def test_a_link_that_breaks_is_silence_too(link):
    steer(link, 0.2, Sticks())
    link.station.set_mode(Mode.POSCTL, link.now)
    steer(link, 1.0, Sticks(up=0.5))
    link.connected = False
    steer(link, SILENCE + 0.1, Sticks(up=0.5))
    assert link.vehicle.aircraft.autopilot.mode is Mode.HOLD


def test_without_sticks_the_mode_is_refused(link):
    link.station.set_mode(Mode.POSCTL, link.now)
    link.run(1.0)
    assert "no MANUAL_CONTROL" in " ".join(line.text for line in link.station.snapshot.log.lines)
    assert link.vehicle.aircraft.autopilot.mode is Mode.HOLD


def test_the_vehicle_says_what_hinders_arming_and_that_nothing_does(tmp_path):
    link = LinkedStation(tmp_path)
    assert link.run(5.0, lambda: link.station.snapshot.status.prearm_ok)
    asked = link.now
    link.station.check_arming(asked)
    link.run(1.0)
    assert hindrances(link.station.snapshot, asked) == []
    link.station.set_mode(Mode.POSCTL, link.now)
    link.run(1.0)
    asked = link.now
    link.station.check_arming(asked)
    link.run(1.0)
    assert hindrances(link.station.snapshot, asked) == ["mode POSCTL: no MANUAL_CONTROL is arriving"]
    assert hindrances(link.station.snapshot, link.now) == []


def test_an_instrument_that_is_there_enabled_and_does_not_work_is_unhealthy():
    gps, pitot, checks = (
        mavlink.MAV_SYS_STATUS_SENSOR_GPS,
        mavlink.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE,
        mavlink.MAV_SYS_STATUS_PREARM_CHECK,
    )
    told = mavlink.MAVLink_sys_status_message(gps | pitot | checks, gps | checks, 0, 0, 12000, -1, -1, *[0] * 6)
    s = reduce(EMPTY_SNAPSHOT._replace(identity=Identity(source=(1, 1))), arrived(told), 1.0)
    assert s.status.unhealthy == gps
    assert sensor_names(gps | pitot) == ["differential pressure", "gps"]
    assert s.status.prearm_ok is False


@pytest.mark.parametrize(
    ("present", "health", "measured"),
    [
        (
            mavlink.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE,
            mavlink.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE,
            True,
        ),
        (mavlink.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE, 0, False),
        (mavlink.MAV_SYS_STATUS_AHRS, mavlink.MAV_SYS_STATUS_AHRS, False),
        (mavlink.MAV_SYS_STATUS_SENSOR_GPS, mavlink.MAV_SYS_STATUS_SENSOR_GPS, None),
    ],
)
def test_an_airspeed_is_measured_while_a_pitot_tube_works(present, health, measured):
    told = mavlink.MAVLink_sys_status_message(present, present, health, 0, 12000, -1, -1, *[0] * 6)
    s = reduce(EMPTY_SNAPSHOT._replace(identity=Identity(source=(1, 1))), arrived(told), 1.0)
    assert s.status.has_measured_air is measured
