r"""Parts of attitude loops: the disturbance observer of the moment, and the side of the quaternion.

**Observer.** It finds what turns the body besides what the model says. With the momentum :math:`J\omega` measured and
the model's moment M integrated beside it,

.. math::
    \hat d = L (J \omega - z), \quad \dot z = M - \omega \times J \omega + \hat d,

is the unmodelled moment through a first-order lag of bandwidth L: gusts the wing feels before the wind estimate
knows them, and coefficients that are not what the law believes. Its state is z, a vector [N m s].

**Side.** q and -q are one attitude. A law that always takes the nearer way, sgn(eta) eps, changes its mind with every
draw of noise where both ways are equally long, at 180 deg, and can be held there. So the side h is kept, and jumps to
-h only where h eta < -HYSTERESIS (Mayhew, Sanfelice and Teel, IEEE Transactions on Automatic Control 56, 2011). A jump
shortens the way: V = 4 (1 - h eta) of the attitude falls by at least 8 HYSTERESIS, so jumps cannot accumulate.
"""

from sitl.compiled import kernel
from sitl.control.estimate import Estimate
from sitl.model.aerodynamics import wrench
from sitl.model.airframe import Airframe
from sitl.model.quaternions import rotate_inverse
from sitl.model.vectors import Vector, add, add_scaled, cross, scaled, subtract

HYSTERESIS = 0.1  # of eta: a way is given up once it is 23 deg longer than the other
NOT_CHOSEN = 0.0  # on entry to a law: the nearer side is taken in its first tick


@kernel
def momentum(rates: Vector, a: Airframe) -> Vector:
    """J w, body frame [N m s]."""
    return Vector(a.J1 * rates.x, a.J2 * rates.y, a.J3 * rates.z)


@kernel
def observer_start(estimate: Estimate, a: Airframe) -> Vector:
    """Jump map: no disturbance is known."""
    return momentum(estimate.rates, a)


@kernel
def observer_update(estimate: Estimate, z: Vector, bandwidth: float, a: Airframe, dt: float) -> tuple[Vector, Vector]:
    """The disturbance now, body frame [N m], and the state a tick later; see :func:`observe_moment`."""
    v_b = rotate_inverse(estimate.attitude, subtract(estimate.velocity, estimate.wind))
    _, M = wrench(v_b, estimate.rates, estimate.actuators, a)
    return observe_moment(estimate, M, z, bandwidth, a, dt)


@kernel
def observe_moment(
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


@kernel
def kept(side: float, eta: float) -> float:
    """The side after its jumps, 1 or -1.

    Args:
        side: As it was: 1, -1 or NOT_CHOSEN.
        eta: Scalar part of the attitude error.
    """
    nearer = 1.0 if eta >= 0.0 else -1.0
    return nearer if side == NOT_CHOSEN or side * eta < -HYSTERESIS else side
