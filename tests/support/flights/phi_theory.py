"""The plant a second time: the report's factored matrix equations, with the signs of the body frame FLU.

Written from section 2.1.3 and appendix B alone, as a witness for the scalar kernels.
"""

import numpy as np

from sitl.model.airframe import Airframe


def skew(v):
    """[v]×."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def wrench(v_b, w, omega, delta, a: Airframe):
    """Sum of forces and moments in the body frame."""
    C_l, X = a.C_l, a.S_ratio
    Phi_fv = np.diag([a.C_d0, a.C_y0, C_l])
    Phi_mv = a.Delta_r / a.c * np.array([[0, 0, 0], [0, 0, C_l], [0, -a.C_y0, 0]])
    Phi_mw = 0.5 * np.array([[a.C_lp, a.C_lq, a.C_lr], [a.C_mp, a.C_mq, a.C_mr], [a.C_np, a.C_nq, a.C_nr]])
    B, one = np.diag([a.b, a.c, a.b]), np.eye(3)
    arms = [np.array([0.0, a.a_y, 0.0]), np.array([0.0, -a.a_y, 0.0])]
    motors = [np.array([a.p_x, a.p_y, 0.0]), np.array([a.p_x, -a.p_y, 0.0])]
    turn = skew([0.0, 1.0, 0.0])  # Delta of a unit xi delta
    Df, Dm = [a.xi_f * d * turn for d in delta], [a.xi_m * d * turn for d in delta]
    eta = np.sqrt(v_b @ v_b + a.mu * a.c**2 * (w @ w))
    quarter = 0.25 * a.rho * a.S * eta
    F, M = np.zeros(3), np.zeros(3)
    for i in range(2):
        T = np.array([a.k_f * omega[i] ** 2, 0.0, 0.0])
        F += T + X * Phi_fv @ (Df[i] - one) @ T
        M += skew(motors[i]) @ T + np.array([(1, -1)[i] * a.k_m * omega[i] ** 2, 0.0, 0.0])
        M += X * (B @ Phi_mv @ (Dm[i] - one) + skew(arms[i]) @ Phi_fv @ (Df[i] - one)) @ T
        F += quarter * (Phi_fv @ (Df[i] - one) @ v_b + Phi_mv @ (Df[i] - one) @ B @ w)
        M += quarter * (B @ Phi_mv @ (Dm[i] - one) @ v_b + B @ Phi_mw @ (Dm[i] - one) @ B @ w)
        # The wing's own [a_i] Phi(fv) v_b cancels between the halves; the elevons' does not.
        M += quarter * skew(arms[i]) @ Phi_fv @ Df[i] @ v_b
    return np.concatenate((F, M))
