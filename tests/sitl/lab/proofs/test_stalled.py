"""The proof's enclosures for a wing that stalls contain the rates of the plant."""

import math

import numpy as np
import pytest

from sitl.control.allocation import allocate
from sitl.control.hover_linear import SQRT_HALF, HoverError, control
from sitl.design import linearise
from sitl.design.proved import proved_gains
from sitl.lab.proofs.closed_loop import (
    AttitudeBoxes,
    Interval,
    coordinates,
    feedback,
    gyro_matrices,
    lyapunov_matrix,
    tilt_matrices,
)
from sitl.lab.proofs.proof import Proof, commands
from sitl.lab.proofs.surfaces import MOVING, hover_push, in_world, main_parts, normal_motion, per_mass, surfaces_push
from sitl.model.airframe_files import load
from sitl.model.plant import derivative, inflow
from sitl.model.quaternions import Quaternion
from sitl.model.state import Body
from sitl.model.vectors import Vector

COLLAGE = load("collage").parameters
GAINS = proved_gains(COLLAGE)
STILL = Vector(0.0, 0.0, 0.0)


def vector(x):
    return Vector(*x.tolist())


def rate(x):
    """Rate x' of the plant with what the law commands, (15,)."""
    e = x[6:9] - (0.0, SQRT_HALF, 0.0)
    body = Body(STILL, vector(x[3:6]), Quaternion(math.sqrt(1.0 - e @ e), *e.tolist()), vector(x[9:12]))
    seen = HoverError(vector(x[:3]), vector(x[3:6]), vector(x[6:9]), vector(x[9:12]))
    command, _ = allocate(control(seen, vector(x[12:]), 0.0, GAINS), COLLAGE, inflow(body, STILL))
    p, v, q, w = derivative(body, command, STILL, STILL, STILL, COLLAGE)
    return np.array((*p, *v, q.x, q.y, q.z, *w, *(x[:3] + GAINS.lead * np.array(p))))


@pytest.mark.long
def test_the_rate_of_every_state_lies_within_its_enclosure():
    proof, P = Proof.of(COLLAGE, GAINS), lyapunov_matrix(GAINS)
    stalled, rng = proof.stalled(1.0), np.random.default_rng(2)
    y = rng.standard_normal((100, 15))
    y *= np.sqrt(rng.uniform(0.01, 1.0, (100, 1))) / np.linalg.norm(y, axis=1)[:, None]
    for x in y @ np.linalg.inv(np.linalg.cholesky(P)):
        f = coordinates(15) @ x
        at = AttitudeBoxes(f[None], f[None])
        M = proof.F + np.einsum("k,kij->ij", f, np.stack(tilt_matrices(COLLAGE, GAINS)))
        M += np.einsum("k,kij->ij", x[9:12], np.stack(gyro_matrices(COLLAGE, 15)))
        low, high = M @ x, M @ x
        speed, spin = (np.array([np.linalg.norm(part)]) for part in (x[3:6], x[9:12]))
        normal = np.array([normal_motion(COLLAGE) @ x[MOVING]])
        mains = stalled.main_terms(speed, spin, Interval(normal, normal), at)
        terms = [*proof.remainder(at), *stalled.terms(at, speed, spin), *((main.share, main.M) for main in mains)]
        for share, part in [*terms, *((main.share * change, part) for main in mains for change, part in main.turned)]:
            ends = np.stack([share.low[0] * part @ x, share.high[0] * part @ x])
            low, high = low + ends.min(0), high + ends.max(0)
        assert (rate(x) >= low - 1e-12).all()
        assert (rate(x) <= high + 1e-12).all()


def test_pairs_of_commands_stay_within_the_bounds_of_mean_and_half_difference():
    y = np.random.default_rng(4).standard_normal((20_000, 15))
    x = y / np.linalg.norm(y, axis=1)[:, None] @ np.linalg.inv(np.linalg.cholesky(lyapunov_matrix(GAINS)))
    T1, T2, left, right = np.array(GAINS.u_bar)[:, None] - feedback(GAINS) @ x.T
    d1, d2, T, asked = left / T1, right / T2, GAINS.u_bar.T1, commands(GAINS, 1.0)
    found = [T1 / T - 1.0, 0.5 * (T1 + T2) / T - 1.0, 0.5 * (T1 - T2) / T, d1, 0.5 * (d1 + d2), 0.5 * (d1 - d2)]
    for bound, values in zip(asked, found, strict=True):
        assert 0.5 * bound < np.abs(values).max() <= bound


def test_half_of_the_roll_by_uneven_thrusts_counts_by_either_factor():
    """Uneven pushes by the thrusts, of the motion's share and of the thrusts', are the same on every state."""
    parts, stalled = main_parts(COLLAGE, GAINS), Proof.of(COLLAGE, GAINS).stalled(1.0)
    x, K = np.random.default_rng(5).standard_normal(15), feedback(GAINS)
    by_motion = stalled._shared() * (normal_motion(COLLAGE) @ x[MOVING]) * (parts[2].upright() @ x)
    by_thrusts = stalled._shared() * (-0.5 * (K[0] - K[1]) @ x) * (parts[1].upright() @ x)
    assert by_motion[9] == pytest.approx(by_thrusts[9])
    assert np.count_nonzero(by_motion) == 1


def test_the_push_at_the_hover_is_that_of_the_linear_model():
    A, _ = linearise.hover(COLLAGE)
    push = -hover_push(COLLAGE, GAINS.u_bar.T1) * sum(surfaces_push(COLLAGE, y) for y in (0.155, -0.155))
    M = in_world(per_mass(COLLAGE, push), 12)
    moving = np.ix_([3, 4, 5, 9, 10, 11], [3, 4, 5, 9, 10, 11])
    assert A[moving] == pytest.approx(M[moving], abs=1e-5)


def test_another_level_of_aerodynamics_has_no_such_terms():
    nominal = load("nominal").parameters
    assert Proof.of(nominal, proved_gains(nominal)).stalled(1.0) is None
