"""The estimate of the vehicle's state: all that laws, guards and observers are given to see."""

from typing import NamedTuple

from sitl.compiled import kernel
from sitl.model.quaternions import Quaternion, x_axis
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, dot, subtract


class Ages(NamedTuple):
    """Age of each part of an estimate [s]."""

    position: float
    velocity: float
    acceleration: float
    attitude: float
    rates: float
    wind: float
    actuators: float
    contact: float


class Estimate(NamedTuple):
    """The state as it is believed to be."""

    position: Vector  # world NWU [m]
    velocity: Vector  # world NWU [m/s]
    acceleration: Vector  # world NWU, mean of the last control period [m/s2]
    attitude: Quaternion  # body FLU to world NWU
    rates: Vector  # body FLU [rad/s]
    wind: Vector  # velocity of the air, world NWU [m/s]
    actuators: Actuators  # where motors [rad/s] and elevons [rad] are believed to be
    on_ground: bool  # something touches the ground
    age: Ages


class Readings(NamedTuple):
    """Readings of velocity, normal force and airspeed in one control period."""

    velocity: Vector  # over the ground, world NWU [m/s]
    normal_force: float  # specific force along z_b [m/s2]
    airspeed: float  # along x_b, of the pitot tube [m/s]
    has_airspeed: bool  # whether there is a tube


@kernel
def air_ahead(estimate: Estimate) -> float:
    """Speed of the air along the propellers' axis, from ahead [m/s]."""
    return dot(x_axis(estimate.attitude), subtract(estimate.velocity, estimate.wind))
