"""The zero-moment law on the plain quadrotor, where its model is exact."""

import numpy as np

from sitl.kernels.quadrotor import Quadrotor, force_matrix, moment_matrix, quadrotor_step
from sitl.kernels.quaternion import from_euler, rotate
from sitl.kernels.state import ACTUATOR, P, Q, V
from sitl.laws import hover_zero_moment
from sitl.laws.governor import LINEAR, GovernorParameters
from sitl.laws.hover_zero_moment import ZeroMomentGains

QUADROTOR = Quadrotor(m=0.5, J1=3e-3, J2=3e-3, J3=5e-3, g=9.81, arm=0.17, torque=0.016, T_max=3.0)
TICK = 0.002


def quadrotor_gains(*, nu_prime=False, governor=LINEAR, **changes):
    a = QUADROTOR
    lift = np.linalg.norm(force_matrix().sum(axis=1))
    return ZeroMomentGains(
        governor=GovernorParameters(governor, 1.5, 1.5, a.m, 0.5, 1.0, 2.0, 2.5),
        k_delta=5.0,
        lam=10.0,
        zeta=0.8,
        k_q=1.0,
        nu_prime=int(nu_prime),
        m=a.m,
        g=a.g,
        J=np.array((a.J1, a.J2, a.J3)),
        d=np.array((0.0, 0.0, 1.0)),
        M_pinv=np.ascontiguousarray(np.linalg.pinv(moment_matrix(a))),
        u_bar=np.ones(4) / lift,
        f_min=0.1 * a.m * a.g,
        f_max=0.95 * 4.0 * a.T_max,
    )._replace(**changes)


def fly(target, gains, *, duration, attitude=(0.0, 0.0, 0.0), heading=0.0):
    """From rest at the origin: per tick the distance, f_D, the attitude and whether a thrust was cut."""
    x, law, u = np.zeros(ACTUATOR), np.empty(hover_zero_moment.SIZE), np.empty(4)
    x[Q : Q + 4] = from_euler(*attitude)
    hover_zero_moment.reset(x, QUADROTOR.m * QUADROTOR.g, law, gains)
    aim, q_ref = np.array(target, dtype=float), from_euler(0.0, 0.0, heading)
    distance, f_D, q, cut = [], [], [], []
    for _ in range(round(duration / TICK)):
        wanted = hover_zero_moment.wanted_force(x[P : P + 3] - aim, x[V : V + 3], 3.0, gains)
        f_D.append(rotate(law[:4].copy(), gains.d) * law[4] - wanted)
        distance.append(np.linalg.norm(x[P : P + 3] - aim))
        q.append(x[Q : Q + 4].copy())
        hover_zero_moment.control(x, law, aim, q_ref, 3.0, gains, TICK, u)
        cut.append(quadrotor_step(x, u, QUADROTOR, 0.5 * TICK) | quadrotor_step(x, u, QUADROTOR, 0.5 * TICK))
    return np.array(distance), np.array(f_D), np.array(q), np.array(cut)
