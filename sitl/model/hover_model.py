"""The simplified hover model m v' = R F_b u - m g, J w' = M_b u - w × J w (report, section 2.2.1).

Its input is u = (T1, T2, delta1 T1, delta2 T2); what depends on the airspeed is left out.
"""

import numpy as np

from sitl.model.airframe import Airframe, Array, slipstream_slope


def force_matrix(a: Airframe) -> Array:
    """Input matrix F_b of the forces, (3, 4)."""
    thrust = 1.0 - a.S_ratio * a.C_d0
    lift = a.S_ratio * slipstream_slope(a) * a.xi_f
    return np.array([[thrust, thrust, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0], [0.0, 0.0, -lift, -lift]])


def moment_matrix(a: Airframe) -> Array:
    """Input matrix M_b of the moments, (3, 4), in the signs of the frame FLU."""
    torque = a.k_m / a.k_f
    slope = slipstream_slope(a)
    roll = a.S_ratio * a.a_y * slope * a.xi_f
    pitch = a.S_ratio * a.Delta_r * slope * a.xi_m
    yaw = a.p_y - a.S_ratio * a.a_y * a.C_d0
    return np.array([[torque, -torque, -roll, roll], [0.0, 0.0, -pitch, -pitch], [-yaw, yaw, 0.0, 0.0]])


def inertia(a: Airframe) -> Array:
    """Principal inertias, (3,) [kg m2]."""
    return np.array([a.J1, a.J2, a.J3])
