"""Motors and elevons between command and effect (report, "Saturation des commandes").

Both models have closed forms, so positions are exact at any time within a step; commands do not change in one.
"""

from sitl.compiled import kernel
from sitl.model.airframe import FIRST_ORDER, Airframe
from sitl.model.arithmetic import clipped, exponential
from sitl.model.state import Actuators

AT_REST = 1e-9


@kernel
def limited(command: Actuators, armed: bool, a: Airframe) -> Actuators:
    """Commands within what the actuators can reach: running motors never stop, stopped ones do not turn."""
    low, high = (a.omega_min, a.omega_max) if armed else (0.0, 0.0)
    return Actuators(
        clipped(command.left_motor, low, high),
        clipped(command.right_motor, low, high),
        clipped(command.left_elevon, -a.delta_max, a.delta_max),
        clipped(command.right_elevon, -a.delta_max, a.delta_max),
    )


@kernel
def moved(now: Actuators, wanted: Actuators, dt: float, a: Airframe) -> Actuators:
    """Actuators ``dt`` seconds later, on their way to where they are wanted: rate limit or first-order lag."""
    if a.actuator_model == FIRST_ORDER:
        motor, elevon = 1.0 - exponential(-dt / a.motor_tau), 1.0 - exponential(-dt / a.elevon_tau)
        return Actuators(
            now.left_motor + motor * (wanted.left_motor - now.left_motor),
            now.right_motor + motor * (wanted.right_motor - now.right_motor),
            now.left_elevon + elevon * (wanted.left_elevon - now.left_elevon),
            now.right_elevon + elevon * (wanted.right_elevon - now.right_elevon),
        )
    motor, elevon = a.omega_rate * dt, a.delta_rate * dt
    return Actuators(
        now.left_motor + clipped(wanted.left_motor - now.left_motor, -motor, motor),
        now.right_motor + clipped(wanted.right_motor - now.right_motor, -motor, motor),
        now.left_elevon + clipped(wanted.left_elevon - now.left_elevon, -elevon, elevon),
        now.right_elevon + clipped(wanted.right_elevon - now.right_elevon, -elevon, elevon),
    )


@kernel
def nodes(now: Actuators, wanted: Actuators, dt: float, a: Airframe) -> tuple[Actuators, Actuators, Actuators]:
    r"""Actuator positions at the beginning, middle and end of a Runge-Kutta step, as the step takes them.

    A rate-limited actuator comes to rest somewhere within the step, and three looks at it would miss where: as much
    as a sixth of a step of delay, in every step. So the step is given the straight line that has the same mean
    and first moment over it. A way d from u, at rest after the share s of the step, becomes

    .. math:: u + d (1 - s)^2, \quad u + d (1 - \tfrac12 s), \quad u + d (1 + s - s^2)

    whose ends are not where the actuator is; that is what :func:`moved` says.
    """
    if a.actuator_model == FIRST_ORDER:
        return now, moved(now, wanted, 0.5 * dt, a), moved(now, wanted, dt, a)
    motor, elevon = a.omega_rate * dt, a.delta_rate * dt
    per_motor, per_elevon = 1.0 / motor, 1.0 / elevon
    w1 = _line(now.left_motor, wanted.left_motor, motor, per_motor)
    w2 = _line(now.right_motor, wanted.right_motor, motor, per_motor)
    d1 = _line(now.left_elevon, wanted.left_elevon, elevon, per_elevon)
    d2 = _line(now.right_elevon, wanted.right_elevon, elevon, per_elevon)
    return (
        Actuators(w1[0], w2[0], d1[0], d2[0]),
        Actuators(w1[1], w2[1], d1[1], d2[1]),
        Actuators(w1[2], w2[2], d1[2], d2[2]),
    )


@kernel
def _line(now: float, wanted: float, reach: float, per_reach: float) -> tuple[float, float, float]:
    """The line of one actuator, which can go as far as ``reach`` in the step."""
    way = clipped(wanted - now, -reach, reach)
    share = abs(way) * per_reach
    after, more = now + way, way * share
    return after - more * (2.0 - share), after - 0.5 * more, after + more * (1.0 - share)


@kernel
def limits(now: Actuators, command: Actuators, armed: bool, dt: float, a: Airframe) -> int:
    """Bits of DARKO_LIMIT that are active over a step.

    1, 2, 4, 8 are a position limit of motor left, right, elevon left, right; times 16 their rate limits.
    """
    wanted = limited(command, armed, a)
    flags = 0
    if armed:  # a stopped motor is at no limit
        low, high = a.omega_min + AT_REST, a.omega_max - AT_REST  # a scaled command may end a rounding short of it
        flags |= 1 if command.left_motor <= low or command.left_motor >= high else 0
        flags |= 2 if command.right_motor <= low or command.right_motor >= high else 0
    flags |= 4 if abs(command.left_elevon) >= a.delta_max - AT_REST else 0
    flags |= 8 if abs(command.right_elevon) >= a.delta_max - AT_REST else 0
    if a.actuator_model != FIRST_ORDER:
        motor, elevon = a.omega_rate * dt + AT_REST, a.delta_rate * dt + AT_REST
        flags |= 16 if abs(wanted.left_motor - now.left_motor) > motor else 0
        flags |= 32 if abs(wanted.right_motor - now.right_motor) > motor else 0
        flags |= 64 if abs(wanted.left_elevon - now.left_elevon) > elevon else 0
        flags |= 128 if abs(wanted.right_elevon - now.right_elevon) > elevon else 0
    return flags
