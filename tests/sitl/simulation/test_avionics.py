"""Avionics of one vehicle in flight, as they are switched on, set to converged and restarted."""

import numpy as np
import pytest

from sitl.design.gains import HALVING_LATENCY, line_of_sight_gains, wind_gains
from sitl.estimation.filter import ALIGNING, RUNNING, filter_settings
from sitl.estimation.nominal_state import (
    ACCEL_BIAS_ERROR,
    ATTITUDE_ERROR,
    GNSS_DRIFT_ERROR,
    GYRO_BIAS_ERROR,
    POSITION_ERROR,
    VELOCITY_ERROR,
)
from sitl.lab.studies.consistency import errors_of
from sitl.model.ground import LEVEL_GROUND, is_touching
from sitl.model.quaternions import rotate
from sitl.model.vectors import Vector, norm, scaled
from sitl.sensors.draws import SLOW_PERIODS
from sitl.sensors.instruments import DROPOUT, FAST_COLUMNS, GNSS, POSE_DROPOUT, SLOW_COLUMNS
from sitl.simulation.avionics import AIDS, Avionics, Navigation, equipped
from sitl.simulation.noise import BLOCK
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from tests.support.flights.ideal_sensors import SHIPPED
from tests.support.flights.plant_flight import plant
from tests.support.flights.sensed_flights import MOCAP, NOMINAL, SENSORS, UP, changed, hovering, on_ground

HOVERING = plant(p=(1.0, 2.0, 30.0), v=(0.5, -0.4, 0.1), u=(580.0, 590.0, 0.01, -0.02))


def made(navigation=SENSORS, seed=1):
    return Avionics(navigation, SHIPPED, NOMINAL, seed)


def test_a_vehicle_that_sees_the_truth_has_instruments_that_nobody_reads_or_writes():
    avionics = equipped(Navigation.TRUTH, SHIPPED, NOMINAL, 1)
    before = avionics.records.tobytes()
    avionics.draw(20_000)
    avionics.converge(HOVERING, 3, Vector(0.0, 0.0, 0.0), LEVEL_GROUND, NOMINAL)
    avionics.restart()
    avionics.redesign(NOMINAL, wind_gains()._replace(walk=9.0))
    assert avionics.fast.shape == (0, FAST_COLUMNS)
    flown = Simulation(NOMINAL, seed=7, start=Start(up=UP, airborne=True))
    flown.step(1.0)
    assert equipped(Navigation.TRUTH, SHIPPED, NOMINAL, 2).records.tobytes() == before


def test_draws_are_normal_but_those_of_dropouts_and_new_in_every_block():
    avionics = made()
    avionics.draw(0)
    first = avionics.fast.copy()
    assert first.shape == (BLOCK, FAST_COLUMNS)
    assert avionics.slow.shape == (BLOCK // SLOW_PERIODS, SLOW_COLUMNS)
    chance = [avionics.slow[:, DROPOUT : DROPOUT + AIDS], avionics.fast[:, [POSE_DROPOUT]]]
    for column in chance:
        assert column.min() >= 0.0
        assert column.max() < 1.0
        assert column.mean() == pytest.approx(0.5, abs=0.03)
    normal = np.delete(avionics.fast, POSE_DROPOUT, axis=1)
    assert normal.mean(axis=0) == pytest.approx(np.zeros(FAST_COLUMNS - 1), abs=0.07)
    assert normal.std(axis=0) == pytest.approx(np.ones(FAST_COLUMNS - 1), abs=0.05)
    assert (normal * 2.0**26 == np.rint(normal * 2.0**26)).all()  # the same on every machine
    avionics.draw(BLOCK - 1)
    assert (avionics.fast == first).all()
    avionics.draw(BLOCK)
    assert (avionics.fast != first).mean() > 0.99


def test_a_seed_draws_the_same_in_one_leap_and_another_seed_otherwise():
    one, other, leap = made(), made(seed=2), made()
    for period in (0, BLOCK, 2 * BLOCK):
        one.draw(period)
    leap.draw(2 * BLOCK)
    other.draw(2 * BLOCK)
    assert (one.slow == leap.slow).all()
    assert (one.fast != other.fast).any()
    assert one.instruments["errors"].tobytes() != other.instruments["errors"].tobytes()


@pytest.mark.parametrize("navigation", [SENSORS, MOCAP])
def test_a_filter_that_is_set_to_converged_is_wrong_by_as_much_as_it_says(navigation):
    vehicle = Simulation(NOMINAL, start=Start(up=UP, airborne=True), navigation=navigation)
    errors = []
    for _ in range(150):
        vehicle.place(HOVERING.body)
        errors.append(errors_of(vehicle, vehicle.truth, vehicle.wind)[:12])
    said = np.sqrt(np.diagonal(vehicle.avionics.filter["covariance"])[:12])
    for first in (POSITION_ERROR, VELOCITY_ERROR, ATTITUDE_ERROR, GYRO_BIAS_ERROR):
        three = slice(first, first + 3)
        assert np.std(errors, axis=0)[three] == pytest.approx(said[three], rel=0.25)
    deviation = vehicle.avionics.deviation(ACCEL_BIAS_ERROR)
    assert deviation == pytest.approx(3 * [SHIPPED.accelerometer.bias])


def test_it_takes_its_origin_where_it_converges():
    vehicle = hovering()
    vehicle.step(3.0)
    assert any(vehicle.avionics.instruments["errors"]["gnss_drift"].item())
    vehicle.place(HOVERING.body)
    assert vehicle.avionics.instruments["errors"]["gnss_drift"].item() == (0.0, 0.0, 0.0)
    assert vehicle.avionics.deviation(GNSS_DRIFT_ERROR) == (0.0, 0.0, 0.0)
    assert not vehicle.avionics.instruments["waiting"].any()


@pytest.mark.parametrize("make", [hovering, on_ground])
def test_it_knows_from_the_start_whether_it_stands(make):
    vehicle = make()
    vehicle.advance(5)
    assert vehicle.estimate.on_ground == is_touching(vehicle.truth, LEVEL_GROUND, NOMINAL)


def test_in_the_air_it_has_always_run_for_a_while():
    start = Start(up=UP, airborne=True)
    vehicle = Simulation(NOMINAL, start=start, navigation=SENSORS, aligned=False)
    assert vehicle.avionics.filter["phase"] == RUNNING
    assert on_ground(aligned=False).avionics.filter["phase"] == ALIGNING


def test_a_restart_that_forgets_begins_as_when_it_was_switched_on():
    vehicle = on_ground(heading=1.0)
    vehicle.step(1.0)
    vehicle.avionics.restart(carries_on=False)
    assert vehicle.avionics.filter["phase"] == ALIGNING
    vehicle.advance(1)
    assert vehicle.estimate.position == (0.0, 0.0, 0.0)
    vehicle.step(2.0)
    assert vehicle.avionics.filter["phase"] == RUNNING


def test_the_filter_stands_far_enough_in_the_past_for_all_that_aids_it():
    def horizon(arena=False, **parts):
        return filter_settings(changed(**parts), wind_gains(), arena=arena).horizon * 0.01

    assert 0.15 < horizon() < 0.18  # GNSS: 120 ms and three times 10 ms
    assert horizon(gnss={"delay": 0.3}) == pytest.approx(horizon() + 0.18)
    assert horizon(magnetometer={"delay": 0.3}) > 0.3
    assert horizon(arena=True) < 0.08
    assert horizon(arena=True, gnss={"delay": 0.3}) == horizon(arena=True)


def test_a_command_is_in_force_as_late_as_the_pipeline_makes_it():
    """The same jump of the reference moves the elevons so many periods later."""
    late = {"pipeline": {"latency": 0.02}}
    quick, slow = (hovering(MOCAP, gusts=0.0, wind=(0.0, 0.0, 0.0), sensors=changed(**more)) for more in ({}, late))
    first = []
    for vehicle in (quick, slow):
        before = vehicle.truth.actuators
        while vehicle.truth.actuators == before:
            vehicle.advance(1)
        first.append(vehicle.periods)
    assert first[1] - first[0] == 10


def test_the_later_the_actuators_act_the_more_slowly_the_attitude_is_followed():
    def followed(navigation, latency):
        late = {"pipeline": {"latency": latency}}
        return hovering(navigation, sensors=changed(**late)).design.gains.line_of_sight

    quick, slow = followed(SENSORS, 0.0), followed(SENSORS, HALVING_LATENCY)
    assert (quick.attitude, quick.rate) == (line_of_sight_gains().attitude, line_of_sight_gains().rate)
    for whole, half in ((quick.attitude, slow.attitude), (quick.rate, slow.rate)):
        assert np.allclose(half, 0.5 * np.array(whole))
    assert slow.observer == 0.5 * quick.observer
    assert slow.max_rate == quick.max_rate
    assert followed(Navigation.TRUTH, HALVING_LATENCY).rate == quick.rate  # the truth is there at once


def test_vehicles_of_different_latency_share_no_block():
    late = hovering(SENSORS, sensors=changed(pipeline={"latency": 0.02}))
    assert late.design_key != hovering(SENSORS).design_key


def test_what_is_read_under_a_roof_and_outdoors():
    outdoors, arena = hovering(SENSORS), hovering(MOCAP)
    for vehicle in (outdoors, arena):
        vehicle.step(2.0)
    heard = [np.array(vehicle.avionics.filter["scalars"]) > 0.0 for vehicle in (outdoors, arena)]
    assert heard[0].tolist() == [True, True, True, False, False, False, True]  # the tube reads nothing in a hover
    assert heard[1].tolist() == [False, False, False, False, True, False, True]
    assert outdoors.avionics.filter["scalars"][GNSS - 2] == pytest.approx(6 * 19, abs=12)


def test_a_pitot_on_a_vehicle_that_is_thrown_has_felt_its_airspeed_for_long():
    """Otherwise the lag of the tube is taken for a wind of 12 m/s, and the vehicle follows it for kilometres."""
    simulation = hovering(SENSORS)
    body = simulation.truth.body
    nose = rotate(body.attitude, Vector(1.0, 0.0, 0.0))
    simulation.place(body._replace(velocity=scaled(nose, 15.0)))
    simulation.step(0.4)
    assert norm(simulation.wind_estimate) < 3.0
