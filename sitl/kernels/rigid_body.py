"""Six degrees of freedom: forces, moments and the ground as the derivative of the plant's rigid state."""

from numba import njit

from sitl.kernels.aerodynamics import wrench
from sitl.kernels.ground import contact
from sitl.kernels.parameters import Airframe, Array
from sitl.kernels.state import ACTUATOR, P, Q, V, W


@njit(cache=True)
def derivative(x: Array, plant: Array, wind: Array, a: Airframe, dx: Array) -> None:
    r"""Right-hand side of the report's equations of motion, written into ``dx``.

    .. math::
        \dot p = v, \quad m \dot v = R(q) F + m g, \quad \dot q = \tfrac12 q \otimes \omega, \quad
        J \dot\omega = M - \omega \times J \omega

    Args:
        x: Rigid state and actuators (p, v, q, w, w1, w2, d1, d2), (17,).
        plant: Whole plant state; only its contact anchors are read, which a step holds, (SIZE,).
        wind: Velocity of the air, world NWU, (3,) [m/s].
        a: The airframe.
        dx: Receives the derivative, (13,).
    """
    qw, qx, qy, qz = x[Q], x[Q + 1], x[Q + 2], x[Q + 3]
    p, q, r = x[W], x[W + 1], x[W + 2]
    r00, r01, r02 = 1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy - qw * qz), 2 * (qx * qz + qw * qy)
    r10, r11, r12 = 2 * (qx * qy + qw * qz), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz - qw * qx)
    r20, r21, r22 = 2 * (qx * qz - qw * qy), 2 * (qy * qz + qw * qx), 1 - 2 * (qx * qx + qy * qy)
    ux, uy, uz = x[V] - wind[0], x[V + 1] - wind[1], x[V + 2] - wind[2]
    Fx, Fy, Fz, Mx, My, Mz = wrench(
        r00 * ux + r10 * uy + r20 * uz,
        r01 * ux + r11 * uy + r21 * uz,
        r02 * ux + r12 * uy + r22 * uz,
        p, q, r,
        x[ACTUATOR], x[ACTUATOR + 1], x[ACTUATOR + 2], x[ACTUATOR + 3], a,
    )  # fmt: skip
    Gx, Gy, Gz, Nx, Ny, Nz = contact(x, plant, a)
    dx[P], dx[P + 1], dx[P + 2] = x[V], x[V + 1], x[V + 2]
    dx[V] = (r00 * Fx + r01 * Fy + r02 * Fz + Gx) / a.m
    dx[V + 1] = (r10 * Fx + r11 * Fy + r12 * Fz + Gy) / a.m
    dx[V + 2] = (r20 * Fx + r21 * Fy + r22 * Fz + Gz) / a.m - a.g
    dx[Q] = 0.5 * (-qx * p - qy * q - qz * r)
    dx[Q + 1] = 0.5 * (qw * p + qy * r - qz * q)
    dx[Q + 2] = 0.5 * (qw * q + qz * p - qx * r)
    dx[Q + 3] = 0.5 * (qw * r + qx * q - qy * p)
    dx[W] = (Mx + Nx - (a.J3 - a.J2) * q * r) / a.J1
    dx[W + 1] = (My + Ny - (a.J1 - a.J3) * p * r) / a.J2
    dx[W + 2] = (Mz + Nz - (a.J2 - a.J1) * p * q) / a.J3
