"""Flights of the plant under the report's linear hover law alone, u = u_bar - K x, at any distance (section 3.1.3)."""

from __future__ import annotations

import math

import numpy as np

from sitl import PERIOD, Actuators, Airframe, Array, Body, Plant, Vector
from sitl.compiled import entry
from sitl.control.allocation import allocate
from sitl.control.hover_linear import SQRT_HALF, HoverError, LinearGains, control
from sitl.design.lqr import hover_thrust
from sitl.model.actuators import limited
from sitl.model.ground import feet_aloft
from sitl.model.plant import step_in_air
from sitl.model.quaternions import hover
from sitl.model.vectors import norm
from sitl.simulation.flight import SUBSTEPS


def linear_law(K: Array, S: Array, a: Airframe) -> LinearGains:
    """The law with a gain (4, 12) and the cost matrix of V (12, 12), without an integral and without a reach."""
    return LinearGains(np.ascontiguousarray(K), np.zeros((4, 3)), S, hover_thrust(a), 1.0, 1.0, math.inf)


@entry
def final_distances(starts: Array, gains: LinearGains, a: Airframe, duration: float) -> Array:
    """Final distances from the target of flights that begin upright and at rest, (n,) [m].

    Args:
        starts: Positions relative to the target, world NWU, (n, 3) [m].
        gains: The law.
        a: The airframe.
        duration: [s].
    """
    still, ended = Vector(0.0, 0.0, 0.0), np.empty(starts.shape[0])
    w = math.sqrt(gains.u_bar.T1 / a.k_f)
    for k in range(starts.shape[0]):
        p = Vector(starts[k, 0], starts[k, 1], starts[k, 2])
        plant = Plant(Body(p, still, hover(0.0), still), Actuators(w, w, 0.0, 0.0), feet_aloft())
        in_force = plant.actuators
        for _ in range(int(duration / PERIOD)):
            position, velocity, q, rates = plant.body
            sign = 1.0 if q.w - q.y >= 0.0 else -1.0
            tilt = Vector(sign * q.x, sign * q.y + SQRT_HALF, sign * q.z)
            u = control(HoverError(position, velocity, tilt, rates), still, 0.0, gains)
            for _ in range(SUBSTEPS):
                plant = step_in_air(plant, in_force, still, a, PERIOD / SUBSTEPS)
            command, _ = allocate(u, a)
            in_force = limited(command, True, a)
        ended[k] = norm(plant.body.position)
    return ended
