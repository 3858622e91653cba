"""The plant alone, flown for a while by a compiled loop."""

from sitl.compiled import entry
from sitl.model.ground import FEET, STIFFNESS, feet_aloft
from sitl.model.plant import step
from sitl.model.quaternions import hover
from sitl.model.state import Actuators, Body, Plant
from tests.support.flights.estimates import STILL, quaternion, vector

OFF = (0.0, 0.0, 0.0, 0.0)


def plant(p=(0.0, 0.0, 50.0), v=STILL, q=None, w=STILL, u=OFF):
    """High up, upright, at rest and off, but for what is given."""
    attitude = hover(0.0) if q is None else quaternion(q)
    return Plant(Body(vector(p), vector(v), attitude, vector(w)), actuators(u), feet_aloft())


def actuators(u):
    return Actuators(*(float(x) for x in u))


def fly(x, a, seconds, command=OFF, *, wind=STILL, armed=True, dt=1e-3):
    return _flown(x, actuators(command), vector(wind), armed, a, dt, round(seconds / dt))


def standing_height(a):
    """Of the centre of mass, where four springs carry the weight [m]."""
    return a.foot_x - a.m * a.g / (FEET * STIFFNESS)


@entry
def _flown(x, command, wind, armed, a, dt, steps):
    for _ in range(steps):
        x = step(x, command, wind, armed, a, dt)
    return x
