"""Errata of the report: every slip that was found, its correction, and its effect if it stays."""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.lab.reproduction import errata_effects as effects
from sitl.lab.reproduction.experiment import REPORT_SET, Conditions


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
            effects.torque_sign(a),
        ),
        Erratum(
            "2.1.2, appendix A",
            "J_p = 5.1116e-6 kg m2, in no equation",
            "-w x J_p (w_1 - w_2) e_1 in the moments",
            effects.rotor_gyroscopics(a),
        ),
        Erratum(
            "2.1.2",
            "T = k_f w^2 and N = k_m w^2 at any airspeed",
            "coefficients of thrust and torque that fall with the advance ratio",
            effects.propeller_energy(a),
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
            effects.transpose(a, conditions.seed),
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
            effects.area(a),
        ),
        Erratum(
            "2.2.1",
            "slipstream drag adds to the yaw arm: p_y + S/4S_p a_y C_d0",
            "it opposes the thrust: p_y - S/4S_p a_y C_d0",
            effects.yaw_arm(a),
        ),
        Erratum(
            "2.2.2, 4.2.2",
            "M_y with (T1-T2)(d1+d2) + (T1+T2)(d1-d2)",
            "(T1+T2)(d1+d2) + (T1-T2)(d1-d2)",
            effects.exchanged_thrusts(a),
        ),
        Erratum(
            "3.1.1",
            "q_bar = (1/sqrt2, 0, +1/sqrt2, 0)",
            "(1/sqrt2, 0, -1/sqrt2, 0): nose-up is a negative rotation about y",
            effects.hover_attitude(),
        ),
        Erratum("3.1.1", "lambda = m g / (1 - S/4S_p C_d0)", "half of it, per motor", "twice the weight"),
        Erratum(
            "3.1.2",
            "A: dv_z/deps_2 = -sqrt2 g",
            "0 under the unit constraint of q",
            f"{-math.sqrt(2.0) * a.g:.2f} instead of 0: couples height with pitch in the gain",
        ),
        Erratum("3.1.2", "q' with eta alone in its rows", "eta omega_i", "none: the linearisation is right"),
        Erratum("3.1.2", "B: roll a_y C_l xi_m", "S/4S_p a_y C_l xi_f", effects.roll_term(a)),
        Erratum("3.2", "kappa = |F_b (1,1,0,0)|", "1 / |F_b (1,1,0,0)|", effects.kappa(a)),
        Erratum(
            "3.2.1",
            "Gompertz b = -ln(1/2), c = 1",
            "b = ln ln 2, c = 1/(M ln 2), made odd",
            effects.gompertz_at_zero(),
        ),
        Erratum(
            "3.2.2",
            "q = (0.90, 0.19, 0.36, 0.15) for roll 10, pitch -45, yaw 25 deg",
            "it is that of roll 20, pitch -45, yaw 10 deg, but for the sign of its third entry",
            effects.printed_start(),
        ),
        Erratum("4.1", "u_eq = 0.92 for the elevons", "delta, not delta T, in the free stream", effects.one_number(a)),
        Erratum("4.1", "damping -rho S eta/2 B Phi(mw) w", "-rho S eta/2 B Phi(mw) B w", effects.damping(a)),
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
