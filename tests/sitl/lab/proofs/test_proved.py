"""The certificate of the law that flies: what it states holds of the law as it is sampled, delayed and limited."""

import math

import numpy as np
import pytest

from sitl.compiled import entry
from sitl.control import hover_linear
from sitl.control.attitude_loop import NOT_CHOSEN
from sitl.control.estimate import Estimate
from sitl.control.hover_linear import LinearState
from sitl.control.reference import hover_at
from sitl.design.proved import PROVED_LEVEL, base_gains, is_proved, premises, proved_gains, with_lyapunov
from sitl.errors import SitlError
from sitl.lab.proofs import closed_loop
from sitl.lab.proofs.closed_loop import feedback, lyapunov_matrix
from sitl.lab.proofs.cover import falls_within
from sitl.lab.proofs.proof import Proof, greatest_deflection, thrust_swing
from sitl.lab.proofs.region import certify, chart_level, radii, rate_level, reach_level, saturation_level
from sitl.lab.proofs.rise import lyapunov_rate
from sitl.model.actuators import limited, limits
from sitl.model.airframe_files import load
from sitl.model.ground import feet_aloft
from sitl.model.plant import step_in_air
from sitl.model.quaternions import Quaternion
from sitl.model.state import Actuators, Body, Plant
from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD
from sitl.simulation.tuning import Tuning, designed
from tests.support.flights.estimates import estimate

NOMINAL = load("nominal").parameters
GAINS = proved_gains(NOMINAL)
PROOF = Proof.of(NOMINAL, GAINS)
P = lyapunov_matrix(GAINS)
COLLAGE = load("collage").parameters
CASES = {"nominal": (NOMINAL, GAINS), "collage": (COLLAGE, proved_gains(COLLAGE))}
STILL = Vector(0.0, 0.0, 0.0)


@pytest.fixture(params=CASES)
def case(request):
    """An airframe, and the law that flies it."""
    return CASES[request.param]


def states(count, seed, level=PROVED_LEVEL, P=P):
    """Uniform in direction, on level sets up to a level, (count, 15)."""
    rng = np.random.default_rng(seed)
    y = rng.standard_normal((count, 15))
    size = np.sqrt(level * rng.uniform(0.01, 1.0, (count, 1))) / np.linalg.norm(y, axis=1)[:, None]
    return size * y @ np.linalg.inv(np.linalg.cholesky(P))


def test_the_set_is_as_large_as_the_documentation_says():
    """In the worst direction of each, all else zero."""
    p, v, turn, w = radii(GAINS, PROVED_LEVEL)
    assert p > 0.9
    assert v > 0.5
    assert turn > math.radians(7.0)
    assert w > 0.5


def test_the_set_of_the_default_airframe_is_as_large_as_the_documentation_says():
    p, v, turn, w = radii(CASES["collage"][1], PROVED_LEVEL)
    assert p > 0.6
    assert v > 0.3
    assert turn > math.radians(5.0)
    assert w > 0.4


def test_the_level_respects_every_bound(case):
    a, gains = case
    for level in (saturation_level(a, gains), reach_level(gains), chart_level(gains)):
        assert level > PROVED_LEVEL
    assert rate_level(a, Proof.of(a, gains), 1.05) == 1.05


@pytest.mark.long
def test_the_whole_level_is_proved_and_one_too_high_is_refused(case):
    proof = Proof.of(*case)
    assert falls_within(proof, PROVED_LEVEL, boxes=8_000)
    assert not falls_within(proof, 4.0 * PROVED_LEVEL)


def test_a_v_that_rises_is_refused():
    with pytest.raises(SitlError, match="no pair"):
        certify(NOMINAL, with_lyapunov(base_gains(NOMINAL), np.eye(15)))


@pytest.mark.long
def test_v_falls_on_the_plant_at_twenty_thousand_states(case):
    a, gains = case
    assert max(lyapunov_rate(x, gains, a) for x in states(20_000, 3, P=lyapunov_matrix(gains))) < 0.0


@entry
def _flown(body, command, integral, gains, a, reference, periods, told):
    """V at each period of the loop as it flies, and whether an actuator met a limit."""
    plant = Plant(body, command, feet_aloft())
    state, met = LinearState(integral, NOT_CHOSEN), 0
    values = np.empty(periods)
    for k in range(periods):
        body = plant.body
        still = told.wind
        seen = Estimate(
            body.position, body.velocity, still, body.attitude, body.rates, still, plant.actuators, False, told.age
        )
        values[k] = hover_linear.lyapunov(seen, reference, gains)
        values[k] += hover_linear.integral_share(seen, reference, gains, state.integral)
        wanted, saturation, state = hover_linear.step(seen, reference, gains, a, state, 0.002)
        met |= limits(plant.actuators, command, True, 0.002, a) | saturation
        force = limited(command, True, a)
        plant = step_in_air(plant, force, Vector(0.0, 0.0, 0.0), a, 0.001)
        plant = step_in_air(plant, force, Vector(0.0, 0.0, 0.0), a, 0.001)
        command = wanted
    return values, met


def flown(x, periods, a=NOMINAL, gains=GAINS):
    """From a state, the actuators where the law wants them."""
    e = x[6:9] - (0.0, math.sqrt(0.5), 0.0)
    q = Quaternion(math.sqrt(1.0 - e @ e), *e.tolist())
    body = Body(Vector(*x[:3].tolist()), Vector(*x[3:6].tolist()), q, Vector(*x[9:12].tolist()))
    integral, at = Vector(*x[12:].tolist()), hover_at((0.0, 0.0, 0.0), 0.0)
    told = estimate(body.position, body.velocity, q, body.rates)
    command, _, _ = hover_linear.step(told, at, gains, a, LinearState(integral, NOT_CHOSEN), 0.002)
    return _flown(body, command, integral, gains, a, at, periods, told)


@pytest.mark.long
def test_no_flight_of_the_sampled_loop_leaves_the_set_or_meets_a_limit(case):
    """With the control period, the period of delay and the actuators' rates: V over 50 ms falls from every state."""
    a, gains = case
    for x in states(400, 5, P=lyapunov_matrix(gains)):
        values, met = flown(x, 26, a, gains)
        assert met == 0
        assert values.max() < PROVED_LEVEL * 1.001
        assert values[-1] < values[0]


@pytest.mark.long
def test_a_flight_from_the_edge_comes_home():
    for x in states(20, 6):
        values, met = flown(x * math.sqrt(PROVED_LEVEL / (x @ P @ x)), 5_000)
        assert met == 0
        assert values[-1] < 1e-3


def test_the_bounds_of_the_commands_hold():
    swing, deflection = thrust_swing(GAINS, PROVED_LEVEL), greatest_deflection(GAINS, PROVED_LEVEL)
    motor, elevon = PROOF.greatest_rates(PROVED_LEVEL)
    assert (motor, elevon) < (NOMINAL.omega_rate, NOMINAL.delta_rate)
    u = np.array(GAINS.u_bar)[:, None] - feedback(GAINS) @ states(5_000, 7).T
    T = GAINS.u_bar.T1
    assert np.abs(u[:2] / T - 1.0).max() <= swing
    assert np.abs(u[2:] / u[:2]).max() <= deflection


def test_the_proof_s_period_is_the_vehicle_s():
    assert closed_loop.SAMPLING == PERIOD
    assert pytest.approx(3.0 * PERIOD) == closed_loop.DELAY


def test_another_airframe_has_no_certificate_and_flies_another_design():
    heavier = NOMINAL._replace(m=1.01 * NOMINAL.m)
    assert is_proved(NOMINAL)
    assert not is_proved(heavier)
    with pytest.raises(SitlError, match="no V is stored"):
        proved_gains(heavier)
    assert not designed(heavier, Tuning()).gains.hover_linear.S_ii.any()
    assert premises(NOMINAL, GAINS).shape == premises(heavier, base_gains(heavier)).shape


def test_v_counts_the_integral():
    x = states(1, 8)[0]
    at = hover_at((0.0, 0.0, 0.0), 0.0)
    e = x[6:9] - (0.0, math.sqrt(0.5), 0.0)
    told = estimate(x[:3], x[3:6], (math.sqrt(1.0 - e @ e), *e), x[9:12])
    share = hover_linear.integral_share(told, at, GAINS, Vector(*x[12:].tolist()))
    assert hover_linear.lyapunov(told, at, GAINS) + share == pytest.approx(x @ P @ x)
    assert hover_linear.integral_share(told, at, GAINS, STILL) == 0.0
    assert Actuators(0.0, 0.0, 0.0, 0.0) == told.actuators


def test_a_wing_that_stalls_flies_by_the_stiffer_integral_also_where_nothing_is_proved_of_it():
    darko = load("darko").parameters
    assert not is_proved(darko)
    flown, stiff = designed(darko, Tuning()).gains.hover_linear, base_gains(darko)
    assert np.array_equal(flown.K, stiff.K)
    assert np.array_equal(flown.K_i, stiff.K_i)
