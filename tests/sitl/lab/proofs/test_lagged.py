"""The proof of the hover whose actuators lag: its bounds hold of the plant, its set of the loop as it is sampled."""

import math

import numpy as np
import pytest

from sitl.control import hover_linear
from sitl.control.attitude_loop import NOT_CHOSEN
from sitl.control.hover_linear import SQRT_HALF, LinearState
from sitl.control.reference import hover_at
from sitl.design.proved import base_gains
from sitl.errors import SitlError
from sitl.lab.proofs.bounded import Bounded, Table, paired
from sitl.lab.proofs.lagged import NONLINEAR_STATES, LaggedLoop, LargestMotion, bounds, free_air, linear_rest, whole
from sitl.lab.proofs.lagged_proof import AIR_ROWS, LaggedProof, lagged_premises, lagged_radii, stored_proof
from sitl.model.airframe_files import load
from sitl.model.ground import feet_aloft
from sitl.model.plant import derivative, inflow, step_in_air
from sitl.model.propeller import speed_for
from sitl.model.quaternions import Quaternion
from sitl.model.state import Actuators, Body, Plant
from sitl.model.vectors import Vector
from tests.support.flights.estimates import estimate

DARKO = load("darko").parameters
PROOF = stored_proof(DARKO)
LOOP = PROOF.loop
STILL = Vector(0.0, 0.0, 0.0)
BALANCE = PROOF.balance_integral()


def vector(x):
    return Vector(*x.tolist())


def body_of(z):
    e = z[6:9] - (0.0, SQRT_HALF, 0.0)
    return Body(vector(z[:3]), vector(z[3:6]), Quaternion(math.sqrt(1.0 - e @ e), *e.tolist()), vector(z[9:12]))


def actuators_of(z):
    motors, elevons = LOOP.speed + z[15:17] / LOOP.slope, z[17:] / LOOP.lift
    return Actuators(*motors.tolist(), *elevons.tolist())


def rate(z, a=DARKO):
    """Rate z' of the plant under commands that are in force at once, (19,)."""
    body, asked = body_of(z), LOOP.feedback @ z
    p, v, q, w = derivative(body, actuators_of(z), STILL, STILL, STILL, a)
    u, ahead = np.array([LOOP.lift, LOOP.lift, 0.0, 0.0]) - asked, inflow(body, STILL)
    motors = [LOOP.slope * (speed_for(float(T), ahead, a) - LOOP.speed) for T in u[:2]]
    sent = np.array([*motors, *(LOOP.lift * u[2:] / u[:2])])
    grown = z[:3] + LOOP.gains.lead * z[3:6]
    return np.concatenate((p, v, (q.x, q.y, q.z), w, grown, (sent - z[15:]) / LOOP.tau))


def states(count, seed, level=1.0):
    """Uniform in direction, on level sets up to a level, (count, 19)."""
    rng = np.random.default_rng(seed)
    y = rng.standard_normal((count, 19))
    y *= np.sqrt(level * rng.uniform(0.01, 1.0, (count, 1))) / np.linalg.norm(y, axis=1)[:, None]
    return y @ PROOF.to_z.T


def bare():
    """The airframe without the air outside its slipstreams."""
    return DARKO._replace(S=2.0 * DARKO.S_ratio * DARKO.S_p, C_mq=0.0, C_nr=0.0)


def test_the_set_is_as_large_as_the_documentation_says():
    p, v, turn, w = lagged_radii(PROOF)
    assert p > 0.05
    assert v > 0.03
    assert turn > math.radians(0.5)
    assert w > 0.04
    assert np.abs(BALANCE).max() < 0.02
    assert PROOF.limits_level() >= 1.0


@pytest.mark.long
def test_the_whole_level_is_proved_and_one_too_high_is_refused():
    assert PROOF.falls_within(1.0, boxes=600)
    assert not PROOF.falls_within(8.0, boxes=600)


def test_the_hover_is_balanced():
    assert np.abs(rate(np.zeros(19))).max() < 1e-9


def test_the_jacobian_of_every_state_lies_within_its_bounds():
    """Of the plant without free air, by differences; and how it changes over a box by the second derivatives."""
    a = bare()
    loop = LaggedLoop(a, LOOP.gains, LOOP.speed, LOOP.lift, LOOP.slope, LOOP.blown)
    for z in states(3, 1, level=20.0):
        half = 0.2 * np.abs(z) + 1e-4
        at, off = loop.selection @ z, np.abs(loop.selection) @ half
        on_box = bounds(loop, (at - off)[None], (at + off)[None])
        low, high = on_box.slope
        middle, loose = 0.5 * (low + high), 0.5 * (high - low)
        for corner in (-1.0, 0.0, 1.0):
            x = z + corner * half
            found = np.array([(rate(x + 1e-6 * d, a) - rate(x - 1e-6 * d, a)) / 2e-6 for d in np.eye(19)]).T
            by_variables = np.abs(loop.selection)
            room = np.zeros((19, 19))
            per = loose[0] @ by_variables
            room[3:12], room[15:] = per[:9], per[9:] / loop.tau[:, None]
            assert (np.abs(found - (whole(loop, middle)[0] + linear_rest(loop))) <= room + 1e-5).all()
        first, last = (bounds(loop, x[None], x[None]).slope for x in (at, at + off))
        least, most = (on_box.bend[side] @ off for side in (0, 1))
        assert (last[0] <= first[1] + most + 1e-9).all()
        assert (last[1] >= first[0] + least - 1e-9).all()


def test_what_the_free_air_adds_lies_within_its_bounds():
    for z in states(200, 2, level=4.0):
        speed, spin = float(np.linalg.norm(z[3:6])), float(np.linalg.norm(z[9:12]))
        motion = LargestMotion(speed, spin, 2.0 * math.sin(2.0 * math.asin(0.5 * float(np.linalg.norm(z[6:9])))))
        terms = free_air(DARKO, motion, float(np.abs(z[17:]).max()) / LOOP.lift)
        x, low, high = z[AIR_ROWS], np.zeros(6), np.zeros(6)
        for least, greatest, M in terms:
            ends = np.stack([least * M @ x, greatest * M @ x])
            low, high = low + ends.min(axis=0), high + ends.max(axis=0)
        added = (rate(z) - rate(z, bare()))[AIR_ROWS]
        assert (added >= low - 1e-9).all()
        assert (added <= high + 1e-9).all()


def test_v_falls_on_the_plant_at_two_thousand_states():
    for z in states(2_000, 3):
        assert z @ PROOF.P @ rate(z) < 0.0


def flown(z, periods):
    """V at each period of the loop as it flies, from a state with the actuators where it says."""
    integral, at = z[12:15] + BALANCE, hover_at((0.0, 0.0, 0.0), 0.0)
    state, plant = LinearState(vector(integral), NOT_CHOSEN), Plant(body_of(z), actuators_of(z), feet_aloft())
    command, values = None, []
    for _ in range(periods):
        body, act = plant.body, plant.actuators
        q = body.attitude
        motors = LOOP.slope * (np.array(act[:2]) - LOOP.speed)
        eps = np.array((q.x, q.y + SQRT_HALF, q.z))
        now = np.concatenate((body.position, body.velocity, eps, body.rates, np.array(state.integral) - BALANCE,
                              motors, LOOP.lift * np.array(act[2:])))  # fmt: skip
        values.append(float(now @ PROOF.P @ now))
        told = estimate(body.position, body.velocity, q, body.rates)
        wanted, _, state = hover_linear.step(told, at, LOOP.gains, DARKO, state, 0.002)
        command = wanted if command is None else command
        for _ in range(2):
            plant = step_in_air(plant, command, STILL, DARKO, 0.001)
        command = wanted
    return values


@pytest.mark.long
def test_no_flight_of_the_sampled_loop_leaves_the_set():
    """With the control period, the period of delay and the actuators' lags."""
    for z in states(40, 5):
        values = flown(z, 50)
        assert max(values) < max(1.0, values[0]) * 1.001
        assert values[-1] < values[0]


def test_another_airframe_has_no_proof():
    with pytest.raises(SitlError, match="no V is stored"):
        stored_proof(DARKO._replace(m=1.01 * DARKO.m))
    with pytest.raises(SitlError, match="first-order actuators"):
        LaggedLoop.of(load("collage").parameters, base_gains(load("collage").parameters))
    assert lagged_premises(LOOP).size > len(DARKO)


def test_a_v_that_rises_is_refused():
    with pytest.raises(SitlError, match="no pair"):
        LaggedProof.of(LOOP, np.eye(19))


def test_pairs_of_a_tabled_function_and_their_derivatives_lie_within_bounds():
    x = np.linspace(-1.0, 1.0, 4001)
    table, rng = Table(x, np.sin(3.0 * x)), np.random.default_rng(4)
    for sign in (1.0, -1.0):
        for _ in range(20):
            m, w, r = rng.uniform(-0.5, 0.5), rng.uniform(-0.3, 0.3), rng.uniform(0.0, 0.05)
            ends = np.array([m - r, w - r]), np.array([m + r, w + r])
            parts = [Bounded.variable(ends[0][k : k + 1], ends[1][k : k + 1], k, 2) for k in (0, 1)]
            made = paired(table, *parts, sign)
            for _ in range(20):
                p, q = rng.uniform(ends[0], ends[1])
                both, cross = (math.cos(3.0 * (p + q)), math.cos(3.0 * (p - q)))
                value = math.sin(3.0 * (p + q)) + sign * math.sin(3.0 * (p - q))
                slope = 3.0 * both + sign * 3.0 * cross, 3.0 * both - sign * 3.0 * cross
                assert made.value[0][0] - 1e-6 <= value <= made.value[1][0] + 1e-6
                for k in (0, 1):
                    assert made.slope[0][0, k] - 1e-5 <= slope[k] <= made.slope[1][0, k] + 1e-5
                own = -9.0 * math.sin(3.0 * (p + q)) - sign * 9.0 * math.sin(3.0 * (p - q))
                assert made.bend[0][0, 0, 0] - 1e-2 <= own <= made.bend[1][0, 0, 0] + 1e-2


def test_the_variables_are_of_the_state():
    assert LOOP.selection.shape == (17, 19)
    assert (LOOP.selection[:13] @ np.arange(19.0) == NONLINEAR_STATES).all()
