"""Effects of the report's slips if they stay: the numbers of the errata, computed."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl import Airframe, Array, Quaternion
from sitl.design.trim import level_trim
from sitl.lab.reproduction.equations.as_typed import (
    ZERO_VECTOR,
    Slip,
    forward_matrices,
    kernel_wrench,
    typed_moment_matrix,
    typed_trim,
)
from sitl.lab.reproduction.equations.printed_matrices import PRINTED_B, PRINTED_START
from sitl.lab.reproduction.equations.report_forward_flight import conditioning
from sitl.lab.reproduction.experiments.governor_sigmoids import printed_gompertz
from sitl.model.hover_model import force_matrix, moment_matrix
from sitl.model.quaternions import from_euler, x_axis

ROTOR_INERTIA = 5.1116e-6  # J_p of appendix A [kg m2]
BODY_RATE, ROTOR_DIFFERENCE = 3.0, 800.0  # at which its gyroscopic moment is given [rad/s]
DRAWN_STATES = 5000  # random states of a still wing
DRAWN_AIRSPEED, DRAWN_RATE = 25.0, 5.0  # of them [m/s, rad/s]
PROPELLER_SPEEDS = (15.0, 18.0, 20.0, 25.0)  # at which the propeller's energy is given [m/s]
PROPELLER_DISC = math.pi * 0.125**2  # [m2]
NO_COMMAND = np.zeros(2)


class PowerOfRates(NamedTuple):
    """Power that a still wing, propellers stopped and elevons at zero, takes from the air in random states."""

    share: float  # of the states in which the air gives power [%]
    greatest: float  # power given [W]


def rate_force_matrix(a: Airframe) -> Array:
    """Phi of the force -h Phi B w from the body rates, as the kernel has it, (3, 3)."""
    ahead = np.array([10.0, 0.0, 0.0])
    at_rest = kernel_wrench(ahead, ZERO_VECTOR, NO_COMMAND, NO_COMMAND, a)[0]
    columns = [kernel_wrench(ahead, w, NO_COMMAND, NO_COMMAND, a)[0] - at_rest for w in np.eye(3)]
    h = 0.5 * a.rho * a.S * 10.0
    return np.asarray(-np.array(columns).T / h / np.array([a.b, a.c, a.b]))


def power_of_rates(a: Airframe, seed: int) -> tuple[PowerOfRates, PowerOfRates]:
    """With the kernel's Phi(mv) in the force, and with its transpose; ``a`` with mu = 0, so that eta = |v|."""
    a = a._replace(mu=0.0)
    draw = np.random.default_rng(seed)
    direction = draw.normal(size=(DRAWN_STATES, 3))
    v = direction / np.linalg.norm(direction, axis=1)[:, None] * draw.uniform(0.0, DRAWN_AIRSPEED, (DRAWN_STATES, 1))
    w = draw.uniform(-DRAWN_RATE, DRAWN_RATE, (DRAWN_STATES, 3))
    Phi, B = rate_force_matrix(a), np.diag([a.b, a.c, a.b])
    powers = np.empty((2, DRAWN_STATES))
    for k in range(DRAWN_STATES):
        F, M = kernel_wrench(v[k], w[k], NO_COMMAND, NO_COMMAND, a)
        h = 0.5 * a.rho * a.S * float(np.linalg.norm(v[k]))
        powers[0, k] = F @ v[k] + M @ w[k]
        powers[1, k] = powers[0, k] + h * ((Phi - Phi.T) @ B @ w[k]) @ v[k]
    rows = [PowerOfRates(100.0 * float((power > 0.0).mean()), max(float(power.max()), 0.0)) for power in powers]
    return rows[0], rows[1]


def propeller_energy(a: Airframe) -> str:
    """Thrust power over shaft power N w in level flight, and the figure of merit at the hover, of each propeller."""
    ratios = []
    for speed in PROPELLER_SPEEDS:
        trim = level_trim(a, speed)
        ratios.append(f"{trim.thrust * speed * math.cos(trim.theta) / (a.k_m * trim.omega**3):.2f} at {speed:.0f}")
    trim = level_trim(a, 0.0)
    ideal = trim.thrust**1.5 / math.sqrt(2.0 * a.rho * PROPELLER_DISC)
    merit = ideal / (a.k_m * trim.omega**3)
    return (
        f"thrust power over shaft power at the level trims is {', '.join(ratios)} m/s: above 1 it makes energy; the "
        f"figure of merit at the hover is {merit:.2f}"
    )


def torque_sign(a: Airframe) -> str:
    """The roll acceleration by which both signs of the propellers' torque differ."""
    motors = np.array([a.omega_max, a.omega_min])
    by_torque = a.k_m * float(motors[0] ** 2 - motors[1] ** 2)
    _, B = forward_matrices(a)
    sign = "that of 2.2.1" if B[7, 0] * PRINTED_B[7, 0] > 0.0 else "that of 2.1.2"
    return (
        f"{2.0 * by_torque / a.J1:.0f} rad/s2 of roll at full difference of the motors; the printed "
        f"B(w_x, T1) = {PRINTED_B[7, 0]} has {sign}, which flies. Only the propellers themselves can decide"
    )


def rotor_gyroscopics(a: Airframe) -> str:
    """The moment that is missing without J_p."""
    moment = ROTOR_INERTIA * BODY_RATE * ROTOR_DIFFERENCE
    trim = level_trim(a, 0.0)
    turned = np.full(2, a.delta_max)
    elevons = kernel_wrench(ZERO_VECTOR, ZERO_VECTOR, np.full(2, trim.thrust), turned, a)[1][1]
    return (
        f"{moment:.3f} N m at {BODY_RATE:.0f} rad/s and a difference of {ROTOR_DIFFERENCE:.0f} rad/s, "
        f"{100.0 * moment / abs(float(elevons)):.0f} % of the greatest pitch moment of the elevons at the hover"
    )


def transpose(a: Airframe, seed: int) -> str:
    """Effect on a still wing's energy of the force from the body rates."""
    printed, transposed = power_of_rates(a, seed)
    return (
        f"a still wing takes power from the air in {printed.share:.1f} % of {DRAWN_STATES} random states, up to "
        f"{printed.greatest:.1f} W; with the transpose in {transposed.share:.1f} %, up to {transposed.greatest:.1g} W, "
        f"by C_lr and C_np, which outweigh C_nr (within {DRAWN_AIRSPEED:.0f} m/s, {DRAWN_RATE:.0f} rad/s; seed {seed})"
    )


def yaw_arm(a: Airframe) -> str:
    """By how much the printed sign changes the yaw authority."""
    return f"{100.0 * 2.0 * a.S_ratio * a.a_y * a.C_d0 / float(moment_matrix(a)[2, 1]):.1f} % of the yaw authority"


def kappa(a: Airframe) -> str:
    """The thrust asked with the printed kappa."""
    F = float(np.linalg.norm(force_matrix(a) @ [1.0, 1.0, 0.0, 0.0]))
    return f"{F * F:.1f} times the thrust asked"


def roll_term(a: Airframe) -> str:
    """The roll effectiveness with and without the slip."""
    plain = abs(float(typed_moment_matrix(a, frozenset())[0, 2]))
    slipped = abs(float(typed_moment_matrix(a, frozenset({Slip.ROLL}))[0, 2]))
    return f"{slipped:.3f} instead of {plain:.3f} N m per N: {slipped / plain:.1f} times the elevons' strength"


def one_number(a: Airframe) -> str:
    """The trim at 5 m/s with and without the unit slip."""
    others = frozenset({Slip.AREA})
    plain, slipped = typed_trim(a, others), typed_trim(a, others | {Slip.ONE_NUMBER})
    return f"at 5 m/s D = {slipped[2]:.2f} instead of a deflection of {plain[2]:.2f} rad; it enters A and B as well"


def area(a: Airframe) -> str:
    """The trim at 5 m/s with both areas."""
    angles = [math.degrees(typed_trim(a, slips)[0]) for slips in (frozenset[Slip](), frozenset({Slip.AREA}))]
    return f"the nose at 5 m/s is {angles[0]:.2f} instead of {angles[1]:.2f} deg; the trim, A and B need it"


def damping(a: Airframe) -> str:
    """The pitch damping at 5 m/s with and without the slip."""
    others = frozenset({Slip.AREA})
    plain, slipped = (float(forward_matrices(a, slips)[0][8, 8]) for slips in (others, others | {Slip.DAMPING}))
    return f"A(w_y, w_y) is {slipped:.2f} instead of {plain:.2f}: {slipped / plain:.1f} times the pitch damping"


def exchanged_thrusts(a: Airframe) -> str:
    """Condition numbers at the hover in both readings of M_y."""
    typed, ours = conditioning(a, 0.0, swapped=True), conditioning(a, 0.0, swapped=False)
    return f"condition number at the hover {typed:.3g} instead of {ours:.1f}, and a lasting error to the line of sight"


def gompertz_at_zero() -> str:
    """The printed sigmoid at the target."""
    return f"{float(printed_gompertz(np.zeros(1))[0]):+.2f} M at the target itself"


def printed_start() -> str:
    """Direction of the nose at the printed initial attitude."""
    roll, pitch, yaw = math.radians(10.0), math.radians(-45.0), math.radians(25.0)
    noses = [_elevation(q) for q in (_unit(PRINTED_START), from_euler(roll, pitch, yaw))]
    return f"it starts with the nose {noses[0]:+.0f} instead of {noses[1]:+.0f} deg above the horizon"


def hover_attitude() -> str:
    """Direction of the nose at the printed hover."""
    half = math.sqrt(0.5)
    return f"the nose points {_elevation(Quaternion(half, 0.0, half, 0.0)):+.0f} deg above the horizon"


def _elevation(q: Quaternion) -> float:
    """Of the nose above the horizon [deg]."""
    nose = x_axis(q)
    return math.degrees(math.atan2(nose.z, math.hypot(nose.x, nose.y)))


def _unit(q: Array) -> Quaternion:
    return Quaternion(*(q / np.linalg.norm(q)).tolist())
