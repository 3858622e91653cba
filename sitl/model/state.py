"""The plant's state, by name."""

from typing import NamedTuple

from sitl.model.quaternions import Quaternion
from sitl.model.vectors import Vector


class Body(NamedTuple):
    """Six degrees of freedom; also their rates of change."""

    position: Vector  # p, world NWU [m]
    velocity: Vector  # v, world NWU [m/s]
    attitude: Quaternion  # q, body FLU to world NWU
    rates: Vector  # (p, q, r), body FLU [rad/s]


class Actuators(NamedTuple):
    """Positions or commands of the two motors and elevons."""

    left_motor: float  # w1 [rad/s]
    right_motor: float  # w2 [rad/s]
    left_elevon: float  # delta1 [rad]
    right_elevon: float  # delta2 [rad]


class Foot(NamedTuple):
    """A tail contact: whether it grips the ground, and where it stuck."""

    grips: bool
    north: float  # [m]
    west: float  # [m]


class Feet(NamedTuple):
    """The four tail contacts, left to right, upper (+z_b) first."""

    left_upper: Foot
    left_lower: Foot
    right_upper: Foot
    right_lower: Foot


class Plant(NamedTuple):
    """Everything the vehicle is."""

    body: Body
    actuators: Actuators
    feet: Feet
