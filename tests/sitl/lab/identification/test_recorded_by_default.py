"""Logs that the product records by itself are accepted for identification, and their intervals hold."""

import numpy as np
import pytest

from sitl.lab.identification.flight_log import LogConventions, SensorRecord, Series, read_flight
from sitl.lab.identification.identify_flight import identify_record
from sitl.lab.identification.result import EFFECTS, effect_values
from sitl.lab.identification.unknowns import of_mass, value_of
from sitl.mavlink import flight_recorder
from sitl.model.airframe_files import load
from tests.support.lab.identified_flight import flown, read
from tests.support.vehicle.file_session import FileSession

VEHICLE_RATES, STATION_RATES = (50.0, 50.0), (10.0, 20.0)  # of the IMU and the commands, as recorded by default [Hz]


def recorded(folder):
    session = FileSession(folder)
    session.fly(2.0)
    session.disarm()
    session.fly(0.1)
    return folder / "logs" / session.recorder.logs()[0].name


@pytest.mark.parametrize("rates", [VEHICLE_RATES, STATION_RATES])
def test_a_log_of_the_default_rates_has_all_that_it_takes(tmp_path, monkeypatch, rates):
    if rates == STATION_RATES:  # which records what telemetry it gets
        monkeypatch.setattr(flight_recorder, "OFTEN_RECORDED", ())
    record = read_flight(recorded(tmp_path), LogConventions(None, load("physical").parameters))
    assert record.imu.rate == pytest.approx(rates[0], rel=0.01)
    assert record.commands.rate >= 0.99 * rates[1]
    assert min(record.attitude.rate, record.motion.rate) >= 19.9
    assert record.sources == ("HIGHRES_IMU", "DARKO_ACTUATORS", "ATTITUDE_QUATERNION", "LOCAL_POSITION_NED")


def at_rate(series, rate):
    every = round(series.rate / rate)
    return Series(series.time[::every], series.values[::every])


@pytest.mark.parametrize("rates", [VEHICLE_RATES, STATION_RATES])
def test_intervals_hold_at_the_default_rates(rates):
    base, whole = load("physical").parameters, read("physical", 3)
    imu, commands = at_rate(whole.imu, rates[0]), at_rate(whole.commands, rates[1])
    slow = [at_rate(series, 20.0) for series in (whole.attitude, whole.motion)]
    found = identify_record(SensorRecord(imu, commands, *slow, whole.sources), base)
    true = flown("physical", 3)[0]
    truths = [*effect_values(true, base), *(value_of(of_mass(true, base.m), row.key) for row in found.parameters)]
    rows = [*found.effects, *found.parameters]
    held = [abs(row.estimate - truth) <= row.interval for row, truth in zip(rows, truths, strict=True)]
    assert sum(held) >= 0.9 * len(held)
    told = [row for row in found.effects if row.interval < abs(row.estimate)]
    assert len(told) >= len(EFFECTS) - 3  # intervals that say nothing would hold it too
    assert np.isfinite([row.interval for row in rows]).all()
    assert "intervals are 2 times as wide" in found.remarks[0]
