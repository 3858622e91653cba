"""Flights of the linear hover law alone, from drawn states and steps of the target."""

import math

import numpy as np
import pytest

from protocol.dialect.vocabulary import Law
from sitl.control import hover_linear
from sitl.control.reference import hover_at
from sitl.design import linearise
from sitl.design.lmi import DECAY, lmi_gains
from sitl.design.lqr import hover_gains, lqr
from sitl.lab.proofs.region import certify
from sitl.lab.studies.hover_region_flights import (
    SETTLED_RADIUS,
    START_ENVELOPE,
    STEP_SIZES,
    V_BANDS,
    decay_seen,
    deviation,
    draw,
    fly,
    is_upright,
    steps,
)
from sitl.model.airframe_files import load
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import REPORT_GAIN, Tuning

NOMINAL = load("nominal").parameters
LQR = hover_gains(NOMINAL, integral=False)
REPORT = LQR._replace(reach=math.inf)
GENTLE = LQR._replace(K=np.ascontiguousarray(lqr(*linearise.hover(NOMINAL), np.eye(12), 10.0 * np.eye(4))[0]))


@pytest.fixture(scope="module")
def proved():
    return certify(NOMINAL, LQR, precision=1.0).level


@pytest.mark.parametrize("envelope", [True, False])
def test_drawn_states_have_the_v_and_the_band_they_claim(envelope):
    states = draw(LQR.S, 60, 3, envelope=envelope)
    assert states == draw(LQR.S, 60, 3, envelope=envelope)
    assert [state.band for state in states] == [band for band in range(6) for _ in range(10)]
    for body, level, band in states:
        x = np.concatenate(deviation(body))
        assert x @ LQR.S @ x == pytest.approx(level)
        assert V_BANDS[band] <= level <= V_BANDS[band + 1]
        assert np.linalg.norm(body.attitude) == pytest.approx(1.0)


def test_draws_from_the_envelope_stay_within_it():
    position, speed, turn, rates = START_ENVELOPE
    for body, *_ in draw(LQR.S, 120, 4, envelope=True):
        assert np.linalg.norm(body.position) <= position
        assert np.linalg.norm(body.velocity) <= speed
        assert np.linalg.norm(body.rates) <= rates
        tilt = hover_linear.SQRT_HALF * abs(body.attitude.w - body.attitude.y)  # cos(turn / 2)
        assert 2.0 * math.acos(min(tilt, 1.0)) <= turn * (1.0 + 1e-9)
        assert is_upright(body.attitude)


@pytest.mark.long
def test_settling_times_are_those_of_the_whole_vehicle():
    """The study's own loop flies steps as the vehicle does under the linear law."""
    settling = steps(NOMINAL, LQR)
    for row, axis in ((0, 1), (4, 2)):
        target = np.array((0.0, 0.0, 500.0))
        tuning = Tuning(design=REPORT_GAIN, integral=0, v_enter=0.5e9, v_leave=1e9)
        vehicle = Simulation(NOMINAL, start=Start(up=500.0, airborne=True), tuning=tuning)
        target[axis] += STEP_SIZES[row]
        vehicle.reference = hover_at(target, 0.0)
        vehicle.begin_flight(Law.HOVER_LINEAR)
        flight = vehicle.record(8.0, 500.0)
        outside = np.linalg.norm(flight.position - target, axis=1) > SETTLED_RADIUS
        assert not flight.jumps
        assert settling[row, axis] == pytest.approx(flight.time[outside][-1], abs=1e-9)


@pytest.mark.long
def test_flights_from_the_proved_set_converge_and_fewer_do_from_far(proved):
    near = draw(LQR.S, 20, 1, envelope=False, bands=(0.0, proved))
    flights = fly(NOMINAL, LQR, near, 1e-4)
    assert flights.converged[flights.upright].all()
    assert not flights.upright.all()  # x is as small for some that are upside down
    states = draw(LQR.S, 60, 1, envelope=True)
    ours, report, gentle = (fly(NOMINAL, gains, states, 0.01) for gains in (LQR, REPORT, GENTLE))
    assert ours.converged[:10].all()
    assert report.converged.mean() < ours.converged.mean() < gentle.converged.mean()
    assert ours.start[~ours.converged].min() > proved


def test_a_flight_that_has_not_converged_has_no_time():
    flights = fly(NOMINAL, REPORT, draw(LQR.S, 60, 1, envelope=True), 0.01)
    assert (np.isfinite(flights.time) == flights.converged).all()
    assert flights.time[flights.converged].max() <= 20.0
    assert not flights.monotone[~flights.converged].any()


@pytest.mark.long
def test_the_flown_decay_is_faster_than_the_guaranteed_one():
    assert 0.37 < decay_seen(NOMINAL, LQR) < 1.2


@pytest.mark.long
def test_the_lmi_gain_settles_like_the_lqr_and_loses_fewer_flights():
    gains = lmi_gains(NOMINAL)
    assert decay_seen(NOMINAL, gains) > DECAY
    assert steps(NOMINAL, gains).max() < steps(NOMINAL, LQR).max() + 1.5
    states = draw(LQR.S, 120, 2, envelope=True)
    ours, theirs = (fly(NOMINAL, law, states, 0.01) for law in (gains, LQR))
    assert ours.converged.mean() > theirs.converged.mean() + 0.1
    assert ours.saturated.mean() < 0.5 * theirs.saturated.mean()
