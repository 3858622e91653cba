"""The proved region of attraction of the linear hover law."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from sitl.control.allocation import allocate
from sitl.control.hover_linear import SQRT_HALF, HoverError, control, error, quadratic
from sitl.design.lqr import hover_gains
from sitl.design.proved import proved_gains
from sitl.errors import SitlError
from sitl.lab.proofs import proof, region
from sitl.lab.proofs.closed_loop import (
    AttitudeBoxes,
    coordinates,
    elevon_effect,
    gyro_matrices,
    row_matrix,
    size,
    tilt_matrices,
)
from sitl.lab.proofs.cover import falls_within
from sitl.lab.proofs.region import certify, chart_level, saturation_level
from sitl.lab.proofs.rise import first_rise, lyapunov_rate
from sitl.model.airframe_files import load
from sitl.model.quaternions import Quaternion
from sitl.model.vectors import Vector

NOMINAL = load("nominal").parameters
LQR = hover_gains(NOMINAL, integral=False)
TO_X = np.linalg.inv(np.linalg.cholesky(LQR.S))  # rows of unit y to V = 1


@pytest.fixture(scope="module")
def certificate():
    return certify(NOMINAL, LQR, precision=1.0, sampled=False)


def directions(count, seed=1):
    y = np.random.default_rng(seed).standard_normal((count, 12))
    return y / np.linalg.norm(y, axis=1)[:, None] @ TO_X


def commanded(x, gains, a):
    """Command of the law at a deviation (12,), and its allocation to the actuators."""
    seen = HoverError(*(Vector(*part.tolist()) for part in x[:12].reshape(4, 3)))
    integral = Vector(*x[12:].tolist()) if x.size > 12 else Vector(0.0, 0.0, 0.0)
    u = control(seen, integral, 0.0, gains)
    return u, *allocate(u, a)


@pytest.mark.long
@pytest.mark.parametrize("gains", [LQR, proved_gains(NOMINAL)])
def test_the_proof_s_matrices_are_the_plant(gains):
    """On boxes that are points, with the rates, airspeed and elevons of the state, y' W y is -V' exactly."""
    made = proof.Proof.of(NOMINAL, gains, sampled=False)
    lift, n, a = made.lift(1.0), size(gains), NOMINAL
    for direction in np.random.default_rng(1).standard_normal((20, n)):
        x = 0.05 * direction / np.linalg.norm(direction) @ np.linalg.inv(made.L)
        f = (coordinates(n) @ x)[None]
        at = AttitudeBoxes(f, f)
        command = commanded(x, gains, a)[1]
        eta = math.sqrt(x[3:6] @ x[3:6] + a.mu * a.c**2 * x[9:12] @ x[9:12])
        h, (d1, d2) = 0.5 * a.rho * a.S * eta, command[2:]
        parts = [*zip((*f[0], *x[9:12]), (*tilt_matrices(a, gains), *gyro_matrices(a, n)), strict=True)]
        parts += [(middle(value), M) for value, M in made.remainder(at)]
        for G, d in zip(made.aero, (1.0, d1 + d2, d1 - d2), strict=True):
            parts += [(h * d * middle(value), M) for value, M in made.air(at, G)]
        nose = sum(middle(at.axes[0][i]) * x[3 + i] for i in range(3))
        for k in (0, 1):
            kappa = h * nose / (2.0 * a.S_ratio * a.k_f * command[k] ** 2)
            M, force = elevon_effect(a, gains, k)
            parts += [(kappa, M), *((kappa * middle(at.axes[2][i]), row_matrix(3 + i, force)) for i in range(3))]
        W = lift.base - sum(share * lift.of(M) for share, M in parts)
        y = made.L.T @ x
        assert -(y @ W @ y) == pytest.approx(lyapunov_rate(x, gains, a), rel=1e-8, abs=1e-12)


def middle(value):
    assert value.low == pytest.approx(value.high, abs=1e-12)
    return float(value.low[0])


@pytest.mark.long
def test_v_falls_on_the_plant_everywhere_in_the_proved_set(certificate):
    shares = np.linspace(0.02, 1.0, 3000)
    for share, x in zip(shares, directions(3000), strict=True):
        assert lyapunov_rate(math.sqrt(share * certificate.level) * x, LQR, NOMINAL) < 0.0


def test_off_the_chart_there_is_no_rate():
    assert math.isnan(lyapunov_rate(np.array([0.0] * 6 + [1.0, 0.0, 0.5] + [0.0] * 3), LQR, NOMINAL))


@pytest.mark.long
def test_the_proof_is_within_a_factor_of_the_first_rise(certificate):
    rise = first_rise(NOMINAL, LQR, searches=2)
    assert 0.04 < rise < 0.06
    assert rise < 4.0 * certificate.level
    proved = proof.Proof.of(NOMINAL, LQR, sampled=False)
    assert falls_within(proved, 0.1 * certificate.level)
    assert not falls_within(proved, rise)


def test_no_actuator_meets_a_limit_below_the_saturation_level():
    level = saturation_level(NOMINAL, LQR)
    assert proof.greatest_deflection(LQR, level) == pytest.approx(NOMINAL.delta_max)
    greatest = 0.0
    for sign in (-1.0, 1.0):  # where the ellipsoid touches the plane of an elevon's limit
        x = np.linalg.solve(LQR.S, NOMINAL.delta_max * LQR.K[0] + sign * LQR.K[2])
        x *= math.sqrt(level / (x @ LQR.S @ x))
        u, _, _ = commanded(x, LQR, NOMINAL)
        greatest = max(greatest, abs(u.dT1) / u.T1)
    assert greatest == pytest.approx(NOMINAL.delta_max)
    for x in math.sqrt(level) * directions(500):
        assert commanded(x, LQR, NOMINAL)[2] == 0


def test_v_does_not_tell_a_vehicle_on_its_head_from_the_hover():
    """Turned over its back to 1 deg from straight down: x holds eps alone, and eps is the hover's."""
    half, still = math.radians(269.0 / 2.0), Vector(0.0, 0.0, 0.0)
    attitude = Quaternion(math.cos(half), 0.0, -math.sin(half), 0.0)
    x = error(SimpleNamespace(position=still, velocity=still, attitude=attitude, rates=still), still, 0.0)
    assert quadratic(x, LQR.S) < 0.01


def test_below_the_chart_s_level_eta_cannot_vanish():
    level = chart_level(LQR)
    eps = np.random.default_rng(1).standard_normal((20_000, 3))
    off = eps / np.linalg.norm(eps, axis=1)[:, None] - (0.0, -SQRT_HALF, 0.0)
    least = np.einsum("ni,ij,nj->n", off, region._marginal(LQR.S, slice(6, 9)), off).min()
    assert level <= least < 1.02 * level


def test_what_the_proof_does_not_cover_is_refused():
    with pytest.raises(SitlError, match="hold the integral"):
        certify(NOMINAL, hover_gains(NOMINAL))
    with pytest.raises(SitlError, match="no pair"):
        certify(NOMINAL, LQR._replace(S=np.eye(12)))
