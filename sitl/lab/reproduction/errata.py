"""Errata of the report: every slip that was found, its correction, and its effect if it stays."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl import Airframe, Array, Quaternion
from sitl.design.trim import level_trim
from sitl.lab.reproduction.equations.as_typed import (
    PRINTED_B,
    PRINTED_START,
    ZERO_VECTOR,
    Slip,
    forward_matrices,
    kernel_wrench,
    typed_moment_matrix,
    typed_trim,
)
from sitl.lab.reproduction.equations.report_forward_flight import conditioning
from sitl.lab.reproduction.experiment import REPORT_SET, Conditions
from sitl.lab.reproduction.experiments.vertical_plane import printed_gompertz
from sitl.model.aerodynamics import force_matrix, moment_matrix
from sitl.model.quaternions import from_euler, x_axis

# Effects of the report's slips if they stay: the numbers of the errata, computed.


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


class Erratum(NamedTuple):
    """One slip."""

    place: str  # section of the report
    printed: str
    corrected: str
    effect: str  # if it stays; its numbers are computed


def errata(conditions: Conditions) -> list[Erratum]:
    """All of them, their effects computed for the published constants."""
    a = conditions.airframe(REPORT_SET)
    return [
        Erratum("2.1.2", "elevon rate +-5.24 rad/s2", "rad/s", "none: a unit"),
        Erratum(
            "2.1.2",
            "N_i = (-1)^i k_m w_i^2: the left propeller's torque is negative",
            "+k_m w_1^2 - k_m w_2^2, as in 2.2.1 and in the printed B",
            torque_sign(a),
        ),
        Erratum(
            "2.1.2, appendix A",
            "J_p = 5.1116e-6 kg m2, in no equation",
            "-w x J_p (w_1 - w_2) e_1 in the moments",
            rotor_gyroscopics(a),
        ),
        Erratum(
            "2.1.2",
            "T = k_f w^2 and N = k_m w^2 at any airspeed",
            "coefficients of thrust and torque that fall with the advance ratio",
            propeller_energy(a),
        ),
        Erratum(
            "2.1.3",
            "factored moments with (I + Delta_m)",
            "(I - Delta_f), as in the expanded form",
            "the elevons' moments change sign and coefficient",
        ),
        Erratum(
            "2.1.3",
            "force from the body rates with Phi(mv)",
            "with its transpose: the pitch rate moves the wing along its normal",
            transpose(a, conditions.seed),
        ),
        Erratum(
            "2.1.3, appendix B",
            "Phi(mv) and the arms [a_i]x, [p_i]x with the other sign",
            "the signs of FLU, which the printed matrices have",
            "nose-up elevons would turn the nose down",
        ),
        Erratum(
            "2.1.3, appendix A",
            "S and S_wet, but one area",
            "S = 1.15 S_wet: the free stream acts on all of the wing, the slipstream on 0.0743 m2 of it",
            area(a),
        ),
        Erratum(
            "2.2.1",
            "slipstream drag adds to the yaw arm: p_y + S/4S_p a_y C_d0",
            "it opposes the thrust: p_y - S/4S_p a_y C_d0",
            yaw_arm(a),
        ),
        Erratum(
            "2.2.2, 4.2.2",
            "M_y with (T1-T2)(d1+d2) + (T1+T2)(d1-d2)",
            "(T1+T2)(d1+d2) + (T1-T2)(d1-d2)",
            exchanged_thrusts(a),
        ),
        Erratum(
            "3.1.1",
            "q_bar = (1/sqrt2, 0, +1/sqrt2, 0)",
            "(1/sqrt2, 0, -1/sqrt2, 0): nose-up is a negative rotation about y",
            hover_attitude(),
        ),
        Erratum("3.1.1", "lambda = m g / (1 - S/4S_p C_d0)", "half of it, per motor", "twice the weight"),
        Erratum(
            "3.1.2",
            "A: dv_z/deps_2 = -sqrt2 g",
            "0 under the unit constraint of q",
            f"{-math.sqrt(2.0) * a.g:.2f} instead of 0: couples height with pitch in the gain",
        ),
        Erratum("3.1.2", "q' with eta alone in its rows", "eta omega_i", "none: the linearisation is right"),
        Erratum("3.1.2", "B: roll a_y C_l xi_m", "S/4S_p a_y C_l xi_f", roll_term(a)),
        Erratum("3.2", "kappa = |F_b (1,1,0,0)|", "1 / |F_b (1,1,0,0)|", kappa(a)),
        Erratum(
            "3.2.1",
            "Gompertz b = -ln(1/2), c = 1",
            "b = ln ln 2, c = 1/(M ln 2), made odd",
            gompertz_at_zero(),
        ),
        Erratum(
            "3.2.2",
            "q = (0.90, 0.19, 0.36, 0.15) for roll 10, pitch -45, yaw 25 deg",
            "it is that of roll 20, pitch -45, yaw 10 deg, but for the sign of its third entry",
            printed_start(),
        ),
        Erratum("4.1", "u_eq = 0.92 for the elevons", "delta, not delta T, in the free stream", one_number(a)),
        Erratum("4.1", "damping -rho S eta/2 B Phi(mw) w", "-rho S eta/2 B Phi(mw) B w", damping(a)),
        Erratum("4.2.1", "q_e with (1 <u_c|u_v>)/2 under the second root", "(1 - <u_c|u_v>)/2", "a missing sign"),
        Erratum(
            "4.2.1",
            "eps_e used as a body moment",
            "R(q)^T eps_e",
            "turns about the wrong axis once banked or climbing",
        ),
        Erratum(
            "4.2.2",
            "PID integrates v_bx, + k_d v_bx'",
            "integrates v_c - v_bx, - k_d v_bx'",
            "runs away from the speed",
        ),
        Erratum(
            "4.2.2",
            "condition number by eigenvalues",
            "by singular values",
            "eigenvalues say nothing of an inversion",
        ),
        Erratum(
            "4.2.3",
            "[5, 5, 5] is 8.6 m away, 1.72 m/s in five seconds",
            f"{math.sqrt(75.0):.2f} m, {math.sqrt(75.0) / 5.0:.2f} m/s",
            "none: cut, not rounded",
        ),
        Erratum("5.1", "back to the non-linear law if V < 400", "if V > 400", "leaves the linear law where it is best"),
        Erratum(
            "appendix A",
            "S_p = 0.3989 m2, xi_f = 0.85, xi_m = 0.55 with C_l = 2 pi + C_d0",
            "pi r2 = 0.0491 m2, 0.48, 0.93 with C_l = 3.94 (Diederich)",
            "reproduces none of the printed matrices",
        ),
        Erratum(
            "appendix B",
            "[p_i]x with +p_x in both off-diagonal places",
            "skew: +p_x and -p_x",
            "none: the thrust has only its x",
        ),
        Erratum(
            "appendix C",
            "Delta_f with xi_m, and no C_y0 term left",
            "xi_f; C_y0 xi_f delta T sideways",
            "none while C_y0 = 0",
        ),
        Erratum(
            "appendix D",
            "derivative of nu': + (k_pd/m + k_D) f_D'",
            "minus; a + before the second bracket; R(q_d) - R(q); the last term with nu'",
            "the feed-forward pushes the wrong way",
        ),
        Erratum("appendix D", "f_D,1' needs e_v'", "f_D,3' does", "none"),
    ]
