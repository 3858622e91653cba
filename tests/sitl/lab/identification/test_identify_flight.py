"""Identification comes back to airframes that are 20 % off in everything, and says how sure it is."""

import numpy as np
import pytest

from sitl.errors import SitlError
from sitl.lab.identification.flight_log import LogConventions, SensorRecord, Series, read_flight
from sitl.lab.identification.flown_log import HOVER_STEPS, Excitation, fly_excitation, write_log
from sitl.lab.identification.identify_flight import MAX_USED, identify_record, usable_stretches
from sitl.lab.identification.result import EFFECTS, effect_values
from sitl.lab.identification.unknowns import of_mass, value_of, with_values
from sitl.model.airframe_files import load
from tests.support.lab.identified_flight import flown, identified, read, still_record

FLIGHTS = [("nominal", 7), ("collage", 3)]
NEAR = {"thrust coefficient / mass": 0.03, "lift slope / mass": 0.03}  # the others within 10 %


@pytest.mark.long
@pytest.mark.parametrize(("name", "seed"), FLIGHTS)
def test_effects_are_near_the_truth(name, seed):
    base = load(name).parameters
    truth = effect_values(flown(name, seed)[0], base)
    for row, true in zip(identified(name, seed).effects, truth, strict=True):
        assert row.told, row
        assert row.estimate == pytest.approx(true, rel=NEAR.get(row.name, 0.1)), row


@pytest.mark.long
@pytest.mark.parametrize(("name", "seed"), FLIGHTS)
def test_intervals_hold_the_truth(name, seed):
    base, found = load(name).parameters, identified(name, seed)
    true = flown(name, seed)[0]
    truths = [*effect_values(true, base), *(value_of(of_mass(true, base.m), row.key) for row in found.parameters)]
    rows = [*found.effects, *found.parameters]
    held = [abs(row.estimate - truth) <= row.interval for row, truth in zip(rows, truths, strict=True)]
    assert sum(held) >= 0.8 * len(held)
    narrow = [row for row in found.effects if row.interval < 0.1 * abs(row.estimate)]
    assert len(narrow) >= len(EFFECTS) - 2  # intervals that say nothing would hold it too


@pytest.mark.long(after=1)
@pytest.mark.parametrize(("name", "seed"), FLIGHTS)
def test_what_is_left_is_the_sensors_noise(name, seed):
    found = identified(name, seed)
    assert found.after[:3] == pytest.approx(0.3, rel=0.1)
    assert found.after[[3, 5]].max() < 0.01
    assert (found.after <= 1.001 * found.before).all()
    set_before, estimated = found.replay
    assert estimated.position < 0.05 < set_before.position
    assert estimated.attitude < 1.0 < set_before.attitude


@pytest.mark.long(after=1)
@pytest.mark.parametrize(("name", "seed"), FLIGHTS)
def test_the_wind_is_found_beside(name, seed):
    found = identified(name, seed)
    assert found.nuisance.wind == pytest.approx([1.2, -1.6, 0.0], abs=0.1)
    assert abs(found.nuisance.delay) < 1e-3


@pytest.mark.long
def test_commands_that_come_seldom_are_remarked():
    record = read("collage", 3, hovering=True)
    seldom = Series(record.commands.time[::25], record.commands.values[::25])
    imu = Series(record.imu.time[::4], record.imu.values[::4])
    found = identify_record(
        SensorRecord(imu, seldom, record.attitude, record.motion, record.sources), load("collage").parameters
    )
    assert found.remarks[0] == (
        "commands at 20 Hz: what lies between them is guessed; intervals are 2 times as wide for it, those of rate "
        "limits 10 times"
    )
    assert not any(remark.startswith("commands at") for remark in identified("collage", 3, hovering=True).remarks)


def test_what_a_hover_cannot_tell_is_said():
    found = identified("collage", 3, hovering=True)
    assert {row.name for row in found.effects if not row.told} >= {e.name for e in EFFECTS if e.forward}
    assert found.directions[0] < found.directions[1]
    assert found.untold[0].startswith("forward flight: at most ")
    untold = {row.key for row in found.parameters if not row.told}
    assert "C_nr" in untold
    assert any(line == "C_nr, yaw damping: it takes forward flight" for line in found.untold)
    thrust = found.effects[0]
    truth = effect_values(flown("collage", 3, hovering=True)[0], load("collage").parameters)[0]
    assert thrust.told
    assert thrust.estimate == pytest.approx(truth, rel=0.03)


# Parts of a log that are used for identification.


COLLAGE = load("collage").parameters


def spans(record):
    return [(s.time[0], s.time[-1]) for s in usable_stretches(record, COLLAGE)]


def without(series, begin, end):
    kept = (series.time < begin) | (series.time > end)
    return Series(series.time[kept], series.values[kept])


@pytest.mark.parametrize("field", ["imu", "commands", "attitude", "motion"])
def test_a_gap_of_any_sensor_parts_the_flight(field):
    record = still_record(30.0)
    parts = {name: getattr(record, name) for name in ("imu", "commands", "attitude", "motion")}
    parts[field] = without(parts[field], 10.0, 12.0)
    (first, second) = spans(SensorRecord(**parts, sources=record.sources))
    assert first == pytest.approx((0.5, 9.5), abs=0.1)
    assert second == pytest.approx((12.5, 29.5), abs=0.1)


def test_the_ground_is_where_the_vehicle_was_with_its_motors_off():
    record = still_record(30.0, height=0.2)
    record.commands.values[record.commands.time < 5.0, :2] = 0.0
    record.motion.values[record.motion.time > 12.0, 2] = 3.0  # on the ground until then
    (only,) = spans(record)
    assert only == pytest.approx((12.5, 29.5), abs=0.1)


def test_a_blow_is_left_out():
    record = still_record(30.0)
    record.imu.values[1500, 4] = 100.0
    assert [round(end - begin) for begin, end in spans(record)] == [13, 13]


def test_of_a_long_flight_the_part_that_turns_most_is_used():
    record = still_record(600.0, rate=50.0)
    turning = (record.imu.time > 400.0) & (record.imu.time < 500.0)
    record.imu.values[turning, 1] += np.sin(record.imu.time[turning])
    found = spans(record)
    assert sum(end - begin for begin, end in found) <= MAX_USED
    assert sum(begin > 380.0 and end < 520.0 for begin, end in found) >= 4


def test_too_little_flight_is_said():
    with pytest.raises(SitlError, match="nothing to identify from: no 6 s in a row off the ground"):
        usable_stretches(still_record(6.5), COLLAGE)


def test_commands_that_all_were_logged_hold_and_others_are_joined():
    often, seldom = still_record(8.0, rate=500.0), still_record(8.0, rate=100.0)
    for record in (often, seldom):
        record.commands.values[:, 0] = 600.0 + 10.0 * np.round(record.commands.time * 100.0)
    (held,), (joined,) = usable_stretches(often, COLLAGE), usable_stretches(seldom, COLLAGE)
    assert set(np.diff(held.commands[:, 0]).round(6)) == {0.0, 10.0}
    assert np.diff(joined.commands[:, 0]) == pytest.approx(1.0)


@pytest.mark.long
def test_a_flight_that_crashes_ends_there_and_is_used_until_then(tmp_path):
    base = load("collage").parameters
    weak = with_values(base, {"k_f": 0.1 * base.k_f})
    flight = fly_excitation(weak, base, excitation=Excitation((*HOVER_STEPS, *HOVER_STEPS), ()))
    assert flight.crashed
    assert flight.time[-1] < 15.0
    assert 0.0 < flight.body[-1, 2] < 1.0
    write_log(flight, tmp_path / "fallen.tlog", base)
    stretches = usable_stretches(read_flight(tmp_path / "fallen.tlog", LogConventions(None, base)), base)
    assert flight.time[-1] - 1.5 < sum(one.seconds for one in stretches) < flight.time[-1] - 0.5
