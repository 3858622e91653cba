"""The plant in a trim, and how it moves from there."""

import math

import numpy as np

from sitl.model.plant import derivative
from sitl.model.quaternions import Quaternion
from sitl.model.state import Actuators, Body
from sitl.model.vectors import Vector

ALOFT = Vector(0.0, 0.0, 500.0)
NOTHING = Vector(0.0, 0.0, 0.0)


def velocity(trim):
    """Flying north."""
    return Vector(trim.speed * math.cos(trim.climb), 0.0, trim.speed * math.sin(trim.climb))


def straight(trim):
    """Body and actuators in a straight trim, heading north."""
    q = Quaternion(math.cos(trim.theta / 2), 0.0, -math.sin(trim.theta / 2), 0.0)
    return Body(ALOFT, velocity(trim), q, NOTHING), Actuators(trim.omega, trim.omega, trim.delta, trim.delta)


def turning(trim):
    """Body and actuators in a turn, at the moment at which it flies north."""
    body = Body(ALOFT, velocity(trim), Quaternion(*trim.q.tolist()), Vector(*trim.rates.tolist()))
    return body, Actuators(*trim.omega.tolist(), *trim.delta.tolist())


def accelerations(body, actuators, a):
    """Linear and angular acceleration in still air, (6,)."""
    rate = derivative(body, actuators, NOTHING, NOTHING, NOTHING, a)
    return np.array((*rate.velocity, *rate.rates))
