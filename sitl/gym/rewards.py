r"""Observations, rewards and endings, compiled; all rewards are rates, at most 1 a second.

With the distance d from the place, :math:`n = 1 / (1 + (d / s)^2)` of the goal's scale s,
:math:`u = (1 + x_{b,z}) / 2` of the nose's height and :math:`c = 1 / (1 + |\omega|^2 / 4)`:

- hold a place: :math:`n (1 + u c) / 2`
- cruise north: :math:`1 / ((1 + (\dot x - V)^2 / 9) (1 + (y^2 + (z - z_0)^2) / s^2))`
- go to a place: :math:`n (1 + u c) / 2 + (1 - n) \dot d_- / (2 V)`, with the closing speed :math:`\dot d_-` within
  plus and minus V
"""

from __future__ import annotations

from typing import NamedTuple

from sitl.compiled import kernel
from sitl.control.estimate import Estimate
from sitl.model.airframe import Airframe, Array
from sitl.model.arithmetic import clipped
from sitl.model.quaternions import rotate_inverse, x_axis
from sitl.model.state import Plant
from sitl.model.vectors import Vector, dot, norm, subtract

HOLD_PLACE, CRUISE_NORTH, GO_TO_PLACE = range(3)  # kinds of goals
OBSERVED = 22  # numbers of an observation
MOST_OBSERVED = 4.0  # bound of each of them
NEAR_PLACE = 5.0  # a deviation of this is observed as 1/2 [m]
SPEED_UNIT, RATE_UNIT, WIND_UNIT = 20.0, 10.0, 10.0  # observed as 1 [m/s], [rad/s], [m/s]
SPEED_SCALE = 3.0  # of the cruise's reward [m/s]
CALM_RATE = 2.0  # [rad/s]
FLOWN_PAST = 30.0  # a leg is lost so far behind its place [m]
LOST_HEIGHT = 0.8  # of the centre of mass above the ground: the episode is lost [m]


class Goal(NamedTuple):
    """The goal that rewards and endings are measured by."""

    kind: int  # HOLD_PLACE, CRUISE_NORTH or GO_TO_PLACE
    place: Vector  # wanted; of a cruise: a point of its line north, world NWU [m]
    speed: float  # wanted in forward flight [m/s]
    scale: float  # distance at which half of the reward is gone [m]
    bound: float  # the episode is lost this far away; of legs and cruises: aside [m]
    above: float  # and this far above or below [m]


@kernel
def put_vector(row: Array, first: int, v: Vector, unit: float) -> None:
    """Put a vector into an observation, in units, each component within the bounds."""
    row[first] = clipped(v.x / unit, -MOST_OBSERVED, MOST_OBSERVED)
    row[first + 1] = clipped(v.y / unit, -MOST_OBSERVED, MOST_OBSERVED)
    row[first + 2] = clipped(v.z / unit, -MOST_OBSERVED, MOST_OBSERVED)


@kernel
def observe_state(row: Array, estimate: Estimate, goal: Goal, a: Airframe) -> None:
    """Write an observation; directions are seen from the body.

    Args:
        row: Of OBSERVED numbers, body frame FLU: deviation from the place or line (3), velocity (3), the directions of
            up and of north (6), rates (3), motors and elevons (4), wind (3).
        estimate: The state as the agent may know it.
        goal: The task's.
        a: The nominal airframe.
    """
    off, q, act = deviation(estimate.position, goal), estimate.attitude, estimate.actuators
    put_vector(row, 0, rotate_inverse(q, off), NEAR_PLACE + norm(off))
    put_vector(row, 3, rotate_inverse(q, estimate.velocity), SPEED_UNIT)
    put_vector(row, 6, rotate_inverse(q, Vector(0.0, 0.0, 1.0)), 1.0)
    put_vector(row, 9, rotate_inverse(q, Vector(1.0, 0.0, 0.0)), 1.0)
    put_vector(row, 12, estimate.rates, RATE_UNIT)
    row[15], row[16] = 2.0 * act.left_motor / a.omega_max - 1.0, 2.0 * act.right_motor / a.omega_max - 1.0
    row[17], row[18] = act.left_elevon / a.delta_max, act.right_elevon / a.delta_max
    put_vector(row, 19, rotate_inverse(q, estimate.wind), WIND_UNIT)


@kernel
def deviation(position: Vector, goal: Goal) -> Vector:
    """From the place, or of a cruise from its line, world NWU [m]."""
    off = subtract(position, goal.place)
    return Vector(0.0 if goal.kind == CRUISE_NORTH else off.x, off.y, off.z)


@kernel
def reward_rate(plant: Plant, goal: Goal) -> float:
    """Reward a second of a state; see the head of this module."""
    body, off = plant.body, deviation(plant.body.position, goal)
    near = 1.0 / (1.0 + dot(off, off) / (goal.scale * goal.scale))
    if goal.kind == CRUISE_NORTH:
        slow = (body.velocity.x - goal.speed) / SPEED_SCALE
        return near / (1.0 + slow * slow)
    upright = 0.5 + 0.5 * x_axis(body.attitude).z
    calm = 1.0 / (1.0 + dot(body.rates, body.rates) / (CALM_RATE * CALM_RATE))
    held = near * (0.5 + 0.5 * upright * calm)
    if goal.kind == HOLD_PLACE:
        return held
    distance = max(norm(off), 1e-9)
    closing = clipped(-dot(off, body.velocity) / distance, -goal.speed, goal.speed)
    return held + (1.0 - near) * 0.5 * closing / goal.speed


@kernel
def is_lost(plant: Plant, goal: Goal) -> bool:
    """Whether the episode is lost: out of bounds, or at the ground, where it also breaks."""
    off = deviation(plant.body.position, goal)
    if plant.body.position.z < LOST_HEIGHT or abs(off.z) > goal.above:
        return True
    if goal.kind == HOLD_PLACE:
        return dot(off, off) > goal.bound * goal.bound
    return abs(off.y) > goal.bound or off.x > FLOWN_PAST or off.x < -goal.place.x - FLOWN_PAST
