r"""Disturbance observer of the moment: what turns the body besides what the model says.

With the momentum :math:`J\omega` measured and the model's moment M integrated beside it,

.. math::
    \hat d = L (J \omega - z), \quad \dot z = M - \omega \times J \omega + \hat d,

is the unmodelled moment through a first-order lag of bandwidth L: gusts the wing feels before the wind estimate
knows them, and coefficients that are not what the law believes. Its state is z, a vector [N m s].
"""

from sitl.compiled import kernel
from sitl.control.estimate import Estimate
from sitl.model.aerodynamics import wrench
from sitl.model.airframe import Airframe
from sitl.model.quaternions import rotate_inverse
from sitl.model.vectors import Vector, add, add_scaled, cross, scaled, subtract


@kernel
def momentum(rates: Vector, a: Airframe) -> Vector:
    """J w, body frame [N m s]."""
    return Vector(a.J1 * rates.x, a.J2 * rates.y, a.J3 * rates.z)


@kernel
def start(estimate: Estimate, a: Airframe) -> Vector:
    """Jump map: no disturbance is known."""
    return momentum(estimate.rates, a)


@kernel
def update(estimate: Estimate, z: Vector, bandwidth: float, a: Airframe, dt: float) -> tuple[Vector, Vector]:
    """The disturbance now, body frame [N m], and the state a tick later; see :func:`observe`."""
    v_b = rotate_inverse(estimate.attitude, subtract(estimate.velocity, estimate.wind))
    _, M = wrench(v_b, estimate.rates, estimate.actuators, a)
    return observe(estimate, M, z, bandwidth, a, dt)


@kernel
def observe(
    estimate: Estimate, M: Vector, z: Vector, bandwidth: float, a: Airframe, dt: float
) -> tuple[Vector, Vector]:
    """The disturbance now, body frame [N m], and the state a tick later.

    Args:
        estimate: Of the rates.
        M: The model's moment now, body frame [N m].
        z: The state [N m s].
        bandwidth: L [rad/s].
        a: The airframe as the law knows it.
        dt: Tick [s].
    """
    H = momentum(estimate.rates, a)
    disturbance = scaled(subtract(H, z), bandwidth)
    rate = add(subtract(M, cross(estimate.rates, H)), disturbance)
    return disturbance, add_scaled(z, rate, dt)
