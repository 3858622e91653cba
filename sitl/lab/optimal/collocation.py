"""Direct collocation: any control problem with its time free, as a nonlinear program that IPOPT solves.

On each interval of a mesh the states are a polynomial that obeys the dynamics at Gauss-Legendre points, the controls
are constant: what they could do between the points, no mesh could promise. Gauss points keep what is quadratic and kept
by the dynamics, as the norm of a quaternion.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import casadi as ca
import numpy as np

from sitl import Array, SitlError
from sitl.lab.optimal.symbols import Expression

DEGREE = 3  # of the polynomials on an interval
MOST_ITERATIONS, MOST_NEARBY = 150, 80  # from a guess, and from a solution on another mesh
ADAPTED = 0.5  # share of an adapted mesh's nodes that go where controls are busy
EVEN_SAMPLES = 200  # of a crowded mesh, to be blended in
TOLERANCE_OF_IPOPT = 1e-6  # of the scaled problem
CLOSE_ENOUGH = 1e-4  # likewise, where the cost no longer changes, by a share of SAME_COST
SAME_COST = 2e-5
FEASIBLE = 1e-6  # constraints at most so far off: a course, if not the best near it
NESTED_DISSECTION = 5  # MUMPS's number of METIS: ten times less fill than its own choice where time couples all
OUT_OF_ITERATIONS = "Maximum_Iterations_Exceeded"
THREADS = "OPENBLAS_NUM_THREADS"
PIVOT_TOLERANCE = 1e-4  # IPOPT's 1e-6 ends in more steps that are taken back
FROM_AFAR = {"mu_strategy": "adaptive"}  # options of IPOPT where the guess is rough
FROM_NEAR = {"mu_strategy": "monotone", "mu_init": 1e-3, "bound_push": 1e-4, "bound_frac": 1e-4}

Progress: TypeAlias = Callable[[int, float, float], None]
"""Told the iteration, the cost and how far the constraints are off."""


_kept_alive: list[ca.Function] = []  # the last solver: with it go the compiled derivatives that the next one needs


def _load_solver() -> None:
    """Have IPOPT on one thread: MUMPS multiplies small matrices, and BLAS reads the number when it is loaded."""
    before = os.environ.get(THREADS)
    os.environ[THREADS] = "1"
    ca.load_nlpsol("ipopt")
    if before is None:
        del os.environ[THREADS]
    else:
        os.environ[THREADS] = before


_load_solver()


class UnsolvedError(SitlError):
    """No solution was found; the message says why."""


@dataclass(frozen=True)
class ControlProblem:
    """Least of ``time_weight T + integral of the running cost`` over states (n,), controls (m,) and the time T.

    Bounds are inclusive; an infinite one is none.
    """

    dynamics: ca.Function  # of states and controls: rates (n,), running cost
    state_bounds: tuple[Array, Array]  # (n,) each
    control_bounds: tuple[Array, Array]  # (m,) each
    start: Array  # states, (n,)
    end: ca.Function  # of states and controls: what is bounded at the end, (k,)
    end_bounds: tuple[Array, Array]  # (k,) each
    time_bounds: tuple[float, float]  # [s]
    scales: tuple[Array, Array]  # of states and controls, about their sizes
    time_weight: float = 1.0  # per second
    cost_scale: float = 1.0
    path: ca.Function | None = None  # of states and controls: what is bounded on the way, (j,)
    path_bounds: tuple[Array, Array] = field(default_factory=lambda: (np.empty(0), np.empty(0)))


class Course(NamedTuple):
    """States and controls over time, between the nodes by the polynomials that solve the problem."""

    times: Array  # of the nodes, (N + 1,) [s]
    nodes: Array  # states at them, (N + 1, n)
    inner: Array  # states at the collocation points, (N, DEGREE, n)
    controls: Array  # on the intervals, (N, m)

    @property
    def time(self) -> float:
        """Duration [s]."""
        return float(self.times[-1])

    def at(self, times: Array) -> tuple[Array, Array]:
        """States (k, n) and controls (k, m) at times (k,) [s]."""
        interval = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(self.controls) - 1)
        lengths = np.diff(self.times)[interval]
        s = np.clip((times - self.times[interval]) / lengths, 0.0, 1.0)
        points = np.array([0.0, *ca.collocation_points(DEGREE, "legendre")])
        knots = np.concatenate([self.nodes[:-1, None, :], self.inner], axis=1)[interval]  # (k, DEGREE + 1, n)
        return np.einsum("kj,kjn->kn", _lagrange(points, s), knots), self.controls[interval]


def _lagrange(points: Array, s: Array) -> Array:
    """Weights (k, j) of values at points (j,) in the polynomial through them, at the places (k,)."""
    weights = np.ones((len(s), len(points)))
    for j, own in enumerate(points):
        for other in np.delete(points, j):
            weights[:, j] *= (s - other) / (own - other)
    return weights


class Solved(NamedTuple):
    """A solution of a control problem."""

    course: Course
    cost: float  # with the time's weight
    iterations: int


def even_mesh(intervals: int) -> Array:
    """Nodes as shares of the time, (intervals + 1,)."""
    return np.linspace(0.0, 1.0, intervals + 1)


def crowded_mesh(intervals: int, crowding: float = 0.6) -> Array:
    """The same, closer together at both ends: manoeuvres begin and end quicker than they go on."""
    even = even_mesh(intervals)
    return np.asarray((1.0 - crowding) * even + crowding * 0.5 * (1.0 - np.cos(np.pi * even)))


def adapted_mesh(course: Course, intervals: int, control_scale: Array) -> Array:
    """Nodes as shares of the time, close together where a course's controls are busy, (intervals + 1,).

    Args:
        course: A solution on any mesh.
        intervals: How many.
        control_scale: About the sizes of controls, (m,).
    """
    lengths = np.diff(course.times) / course.time
    busy = np.abs(course.controls / control_scale).mean(axis=1)
    jumps = np.abs(np.diff(course.controls / control_scale, axis=0)).mean(axis=1)
    busy += np.concatenate([[0.0], jumps]) + np.concatenate([jumps, [0.0]])
    padded = np.concatenate([busy[:1], busy, busy[-1:]])
    work = lengths * (0.25 * padded[:-2] + 0.5 * padded[1:-1] + 0.25 * padded[2:])
    done = np.concatenate([[0.0], np.cumsum(work)]) / max(float(work.sum()), 1e-9)
    nodes = course.times / course.time
    even = np.interp(nodes, crowded_mesh(EVEN_SAMPLES), even_mesh(EVEN_SAMPLES))
    filled = (1.0 - ADAPTED) * even + ADAPTED * done
    return np.interp(even_mesh(intervals), filled / filled[-1], nodes)


def ignore_iterations(iteration: int, cost: float, off: float) -> None:
    """Nobody watches."""


def print_iterations(title: str) -> Progress:
    """Shows iterations as one line of the standard error that is written anew."""

    def show(iteration: int, cost: float, off: float) -> None:
        text = f"{title}: iteration {iteration}, cost {cost:.4g}, constraints {off:.0e} off"
        print(f"\r{text:<78}", end="", file=sys.stderr, flush=True)

    return show


class _Watch(ca.Callback):  # type: ignore[misc]
    """Reports IPOPT's iterations."""

    def __init__(self, sizes: tuple[int, int], bounds: tuple[Array, Array], tell: Progress, scale: float) -> None:
        ca.Callback.__init__(self)
        self._sizes, self._bounds, self._tell, self._scale = sizes, bounds, tell, scale
        self.iterations = 0
        self.construct("watch", {})

    def get_n_in(self) -> int:
        return int(ca.nlpsol_n_out())

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, i: int) -> Expression:
        size = {"x": self._sizes[0], "lam_x": self._sizes[0], "g": self._sizes[1], "lam_g": self._sizes[1], "f": 1}
        return ca.Sparsity.dense(size.get(ca.nlpsol_out(i), 0), 1)

    def eval(self, values: list[Expression]) -> list[int]:
        told = dict(zip(ca.nlpsol_out(), values, strict=True))
        g = np.asarray(told["g"]).ravel()
        self._tell(self.iterations, float(told["f"]) * self._scale, _excess(g, self._bounds))
        self.iterations += 1
        return [0]


def _excess(g: Array, bounds: tuple[Array, Array]) -> float:
    """Distance of the constraint that is farthest off."""
    return float(np.max(np.maximum(bounds[0] - g, g - bounds[1]), initial=0.0))


class _Transcription:
    """The program of a problem on a mesh: variables are T, nodes, inner states by point, and controls, all scaled."""

    def __init__(self, problem: ControlProblem, mesh: Array) -> None:
        self.problem, self.mesh = problem, mesh
        self.n, self.m, self.intervals = len(problem.start), len(problem.scales[1]), len(mesh) - 1
        shapes = [(1, 1), (self.n, self.intervals + 1)]
        shapes += [(self.n, self.intervals)] * DEGREE + [(self.m, self.intervals)]
        self.shapes = shapes
        variables = [ca.MX.sym(f"part{i}", *shape) for i, shape in enumerate(shapes)]
        self.vector = ca.veccat(*variables)
        state_scale, control_scale = problem.scales
        self.time = variables[0]
        by_row = ca.diag(ca.DM(state_scale))
        self.nodes = by_row @ variables[1]
        self.inner = [by_row @ part for part in variables[2:-1]]
        self.controls = ca.diag(ca.DM(control_scale)) @ variables[-1]
        self._build(ca.diag(ca.DM(1.0 / state_scale)))

    def _build(self, by_scale: Expression) -> None:
        p = self.problem
        slopes, ends, shares = ca.collocation_coeff(ca.collocation_points(DEGREE, "legendre"))
        lengths = ca.DM(np.diff(self.mesh)).T
        widths = ca.repmat(lengths, self.n, 1) * self.time
        parts = [self.nodes[:, :-1], *self.inner]
        rates = p.dynamics.map(self.intervals)
        constraints, low, high = [], [], []
        running: Expression = 0
        for j, inner in enumerate(self.inner):
            rate, cost = rates(inner, self.controls)
            slope = sum(float(slopes[r, j]) * part for r, part in enumerate(parts))
            constraints.append(ca.vec(by_scale @ (slope - widths * rate)))
            running += float(shares[j]) * ca.sum2(cost * lengths) * self.time
        end = sum(float(ends[r]) * part for r, part in enumerate(parts))
        constraints.append(ca.vec(by_scale @ (self.nodes[:, 1:] - end)))
        equal = np.zeros(self.n * self.intervals * (DEGREE + 1))
        low, high = [equal], [equal]
        if p.path is not None:
            on_way = p.path.map(self.intervals)
            for inner in self.inner:
                constraints.append(ca.vec(on_way(inner, self.controls)))
                low.append(np.tile(p.path_bounds[0], self.intervals))
                high.append(np.tile(p.path_bounds[1], self.intervals))
        constraints.append(p.end(self.nodes[:, -1], self.controls[:, -1]))
        self.constraints = ca.vertcat(*constraints)
        self.low, self.high = np.concatenate([*low, p.end_bounds[0]]), np.concatenate([*high, p.end_bounds[1]])
        self.cost = (p.time_weight * self.time + running) / p.cost_scale

    def variable_bounds(self) -> tuple[Array, Array]:
        """Of the vector of variables."""
        p = self.problem
        sides = []
        for side in (0, 1):
            state, control = p.state_bounds[side] / p.scales[0], p.control_bounds[side] / p.scales[1]
            nodes = np.tile(state, (self.intervals + 1, 1))
            nodes[0] = p.start / p.scales[0]
            inner = [np.tile(state, self.intervals)] * DEGREE
            sides.append(
                np.concatenate([[p.time_bounds[side]], nodes.ravel(), *inner, np.tile(control, self.intervals)])
            )
        return sides[0], sides[1]

    def packed(self, guess: Course) -> Array:
        """A course as a vector of variables."""
        state_scale, control_scale = self.problem.scales
        times = self.mesh * guess.time
        nodes, _ = guess.at(times)
        inner = [guess.at(times[:-1] + p * np.diff(times))[0] for p in ca.collocation_points(DEGREE, "legendre")]
        _, controls = guess.at(0.5 * (times[1:] + times[:-1]))
        states = [(part / state_scale).ravel() for part in (nodes, *inner)]
        return np.concatenate([[guess.time], *states, (controls / control_scale).ravel()])

    def unpacked(self, vector: Array) -> Course:
        """The course of a vector of variables."""
        state_scale, control_scale = self.problem.scales
        sizes = np.cumsum([0] + [rows * columns for rows, columns in self.shapes])
        parts = [vector[begin:end] for begin, end in pairwise(sizes)]
        nodes = parts[1].reshape(-1, self.n) * state_scale
        inner = np.stack([part.reshape(-1, self.n) * state_scale for part in parts[2:-1]], axis=1)
        return Course(self.mesh * float(parts[0][0]), nodes, inner, parts[-1].reshape(-1, self.m) * control_scale)


def sampled_course(times: Array, states: Array, controls: int) -> Course:
    """A guess from samples: in straight lines from one to the next, controls at rest.

    Args:
        times: From 0, ascending, (k,) [s].
        states: At them, (k, n).
        controls: How many there are.
    """
    points = np.array(ca.collocation_points(DEGREE, "legendre"))[None, :, None]
    inner = states[:-1, None, :] + points * np.diff(states, axis=0)[:, None, :]
    return Course(times, states, inner, np.zeros((len(times) - 1, controls)))


def solve(
    problem: ControlProblem,
    mesh: Array,
    guess: Course,
    tell: Progress = ignore_iterations,
    *,
    is_near: bool = False,
    patience: int = 1,
) -> Solved:
    """The course of least cost near a guess.

    Args:
        problem: What is sought.
        mesh: Nodes as shares of the time, (N + 1,).
        guess: Where IPOPT begins.
        tell: Is told of its progress.
        is_near: The guess is a solution on another mesh: IPOPT stays near it.
        patience: Times as many iterations as are mostly enough.

    Raises:
        UnsolvedError: IPOPT did not get there; the message has its reason.
    """
    program = _Transcription(problem, mesh)
    bounds = (program.low, program.high)
    watch = _Watch((program.vector.numel(), program.constraints.numel()), bounds, tell, problem.cost_scale)
    options = {
        "print_time": False,
        "iteration_callback": watch,
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            "max_iter": patience * (MOST_NEARBY if is_near else MOST_ITERATIONS),
            "tol": TOLERANCE_OF_IPOPT,
            "acceptable_tol": CLOSE_ENOUGH,
            "acceptable_iter": 5,
            "acceptable_constr_viol_tol": FEASIBLE,
            "acceptable_compl_inf_tol": 1e-5,
            "acceptable_obj_change_tol": SAME_COST,
            "mumps_pivot_order": NESTED_DISSECTION,
            "mumps_pivtol": PIVOT_TOLERANCE,
            **(FROM_NEAR if is_near else FROM_AFAR),
        },
    }
    solver = ca.nlpsol("optimum", "ipopt", {"x": program.vector, "f": program.cost, "g": program.constraints}, options)
    _kept_alive[:] = [solver]
    low, high = program.variable_bounds()
    found = solver(x0=program.packed(guess), lbx=low, ubx=high, lbg=bounds[0], ubg=bounds[1])
    status = solver.stats()
    off = _excess(np.asarray(found["g"]).ravel(), bounds)
    is_course = status["return_status"] == OUT_OF_ITERATIONS and off <= FEASIBLE
    if not (status["success"] or is_course):
        reason = status["return_status"].replace("_", " ").lower()
        raise UnsolvedError(f"{reason} after {status['iter_count']} iterations, constraints {off:.0e} off")
    cost = float(found["f"]) * problem.cost_scale
    return Solved(program.unpacked(np.asarray(found["x"]).ravel()), cost, int(status["iter_count"]))
