"""A recorded flight as time series on the vehicle's own clock."""

import numpy as np
import pytest

from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.flight_log.flight_clock import flight_clock
from protocol.flight_log.flight_series import flight_series
from protocol.tlog import TlogReader, read_tlog
from tests.support.gcs.globe import no_fix, on_globe
from tests.support.gcs.messages import heartbeat
from tests.support.logs import bare, quadplane_log
from tests.support.paths import DATA

SQUARE = DATA / "square-flight.tlog"
VEHICLE = (1, 1)


def recorded(*messages, rate=100.0):
    """A log of messages that were recorded 1 / rate seconds apart."""
    records = [round(1e6 + k * 1e6 / rate).to_bytes(8, "big") + bare(m) for k, m in enumerate(messages)]
    return TlogReader(b"".join(records))


def attitude(boot):
    return mavlink.MAVLink_attitude_message(boot, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_a_simulation_that_ran_ten_times_as_fast_has_its_own_time():
    reader = recorded(*(attitude(5000 + 100 * k) for k in range(50)))
    assert flight_clock(reader, VEHICLE).arrivals == pytest.approx(0.1 * np.arange(50))


def test_time_goes_on_over_a_restart():
    reader = recorded(*(attitude(boot) for boot in (90_000, 90_010, 90_020, 50, 60, 70)))
    times = flight_clock(reader, VEHICLE).arrivals
    assert times == pytest.approx(0.01 * np.arange(6), abs=1e-6)


def test_two_messages_of_one_time_are_no_restart():
    reader = recorded(*(attitude(boot) for boot in (1000, 1000, 1020, 1020)))
    assert flight_clock(reader, VEHICLE).arrivals == pytest.approx([0.0, 0.0, 0.02, 0.02])


@pytest.mark.parametrize(("leap", "passed"), [(60_009, 60.009), (60_011, 0.01)])
def test_a_leap_of_more_than_a_minute_is_a_restart(leap, passed):
    reader = recorded(*(attitude(boot) for boot in (0, 10, 20, 30, 30 + leap)))
    assert flight_clock(reader, VEHICLE).arrivals[-1] == pytest.approx(0.03 + passed)


@pytest.mark.parametrize(("leap", "passed"), [(1_000_000, 1000.0), (1_000_020, 0.01)])
def test_in_a_fast_simulation_a_leap_of_more_than_ten_messages_is_a_restart(leap, passed):
    """Ten thousand times as fast as the recorder's clock: 100 s between its messages."""
    reader = recorded(*(attitude(boot) for boot in (0, 100_000, 200_000, 300_000, 300_000 + leap)))
    assert flight_clock(reader, VEHICLE).arrivals[-1] == pytest.approx(300.0 + passed)


def test_messages_between_two_timed_ones_stand_between_them():
    beat = mavlink.MAVLink_heartbeat_message(20, 12, 0, 0, 4, 3)
    reader = recorded(beat, attitude(1000), beat, attitude(3000), beat)
    assert flight_clock(reader, VEHICLE).arrivals == pytest.approx([0.0, 1.0, 2.0, 3.0, 3.01])


def test_a_flight_has_every_series_and_its_events_in_order():
    flight = flight_series(read_tlog(SQUARE), "square")
    assert flight.duration == pytest.approx(34.4, abs=0.2)
    assert min(map(len, (flight.position, flight.hybrid, flight.actuators, flight.energy, flight.target))) > 50
    times = [event.time for event in flight.events]
    assert times == sorted(times)
    assert [event.label for event in flight.events if event.kind == "jump"] == [
        "hover zero-moment", "hover linear", "landed",
    ]  # fmt: skip
    assert set(flight.laws()) == {"LANDED", "HOVER_LINEAR"}


def test_a_flight_told_on_the_globe_alone_has_a_path():
    flight = flight_series(
        recorded(heartbeat(), no_fix(900), *(on_globe(1000 + k, 5.0 * k, up=k) for k in range(9))), "x"
    )
    path = flight.position.fields
    assert path["x"] == pytest.approx(5.0 * np.arange(9), abs=0.02)
    assert path["z"] == pytest.approx(-np.arange(9.0))
    assert len(flight.position.times) == 9
    assert not len(flight_series(recorded(heartbeat(), no_fix(900)), "x").position)


def test_a_flight_lasts_from_its_first_record_to_its_last():
    assert flight_series(
        recorded(heartbeat(), attitude(1000), attitude(3000), heartbeat()), "x"
    ).duration == pytest.approx(4.01)


def test_another_autopilot_has_its_path_and_outputs():
    flight = flight_series(TlogReader(quadplane_log()), "quadplane")
    assert len(flight.servos) > 100
    assert not len(flight.hybrid)


def test_a_log_of_stations_alone_has_no_flight():
    station = mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3)
    with pytest.raises(FileError, match="here: no vehicle"):
        flight_series(recorded(station), "here")
