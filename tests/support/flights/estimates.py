"""Estimates and rotations for tests of laws."""

import math

from sitl.control.estimate import Ages, Estimate
from sitl.control.reference import hover_at
from sitl.model.quaternions import Quaternion, hover, multiply
from sitl.model.state import Actuators
from sitl.model.vectors import Vector

FRESH = Ages(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
STILL = (0.0, 0.0, 0.0)


def vector(v):
    return Vector(*(float(x) for x in v))


def quaternion(q):
    return Quaternion(*(float(x) for x in q))


def estimate(p=STILL, v=STILL, q=None, w=STILL, wind=STILL, actuators=(0.0, 0.0, 0.0, 0.0)):
    """Upright at the origin and at rest, but for what is given."""
    attitude = hover(0.0) if q is None else quaternion(q)
    moving = vector(v), vector(STILL), attitude, vector(w), vector(wind)
    return Estimate(vector(p), *moving, Actuators(*(float(x) for x in actuators)), False, FRESH)


def reference(p=STILL, heading=0.0, speed=3.0):
    return hover_at(p, heading, speed)


def rotation(phi):
    """The exponential map, with the library's sine."""
    angle = math.sqrt(sum(x * x for x in phi))
    scale = 0.5 if angle == 0.0 else math.sin(0.5 * angle) / angle
    return quaternion((math.cos(0.5 * angle), *(scale * x for x in phi)))


def turned(q, phi):
    """An attitude after a rotation by phi [rad] in its own frame."""
    return multiply(q, rotation(phi))


def negated(q):
    """The same attitude with the other sign."""
    return Quaternion(-q.w, -q.x, -q.y, -q.z)
