"""Joint effects of an airframe's constants: accelerations per thrust, deflection and rate, which flights tell best."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl import Airframe, Array
from sitl.lab.identification.replay import accelerations
from sitl.model.propeller import speed_for

CRUISE, INCIDENCE = 15.0, math.radians(6.0)  # where forward flight is looked at [m/s], [rad]
ELEVON_STEP, MOTOR_STEP, RATE_STEP = 0.02, 5.0, 0.1  # half the differences [rad], [rad/s], [rad/s]


class Effect(NamedTuple):
    """One of them."""

    name: str
    unit: str
    forward: bool = False  # of forward flight


EFFECTS = (
    Effect("thrust coefficient / mass", "m"),
    Effect("lift slope / mass", "1/(kg rad)"),
    Effect("pitch by elevons, hover", "1/s2"),
    Effect("roll by elevons, hover", "1/s2"),
    Effect("yaw by motors, hover", "1/s"),
    Effect("roll by motors, hover", "1/s"),
    Effect("pitch by elevons, 15 m/s", "1/s2", forward=True),
    Effect("roll by elevons, 15 m/s", "1/s2", forward=True),
    Effect("roll damping, 15 m/s", "1/s", forward=True),
    Effect("pitch damping, 15 m/s", "1/s", forward=True),
    Effect("yaw damping, 15 m/s", "1/s", forward=True),
)


def effect_values(a: Airframe, at: Airframe) -> Array:
    """Values of :data:`EFFECTS`.

    Args:
        a: The airframe.
        at: The set, whose hovering motor speed says where it is looked at.
    """
    speed = speed_for(0.5 * at.m * at.g, 0.0, at)
    still, cruise = np.zeros(3), np.array([CRUISE * math.cos(INCIDENCE), 0.0, -CRUISE * math.sin(INCIDENCE)])
    both, differ = np.array([0.0, 0.0, ELEVON_STEP, ELEVON_STEP]), np.array([0.0, 0.0, ELEVON_STEP, -ELEVON_STEP])
    motors, p, q, r = np.array([MOTOR_STEP, -MOTOR_STEP, 0.0, 0.0]), *(RATE_STEP * np.eye(3))
    none, rest = np.zeros(4), np.zeros(3)
    moves = (
        (still, both, rest, 1, 2.0 * ELEVON_STEP), (still, differ, rest, 0, -4.0 * ELEVON_STEP),
        (still, motors, rest, 2, -4.0 * MOTOR_STEP), (still, motors, rest, 0, 4.0 * MOTOR_STEP),
        (cruise, both, rest, 1, 2.0 * ELEVON_STEP), (cruise, differ, rest, 0, -4.0 * ELEVON_STEP),
        (cruise, none, p, 0, -2.0 * RATE_STEP), (cruise, none, q, 1, -2.0 * RATE_STEP),
        (cruise, none, r, 2, -2.0 * RATE_STEP),
    )  # fmt: skip
    v = np.array([move[0] for move in moves for _ in range(2)])
    trim = np.array([speed, speed, 0.0, 0.0])
    actuators = np.array([trim + sign * move[1] for move in moves for sign in (1.0, -1.0)])
    rates = np.array([sign * move[2] for move in moves for sign in (1.0, -1.0)])
    _, turning = accelerations(v, rates, actuators, a)
    slopes = [(turning[2 * i, axis] - turning[2 * i + 1, axis]) / width for i, (*_, axis, width) in enumerate(moves)]
    return np.array([a.k_f / a.m, a.C_l / a.m, *slopes])
