"""Law of a vehicle that stands: for a moment it is carried upright while its drift dies away, then the motors idle.

What touches the ground drifts with the last gust, and bounces. Motors stopped at the touch leave it to fall over its
own feet, from 0.4 m/s on. Most of its weight carried, the feet press little and the elevons turn it as in the air, so
that it leans against the drift. A thrust that fades does worse: the elevons work at the height of the feet, and have no
lever once those press.
"""

from sitl.compiled import kernel
from sitl.control.allocation import allocate
from sitl.control.estimate import Estimate
from sitl.control.hover_zero_moment import Pointing, ZeroMomentGains, realise
from sitl.model.airframe import Airframe
from sitl.model.quaternions import rotate_inverse
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, scaled, shortened

CARRIED, LET_GO = 0.9, 0.7  # of the weight: thrust after the touch, and that at which the motors idle [-]
CARRYING_TIME = 0.7  # from the one to the other, on the ground [s]
BOUNCE_RATE = 0.25  # the thrust fades at this share of that rate while contact is not felt: it may bounce [-]
LEAN, MAX_DRIFT_LEAN = 0.3, 0.12  # against the drift [rad s/m], [rad]
LYING = 0.5  # a nose lower than this on the ground stands up by no law: its upward part [-]


@kernel
def step(
    estimate: Estimate, gains: ZeroMomentGains, a: Airframe, pointing: Pointing, dt: float
) -> tuple[Actuators, int, Pointing]:
    """One tick: actuator commands (running motors stop at idle by themselves), DARKO_SATURATION bits, and the state.

    Of the state only the force counts: what is carried.
    """
    weight = gains.m * gains.g
    drift = Vector(estimate.velocity.x, estimate.velocity.y, 0.0)
    rate = 1.0 if estimate.on_ground else BOUNCE_RATE
    force = pointing.force - rate * (CARRIED - LET_GO) * weight * dt / CARRYING_TIME
    after = Pointing(pointing.attitude, force, pointing.side, pointing.turn_side)
    lean = shortened(scaled(drift, -LEAN), MAX_DRIFT_LEAN)
    nose = rotate_inverse(estimate.attitude, Vector(lean.x, lean.y, 1.0))
    if nose.x < LYING or force < LET_GO * weight:
        return Actuators(0.0, 0.0, 0.0, 0.0), 0, after
    command, saturation = allocate(realise(torque_to(nose, estimate.rates, gains), force, gains), a)
    return command, saturation, after


@kernel
def lie() -> tuple[Actuators, int]:
    """One tick of a broken vehicle: nothing is commanded."""
    return Actuators(0.0, 0.0, 0.0, 0.0), 0


@kernel
def torque_to(nose: Vector, rates: Vector, gains: ZeroMomentGains) -> Vector:
    """Torque that turns the nose the shortest way and stops every turn, body frame [N m].

    Args:
        nose: Where it is to point, about a unit vector, body frame.
        rates: Body rates [rad/s].
        gains: Of the attitude loop.
    """
    stiffness, damping, J = gains.lam * gains.lam, 2.0 * gains.zeta * gains.lam, gains.J
    return Vector(
        -J.x * damping * rates.x,
        J.y * (-stiffness * nose.z - damping * rates.y),
        J.z * (stiffness * nose.y - damping * rates.z),
    )
