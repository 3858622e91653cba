"""The quaternion's side: kept with hysteresis, so that noise cannot make it chatter."""

import math

import numpy as np
import pytest

from sitl.control import handover, hover_linear, hover_zero_moment
from sitl.control.attitude_loop import HYSTERESIS, NOT_CHOSEN, kept
from sitl.control.reference import hover_at
from sitl.design.gains import zero_moment_gains
from sitl.model.actuators import limited
from sitl.model.airframe_files import load
from sitl.model.ground import feet_aloft
from sitl.model.plant import step_in_air
from sitl.model.quaternions import hover, multiply
from sitl.model.state import Actuators, Body, Plant
from sitl.simulation.dispatch import COMPILED
from sitl.simulation.tuning import Tuning, designed
from sitl.supervisor.resets import begin_anew
from tests.support.flights.estimates import estimate, rotation, vector

NOMINAL = load("nominal").parameters
LOOP = zero_moment_gains(NOMINAL)
NOISE = math.radians(1.0)  # of the attitude
STILL = vector((0.0, 0.0, 0.0))
PERIOD = 0.002


def test_entered_anew_the_nearer_side_is_taken():
    assert [kept(NOT_CHOSEN, eta) for eta in (0.5, 1e-9, -1e-9, -0.5)] == [1.0, 1.0, -1.0, -1.0]
    assert begin_anew.map(estimate())[-1] == NOT_CHOSEN
    assert "side" in begin_anew.sets
    assert COMPILED.is_known(0)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_side_is_given_up_once_the_way_is_much_longer(side):
    assert kept(side, -side * HYSTERESIS) == side
    assert kept(side, -side * (HYSTERESIS + 1e-9)) == -side
    assert kept(side, side * 0.01) == side


def sides_flown(first, step, *, memory, seconds=1.5):
    """Sides of a law that begins 180 deg off about its nose, in each period, with noise on the attitude it sees."""
    rng = np.random.default_rng(4)
    plant = Plant(
        Body(STILL, STILL, multiply(hover(0.0), rotation((math.pi, 0.0, 0.0))), STILL),
        Actuators(690.0, 690.0, 0.0, 0.0),
        feet_aloft(),
    )
    command, sides, state = plant.actuators, [], first()
    for _ in range(round(seconds / PERIOD)):
        body = plant.body
        seen = multiply(body.attitude, rotation(NOISE * rng.standard_normal(3)))
        told = estimate(body.position, body.velocity, seen, body.rates)._replace(actuators=plant.actuators)
        wanted, side, state = step(told, state, memory)
        sides.append(side)
        for _ in range(2):
            plant = step_in_air(plant, limited(command, True, NOMINAL), STILL, NOMINAL, 0.5 * PERIOD)
        command = wanted
    return np.array(sides)


def zero_moment_step(told, pointing, memory):
    q_d = hover(0.0)
    pointing = pointing._replace(attitude=q_d) if memory else pointing._replace(attitude=q_d, side=NOT_CHOSEN)
    state = hover_zero_moment.ZeroMomentState(pointing, handover.none())
    wanted, _, (pointing, _) = hover_zero_moment.step(
        told, hover_at((0.0, 0.0, 0.0), 0.0), LOOP, NOMINAL, state, PERIOD
    )
    return wanted, pointing.side, pointing


def linear_step(told, state, memory):
    state = state if memory else state._replace(side=NOT_CHOSEN)
    gains = designed(NOMINAL, Tuning()).gains.hover_linear
    at = hover_at((0.0, 0.0, 0.0), 0.0)
    wanted, _, state = hover_linear.step(told, at, gains, NOMINAL, state, PERIOD)
    return wanted, state.side, state


@pytest.mark.long
@pytest.mark.parametrize(
    ("first", "step"),
    [
        (lambda: hover_zero_moment.pointing_at(hover(0.0), 4.8, LOOP), zero_moment_step),
        (lambda: hover_linear.LinearState(STILL, NOT_CHOSEN), linear_step),
    ],
)
def test_from_half_a_turn_with_noise_only_memory_does_not_chatter(first, step):
    """About the nose, where gravity does not decide: the sides with the state, and with sgn(eta) of each tick."""
    with_memory, without = (np.diff(sides_flown(first, step, memory=memory)) != 0.0 for memory in (True, False))
    assert with_memory.sum() <= 1
    assert without.sum() >= 5
