"""Identification comes back to airframes that are 20 % off in everything, and says how sure it is."""

import pytest

from sitl.lab.identification.flight_log import SensorRecord, Series
from sitl.lab.identification.identify_flight import identify_record
from sitl.lab.identification.result import EFFECTS, effect_values
from sitl.lab.identification.unknowns import of_mass, value_of
from sitl.model.airframe_files import load
from tests.support.lab.identified_flight import flown, identified, read

FLIGHTS = [("physical", 3), ("nominal", 7)]
NEAR = {"thrust coefficient / mass": 0.03, "lift slope / mass": 0.03}  # the others within 10 %


@pytest.mark.parametrize(("name", "seed"), FLIGHTS)
def test_effects_are_near_the_truth(name, seed):
    base = load(name).parameters
    truth = effect_values(flown(name, seed)[0], base)
    for row, true in zip(identified(name, seed).effects, truth, strict=True):
        assert row.told, row
        assert row.estimate == pytest.approx(true, rel=NEAR.get(row.name, 0.1)), row


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


@pytest.mark.parametrize(("name", "seed"), FLIGHTS)
def test_what_is_left_is_the_sensors_noise(name, seed):
    found = identified(name, seed)
    assert found.after[:3] == pytest.approx(0.3, rel=0.1)
    assert found.after[[3, 5]].max() < 0.01
    assert (found.after <= 1.001 * found.before).all()
    set_before, estimated = found.replay
    assert estimated.position < 0.05 < set_before.position
    assert estimated.attitude < 1.0 < set_before.attitude


@pytest.mark.parametrize(("name", "seed"), FLIGHTS)
def test_the_wind_is_found_beside(name, seed):
    found = identified(name, seed)
    assert found.nuisance.wind == pytest.approx([1.2, -1.6, 0.0], abs=0.1)
    assert abs(found.nuisance.delay) < 1e-3


def test_commands_that_come_seldom_are_remarked():
    record = read("physical", 3, hovering=True)
    seldom = Series(record.commands.time[::25], record.commands.values[::25])
    imu = Series(record.imu.time[::4], record.imu.values[::4])
    found = identify_record(
        SensorRecord(imu, seldom, record.attitude, record.motion, record.sources), load("physical").parameters
    )
    assert found.remarks[0].startswith("commands at 20 Hz: what lies between them is guessed")
    assert not any(remark.startswith("commands at") for remark in identified("physical", 3, hovering=True).remarks)


def test_what_a_hover_cannot_tell_is_said():
    found = identified("physical", 3, hovering=True)
    assert {row.name for row in found.effects if not row.told} >= {e.name for e in EFFECTS if e.forward}
    assert found.directions[0] < found.directions[1]
    assert found.untold[0].startswith("forward flight: at most ")
    untold = {row.key for row in found.parameters if not row.told}
    assert "C_nr" in untold
    assert any(line == "C_nr, yaw damping: it takes forward flight" for line in found.untold)
    thrust = found.effects[0]
    truth = effect_values(flown("physical", 3, hovering=True)[0], load("physical").parameters)[0]
    assert thrust.told
    assert thrust.estimate == pytest.approx(truth, rel=0.03)
