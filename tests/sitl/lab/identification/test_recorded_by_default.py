"""Logs that the product records by itself are accepted for identification, and their intervals hold."""

import numpy as np
import pytest

from protocol.flight_plans.plan_loader import SHIPPED_PLANS
from sitl.day import fly_day, load_day
from sitl.lab.identification.flight_log import LogConventions, SensorRecord, Series, read_flight
from sitl.lab.identification.flown_log import off_airframe
from sitl.lab.identification.identify_flight import identify_record
from sitl.lab.identification.result import EFFECTS, effect_values
from sitl.lab.identification.unknowns import of_mass, value_of
from sitl.mavlink import flight_recorder
from sitl.model.airframe_files import load
from tests.support.lab.identified_flight import flown, read
from tests.support.vehicle.file_session import FileSession

PLAN = SHIPPED_PLANS / "voliere.xml"

STEPS = (  # of the place that it hovers at, one every 2.5 s: metres east, north, up
    (1.6, 1.6, 1.7), (-1.5, -0.9, 2.6), (0.9, -0.7, 2.3), (0.4, 0.3, 3.0), (-1.3, 1.1, 1.8), (1.4, -1.5, 2.9),
    (-0.6, 1.5, 2.0), (1.7, 0.2, 2.8), (-1.7, -1.2, 1.7), (0.0, 0.9, 3.1), (1.1, -1.1, 2.2), (-0.8, 1.7, 2.7),
)  # fmt: skip
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
    record = read_flight(recorded(tmp_path), LogConventions(None, load("collage").parameters))
    assert record.imu.rate == pytest.approx(rates[0], rel=0.01)
    assert record.commands.rate >= 0.99 * rates[1]
    assert min(record.attitude.rate, record.motion.rate) >= 19.9
    assert record.sources == ("HIGHRES_IMU", "DARKO_ACTUATORS", "ATTITUDE_QUATERNION", "LOCAL_POSITION_NED")


def at_rate(series, rate):
    every = round(series.rate / rate)
    return Series(series.time[::every], series.values[::every])


@pytest.mark.long
@pytest.mark.parametrize("rates", [VEHICLE_RATES, STATION_RATES])
def test_intervals_hold_at_the_default_rates(rates):
    base, whole = load("collage").parameters, read("collage", 3)
    imu, commands = at_rate(whole.imu, rates[0]), at_rate(whole.commands, rates[1])
    slow = [at_rate(series, 20.0) for series in (whole.attitude, whole.motion)]
    found = identify_record(SensorRecord(imu, commands, *slow, whole.sources), base)
    true = flown("collage", 3)[0]
    truths = [*effect_values(true, base), *(value_of(of_mass(true, base.m), row.key) for row in found.parameters)]
    rows = [*found.effects, *found.parameters]
    held = [abs(row.estimate - truth) <= row.interval for row, truth in zip(rows, truths, strict=True)]
    assert sum(held) >= 0.9 * len(held)
    told = [row for row in found.effects if row.interval < abs(row.estimate)]
    assert len(told) >= len(EFFECTS) - 3  # intervals that say nothing would hold it too
    assert np.isfinite([row.interval for row in rows]).all()
    assert "intervals are 2 times as wide" in found.remarks[0]


@pytest.mark.long
def test_intervals_of_a_flight_that_the_vehicle_recorded_hold(tmp_path):
    """On instruments under a net without wind, from a set that is 20 % off: what the hover tells is right."""
    lines = [f'name = "steps"\nseed = 3\nduration = 46.0\narena = "voliere"\nplan = "{PLAN}"\nairframe = "collage"']
    lines.append('[[operator]]\nat = 4.0\nblock = "Takeoff"')
    for number, place in enumerate(STEPS):
        at = 14.0 + 2.5 * number
        lines.append(f'[[operator]]\nat = {at}\nwaypoint = "STDBY"\nto = {list(place)}')
    path = tmp_path / "steps.toml"
    path.write_text("\n".join(lines))
    log = fly_day(load_day(path), tmp_path).log
    true = load("collage").parameters
    base = off_airframe(true, 0.2, 3)
    found = identify_record(read_flight(log, LogConventions(None, base)), base)
    truths = [*effect_values(true, base), *(value_of(of_mass(true, base.m), row.key) for row in found.parameters)]
    told = [pair for pair in zip([*found.effects, *found.parameters], truths, strict=True) if pair[0].told]
    assert len(told) >= 20
    missed = {row.key or row.name for row, truth in told if abs(row.estimate - truth) > row.interval}
    # A hover has the drag of the slipstream with the thrust; of twenty intervals of 95 % one may miss.
    assert len(missed - {"k_f", "thrust coefficient / mass"}) <= 1
    found = {row.key: (row.estimate, truth) for row, truth in told}
    assert found["k_f"][0] == pytest.approx(found["k_f"][1], rel=0.02)
    assert found["xi_f"][0] == pytest.approx(found["xi_f"][1], rel=0.15)  # vibration made it 1.7 times too large
