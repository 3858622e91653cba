"""What the proof takes of a wing that stalls encloses what the plant does."""

import math

import numpy as np
import pytest

from sitl.control.allocation import allocate
from sitl.control.hover_linear import SQRT_HALF, HoverError, control
from sitl.design import linearise
from sitl.design.closed_loop import AttitudeBoxes, coordinates, gyro_matrices, lyapunov_matrix, tilt_matrices
from sitl.design.proof import Proof
from sitl.design.proved import proved_gains
from sitl.design.stalled import hover_push, in_world, per_mass, surfaces_push
from sitl.model.airframe_files import load
from sitl.model.plant import derivative, inflow
from sitl.model.quaternions import Quaternion
from sitl.model.state import Body
from sitl.model.vectors import Vector

PHYSICAL = load("physical").parameters
GAINS = proved_gains(PHYSICAL)
STILL = Vector(0.0, 0.0, 0.0)


def vector(x):
    return Vector(*x.tolist())


def rate(x):
    """Rate x' of the plant with what the law commands, (15,)."""
    e = x[6:9] - (0.0, SQRT_HALF, 0.0)
    body = Body(STILL, vector(x[3:6]), Quaternion(math.sqrt(1.0 - e @ e), *e.tolist()), vector(x[9:12]))
    seen = HoverError(vector(x[:3]), vector(x[3:6]), vector(x[6:9]), vector(x[9:12]))
    command, _ = allocate(control(seen, vector(x[12:]), 0.0, GAINS), PHYSICAL, inflow(body, STILL))
    p, v, q, w = derivative(body, command, STILL, STILL, STILL, PHYSICAL)
    return np.array((*p, *v, q.x, q.y, q.z, *w, *(x[:3] + GAINS.lead * np.array(p))))


def test_the_rate_of_every_state_lies_within_its_enclosure():
    proof, P = Proof.of(PHYSICAL, GAINS), lyapunov_matrix(GAINS)
    stalled, (speed, spin) = proof.stalled(1.0), np.array(proof.greatest_motion(1.0))[:, None]
    rng = np.random.default_rng(2)
    y = rng.standard_normal((100, 15))
    y *= np.sqrt(rng.uniform(0.01, 1.0, (100, 1))) / np.linalg.norm(y, axis=1)[:, None]
    for x in y @ np.linalg.inv(np.linalg.cholesky(P)):
        f = coordinates(15) @ x
        at = AttitudeBoxes(f[None], f[None])
        M = proof.F + np.einsum("k,kij->ij", f, np.stack(tilt_matrices(PHYSICAL, GAINS)))
        M += np.einsum("k,kij->ij", x[9:12], np.stack(gyro_matrices(PHYSICAL, 15)))
        low, high = M @ x, M @ x
        for share, part in [*proof.remainder(at), *stalled.terms(at, speed, spin), *stalled.main_terms(speed, spin)]:
            ends = np.stack([share.low[0] * part @ x, share.high[0] * part @ x])
            low, high = low + ends.min(0), high + ends.max(0)
        assert (rate(x) >= low - 1e-12).all()
        assert (rate(x) <= high + 1e-12).all()


def test_the_push_at_the_hover_is_that_of_the_linear_model():
    A, _ = linearise.hover(PHYSICAL)
    push = -hover_push(PHYSICAL, GAINS.u_bar.T1) * sum(surfaces_push(PHYSICAL, y) for y in (0.155, -0.155))
    M = in_world(per_mass(PHYSICAL, push), 12)
    moving = np.ix_([3, 4, 5, 9, 10, 11], [3, 4, 5, 9, 10, 11])
    assert A[moving] == pytest.approx(M[moving], abs=1e-5)


def test_another_level_of_aerodynamics_has_no_such_terms():
    nominal = load("nominal").parameters
    assert Proof.of(nominal, proved_gains(nominal)).stalled(1.0) is None
