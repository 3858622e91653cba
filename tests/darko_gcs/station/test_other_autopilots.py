"""Messages of another autopilot over the link reach the screen, as they do from a recording."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega

from darko_gcs.state.reduce import HANDLERS
from darko_gcs.station.station import Station
from darko_gcs.tui.widgets.flight_panel import FlightPanel
from protocol.dialect import mavlink
from tests.support.gcs.screens import line_text

DIALECT = {known.msgname for known in mavlink.mavlink_map.values()}
WINDS = (
    ardupilotmega.MAVLink_wind_message(90.0, 5.0, 3.0),
    ardupilotmega.MAVLink_wind_cov_message(0, 0.0, -4.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0),
)


def heard(*messages):
    """The station's snapshot after datagrams of an ArduPilot."""
    return station_after(*messages).snapshot


def station_after(*messages):
    """A station after datagrams of an ArduPilot."""
    station, mav = Station(), ardupilotmega.MAVLink(None, srcSystem=1, srcComponent=1)
    beat = ardupilotmega.MAVLink_heartbeat_message(1, ardupilotmega.MAV_AUTOPILOT_ARDUPILOTMEGA, 0, 0, 4, 3)
    for message in (beat, *messages):
        station.receive(bytes(message.pack(mav)), 1.0, 1)
    return station


@pytest.mark.parametrize("wind", WINDS, ids=("WIND", "WIND_COV"))
def test_the_wind_of_another_autopilot_is_on_the_flight_panel(wind):
    s = heard(wind)
    assert s.estimates.wind == pytest.approx((0.0, -4.0, 3.0))
    lines = [line_text(line) for line in FlightPanel("Flight", id="flight").draw(s, 40, 20)]
    assert any("4.0 m/s from 090°" in line for line in lines)


def test_every_message_that_fills_the_snapshot_can_be_received():
    assert set(HANDLERS.names) <= DIALECT


@pytest.mark.parametrize(("capabilities", "value"), [(0, 2.0), (1 << 17, 2.0), (1 << 4, 0.0)])
def test_parameters_of_an_ardupilot_are_read_as_its_capabilities_say(capabilities, value):
    version = ardupilotmega.MAVLink_autopilot_version_message(
        capabilities, 0, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0
    )
    parameter = ardupilotmega.MAVLink_param_value_message(b"FENCE_ACTION", 2.0, 2, 1, 0)
    assert heard(version, parameter).parameters.values == {"FENCE_ACTION": value}


def test_one_parameter_is_asked_for_by_its_name():
    station = station_after()
    station.fetch_parameter("SYS_FAILURE_EN", 1.0)
    assert any(b"SYS_FAILURE_EN" in datagram for datagram in station.endpoint.datagrams_to_send())
