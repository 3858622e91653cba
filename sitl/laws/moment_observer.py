r"""Disturbance observer of the moment: what turns the body besides what the model says.

With the momentum :math:`J\omega` measured and the model's moment M integrated beside it,

.. math::
    \hat d = L (J \omega - z), \quad \dot z = M - \omega \times J \omega + \hat d,

is the unmodelled moment through a first-order lag of bandwidth L: gusts the wing feels before the wind estimate
knows them, and coefficients that are not what the law believes.
"""

import numpy as np
from numba import njit

from sitl.kernels.aerodynamics import wrench
from sitl.model.airframe import Airframe, Array
from sitl.kernels.quaternion import rotate_inverse
from sitl.kernels.state import ACTUATOR, Q, V, W

SIZE = 3  # z [N m s]


@njit(cache=True)
def reset(plant: Array, observer: Array, a: Airframe) -> None:
    """Jump map: no disturbance is known."""
    observer[0], observer[1], observer[2] = a.J1 * plant[W], a.J2 * plant[W + 1], a.J3 * plant[W + 2]


@njit(cache=True)
def update(plant: Array, wind: Array, observer: Array, bandwidth: float, a: Airframe, dt: float) -> Array:
    """The disturbance now, body frame, (3,) [N m]; the observer's state advanced in place."""
    w, J = plant[W : W + 3], np.array((a.J1, a.J2, a.J3))
    v_b = rotate_inverse(plant[Q : Q + 4], plant[V : V + 3] - wind)
    w1, w2, d1, d2 = plant[ACTUATOR], plant[ACTUATOR + 1], plant[ACTUATOR + 2], plant[ACTUATOR + 3]
    _, _, _, Mx, My, Mz = wrench(v_b[0], v_b[1], v_b[2], w[0], w[1], w[2], w1, w2, d1, d2, a)
    momentum = J * w
    disturbance = bandwidth * (momentum - observer)
    observer[0] += dt * (Mx - (w[1] * momentum[2] - w[2] * momentum[1]) + disturbance[0])
    observer[1] += dt * (My - (w[2] * momentum[0] - w[0] * momentum[2]) + disturbance[1])
    observer[2] += dt * (Mz - (w[0] * momentum[1] - w[1] * momentum[0]) + disturbance[2])
    return np.asarray(disturbance)
