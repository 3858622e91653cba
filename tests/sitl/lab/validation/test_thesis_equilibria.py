"""The closed-form equilibria of F. Sansou's thesis (2024, section 2.4) as an oracle for the trims.

The thesis writes them for its linear wing in NED and FRD, of the wind w as the body meets it. Its algorithm for the
pitch is met to the last digits. Its printed balances of forces and moment (equations of the proof) are met only with
the sign of their terms in the wind turned round: with v_b = -w the wing's force is +rho S |w| C (...) w / 2. Its
elevons, said to be positive nose-up, are positive nose-down in its equations. Two further slips do no harm here: S is
not b c, and b_g prints S_wet / (2 S_p) for the a_f = 1 - S_wet C_d / (4 S_p).
"""

import math

import pytest

from sitl import load_airframe
from sitl.design.trim import level_trim
from sitl.model.airframe import REPORT

G, RHO = 9.81, 1.225
M, S, S_WET, S_P = 0.519, 0.026936, 0.0180, 0.0127
C_D, C_L, XI_F, XI_M, DELTA_R = 0.1644, 5.4001, 0.2, 1.4, -0.0145
THESIS = load_airframe("published").parameters._replace(
    m=M, g=G, rho=RHO, S=S, S_ratio=S_WET / (4.0 * S_P), C_d0=C_D, C_y0=0.0, C_l=C_L, xi_f=XI_F, xi_m=XI_M,
    Delta_r=-DELTA_R, mu=0.0, k_f=1.623e-6, k_m=1.921e-8, omega_min=262.0, omega_max=1675.0, aerodynamics=REPORT,
)  # fmt: skip
WINDS = [(x, z) for x in (-1.0, -4.0, -8.0, -12.0) for z in (-2.0, 0.0, 2.0)]  # NED, from ahead [m/s]


def pitch(w_x, w_z):
    """Step 3 of its algorithm [rad]."""
    size = math.hypot(w_x, w_z)
    lifted = 2.0 * M * G / (RHO * S * size * C_L * (1.0 - XI_F / XI_M) * w_x)
    return -math.atan(w_z / w_x + lifted)


def trim(w_x, w_z):
    """Ours in the same wind: flight through the air by -w."""
    return level_trim(THESIS, math.hypot(w_x, w_z), math.atan2(w_z, -w_x))


def residuals(w_x, w_z, theta, tau, delta, sign):
    """Of the printed balances along x_b and z_b [N] and about y_b [N m], their wind's terms by a sign."""
    size = math.hypot(w_x, w_z)
    x = w_x * math.cos(theta) - w_z * math.sin(theta)
    z = w_x * math.sin(theta) + w_z * math.cos(theta)
    q, blown = sign * 0.5 * RHO * S * size, S_WET / (2.0 * S_P)
    return (
        (2.0 - blown * C_D) * tau - q * C_D * (x - XI_F * delta * z) - M * G * math.sin(theta),
        -blown * XI_F * C_L * tau * delta - q * C_L * (z + XI_F * delta * x) + M * G * math.cos(theta),
        DELTA_R * C_L * (blown * XI_M * tau * delta + q * (z + XI_M * delta * x)),
    )


@pytest.mark.parametrize(("w_x", "w_z"), WINDS)
def test_the_pitch_is_that_of_its_algorithm(w_x, w_z):
    assert trim(w_x, w_z).theta == pytest.approx(pitch(w_x, w_z), abs=1e-12)


@pytest.mark.parametrize(("w_x", "w_z"), WINDS)
def test_its_balances_hold_with_the_sign_of_the_wind_mended_and_not_as_printed(w_x, w_z):
    found = trim(w_x, w_z)
    flown = (found.theta, found.thrust, -found.delta)
    assert residuals(w_x, w_z, *flown, sign=-1.0) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    printed = residuals(w_x, w_z, *flown, sign=1.0)
    assert abs(printed[1]) > 0.02


def test_in_calm_the_thrust_carries_the_weight_and_the_drag():
    calm = level_trim(THESIS, 0.0)
    assert 2.0 * calm.thrust == pytest.approx(M * G / (1.0 - S_WET * C_D / (4.0 * S_P)))
    assert calm.thrust == pytest.approx(2.70, abs=0.005)  # the flight's figure has 2.98, by another k_f
