"""One step of the plant: actuators exactly, rigid body by Runge-Kutta 4, quaternion kept unit."""

import math

import numpy as np
from numba import njit

from sitl.kernels import actuators
from sitl.kernels.ground import move_anchors
from sitl.kernels.parameters import Airframe, Array
from sitl.kernels.rigid_body import derivative
from sitl.kernels.state import ACTUATOR, ANCHOR, Q

RIGID = ACTUATOR  # the rigid state is all that comes before the actuators


@njit(cache=True)
def plant_step(plant: Array, command: Array, wind: Array, armed: bool, a: Airframe, dt: float) -> int:
    """Advance the plant by ``dt`` in place.

    The actuators do not feel the body, so their motion over the step is known first; the Runge-Kutta stages see
    them where they are at the beginning, in the middle and at the end.

    Args:
        plant: Plant state, laid out by :mod:`sitl.kernels.state`, (SIZE,).
        command: w1, w2 [rad/s], delta1, delta2 [rad], (4,).
        wind: Velocity of the air over the step, world NWU, (3,) [m/s].
        armed: Whether the motors may turn.
        a: The airframe.
        dt: Step [s]; 1 ms is the product's, stable against the ground's springs.

    Returns:
        Bits of DARKO_LIMIT that were active.
    """
    rigid, x = np.empty((2, RIGID)), np.empty(ANCHOR)
    k, total = rigid[0], rigid[1]
    x[:] = plant[:ANCHOR]
    flags = actuators.advance(plant, command, armed, dt, a)
    derivative(x, plant, wind, a, k)
    for i in range(RIGID):
        total[i] = k[i]
    for i in range(ACTUATOR, ANCHOR):
        x[i] = 0.5 * (x[i] + plant[i])  # seen from the middle of the step
    for stage in range(1, 4):
        h, weight = (dt, 1.0) if stage == 3 else (0.5 * dt, 2.0)
        for i in range(RIGID):
            x[i] = plant[i] + h * k[i]
        if stage == 3:
            x[ACTUATOR:] = plant[ACTUATOR:ANCHOR]
        derivative(x, plant, wind, a, k)
        for i in range(RIGID):
            total[i] += weight * k[i]
    for i in range(RIGID):
        plant[i] += dt / 6.0 * total[i]
    n = math.sqrt(plant[Q] ** 2 + plant[Q + 1] ** 2 + plant[Q + 2] ** 2 + plant[Q + 3] ** 2)
    for i in range(Q, Q + 4):
        plant[i] /= n
    move_anchors(plant, a)
    return flags
