"""A bound: the best of two guesses on two meshes, held against the plant that flies, and kept."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import numpy.typing as npt

from sitl import Array
from sitl.lab.identification.replay import ActuatorHistory, shots
from sitl.lab.optimal.collocation import (
    Course,
    Progress,
    Solved,
    UnsolvedError,
    crowded_mesh,
    ignore_iterations,
    print_iterations,
    solve,
)
from sitl.lab.optimal.leg_problem import (
    BODY,
    MANNERS,
    MORE_MANNERS,
    PLANT_STATES,
    LegProblem,
    Manner,
    actuator_limits,
    guess,
    leg_problem,
    plant_function,
)
from sitl.lab.optimal.question import AnswerFolder, Question

SHOT_STEP = 1e-3  # of the plant's flight [s]
SHOT_STEPS = 50  # of it between two looks at the defects
OPEN_LOOP = (0.5, 1.0, 2.0)  # after which the flight is compared [s]
MESH_INTERVALS = {False: (40, 80, 120, 180, 270), True: (20, 30, 44, 66, 99)}  # of meshes in the plane and in space
AGREEMENT = 0.01  # of costs, relative
SAMPLES = 400  # kept of a course


class Gap(NamedTuple):
    """Distance of two states, or the greatest of many."""

    position: float  # [m]
    velocity: float  # [m/s]
    attitude: float  # [rad]
    rates: float  # [rad/s]


class Try(NamedTuple):
    """One solve."""

    guess: str
    intervals: int
    cost: float  # infinite: not solved
    iterations: int
    reason: str  # why it is not solved, empty if it is


class Bound(NamedTuple):
    """The answer to a question."""

    question: Question
    time: float  # [s]
    energy: float  # as the airframe's account counts it [J]
    tries: tuple[Try, ...]
    defects: Gap  # greatest over all stretches of 50 ms that the plant flies from the course
    open_loop: tuple[tuple[float, Gap], ...]  # after some seconds from the start without any correction [s]
    times: Array  # of the samples below, (k,) [s]
    plant: Array  # states of the plant, (k, 17)
    power: Array  # (k,) [W]

    @property
    def refined(self) -> list[Try]:
        """Solves on the finer meshes: the first ones only lead there."""
        return [one for one in self.tries if math.isfinite(one.cost) and one.intervals > self.tries[0].intervals]

    @property
    def guesses_apart(self) -> float:
        """Cost of the second best guess over the best one's on the mesh that all were refined on; NaN without one."""
        first = min((one.intervals for one in self.refined), default=0)
        return _best_two_apart([one.cost for one in self.refined if one.intervals == first])

    @property
    def meshes_apart(self) -> float:
        """Relative difference of the best guess's costs on the two finest meshes; NaN without two."""
        if not self.refined:
            return math.nan
        last = self.refined[-1]
        before = [one for one in self.refined if one.guess == last.guess and one.intervals < last.intervals]
        return abs(before[-1].cost / last.cost - 1.0) if before else math.nan

    @property
    def agrees(self) -> bool:
        """Whether two guesses and two meshes agree within 1 %."""
        return self.guesses_apart <= AGREEMENT and self.meshes_apart <= AGREEMENT

    def as_table(self) -> dict[str, Any]:
        """The answer as JSON holds it, to be read by :func:`bound_of`."""
        table = self._asdict() | {name: getattr(self, name).tolist() for name in ("times", "plant", "power")}
        return table | {"question": None, "tries": [one._asdict() for one in self.tries]}


def bound_of(question: Question, table: dict[str, Any]) -> Bound:
    """The answer that :meth:`Bound.as_table` made.

    Raises:
        KeyError: The table is no such answer; TypeError or ValueError likewise.
    """
    return Bound(
        question=question,
        time=float(table["time"]),
        energy=float(table["energy"]),
        tries=tuple(Try(**one) for one in table["tries"]),
        defects=Gap(*table["defects"]),
        open_loop=tuple((float(after), Gap(*gap)) for after, gap in table["open_loop"]),
        times=np.array(table["times"]),
        plant=np.array(table["plant"]),
        power=np.array(table["power"]),
    )


def find_bound(question: Question, folder: AnswerFolder | None = None, *, quiet: bool = False) -> Bound:
    """The bound of a question, from the folder if it was answered before.

    Args:
        question: What is asked.
        folder: Of kept answers; the user's by default.
        quiet: Whether iterations are not shown on the standard error.

    Raises:
        UnsolvedError: No guess leads to a solution; the message says why for each.
        SitlError: The question has no answer, or the answer cannot be kept.
    """
    question.check()
    folder = folder or AnswerFolder()
    kept = folder.find(question)
    if kept is not None:
        try:
            return bound_of(question, kept)
        except (KeyError, TypeError, ValueError):
            pass  # a damaged file is answered anew
    found = _solved(leg_problem(question), quiet=quiet)
    folder.keep(question, found.as_table())
    return found


def _solved(leg: LegProblem, *, quiet: bool) -> Bound:
    title = f"{leg.question.title()}, {leg.question.goal()}"
    coarse, fine, *finer = MESH_INTERVALS[leg.layout.size == PLANT_STATES]
    tell = ignore_iterations if quiet else print_iterations(title)
    tries: list[Try] = []
    found: list[tuple[Solved, Manner]] = []
    for manner in MANNERS + MORE_MANNERS:
        if manner in MORE_MANNERS and _best_two_apart([one.cost for one, _ in found]) <= AGREEMENT:
            break
        rough = _tried(leg, guess(leg, manner), (manner.name, coarse), tries, tell)
        if rough is not None:
            found += [(one, manner) for one in [_refined(leg, rough, (manner.name, fine), tries, tell)] if one]
    if not found:
        reasons = "; ".join(f"guess {one.guess!r}: {one.reason}" for one in tries if one.reason)
        raise UnsolvedError(f"no optimum found for {title}: {reasons}")
    best, manner = min(found, key=lambda pair: pair[0].cost)
    for intervals in finer:
        better = _refined(leg, best, (manner.name, intervals), tries, tell)
        is_fine = better is not None and abs(better.cost / best.cost - 1.0) <= AGREEMENT
        best = better or best
        if is_fine:
            break
    if not quiet:
        print(f"\r{'':<78}\r", end="", file=sys.stderr, flush=True)
    return _flown(leg, best.course, tuple(tries))


def _best_two_apart(costs: Sequence[float]) -> float:
    """Relative difference of the two least costs; NaN of fewer."""
    best = sorted(costs)[:2]
    return best[1] / best[0] - 1.0 if len(best) > 1 else math.nan


def _refined(leg: LegProblem, one: Solved, name: tuple[str, int], tries: list[Try], tell: Progress) -> Solved | None:
    """The solution on more intervals, begun near it, or where that leads nowhere, from farther off."""
    for is_near in (True, False):
        better = _tried(leg, one.course, name, tries, tell, is_near=is_near)
        if better is not None:
            return better
    return None


def _tried(
    leg: LegProblem, begin: Course, name: tuple[str, int], tries: list[Try], tell: Progress, *, is_near: bool = False
) -> Solved | None:
    label, intervals = name
    try:
        one = solve(leg.problem, crowded_mesh(intervals), begin, tell, is_near=is_near)
    except UnsolvedError as error:
        tries.append(Try(label, intervals, math.inf, 0, str(error)))
        return None
    tries.append(Try(label, intervals, one.cost, one.iterations, ""))
    return one


def _plants(leg: LegProblem, course: Course, times: Array) -> Array:
    """States of the plant at times (k,), (k, 17)."""
    states, _ = course.at(times)
    symbol = ca.SX.sym("states", leg.layout.size)
    spread = ca.Function("spread", [symbol], [ca.densify(leg.layout.spread(symbol))])
    return np.ascontiguousarray(np.asarray(spread.map(len(times))(states.T)).T)


def _commands(leg: LegProblem, actuators: Array) -> Array:
    """Commands that bring the actuators from each step's position to the next, (k, 4) of (k + 1, 4)."""
    lag = actuator_limits(leg.airframe, 0.0).lag
    gained = 1.0 - np.exp(-SHOT_STEP / np.maximum(lag, 1e-9))
    return np.ascontiguousarray(actuators[:-1] + np.diff(actuators, axis=0) / gained)


def _flown(leg: LegProblem, course: Course, tries: tuple[Try, ...]) -> Bound:
    """The course beside flights of the compiled plant from it, and its energy."""
    steps = int(course.time / SHOT_STEP)
    plants = _plants(leg, course, SHOT_STEP * np.arange(steps + 1, dtype=float))
    actuators = np.ascontiguousarray(plants[:-1, BODY:])
    history = ActuatorHistory(_commands(leg, plants[:, BODY:]), actuators, SHOT_STEP)
    wind = np.array(leg.question.wind)

    def end_of(first: npt.NDArray[np.int64], length: int) -> Gap:
        begins = np.ascontiguousarray(plants[first, :BODY])
        ends = shots(begins, first, length, history, wind, leg.airframe)
        return _gap(ends, plants[first + length, :BODY])

    size = min(SHOT_STEPS, steps)
    defects = end_of(np.arange(0, steps - size + 1, size, dtype=np.int64), size)
    open_loop = tuple(
        (t, end_of(np.zeros(1, np.int64), round(t / SHOT_STEP))) for t in OPEN_LOOP if t <= steps * SHOT_STEP
    )
    samples = np.linspace(0.0, course.time, SAMPLES)
    sampled = _plants(leg, course, samples)
    power = _powers(leg, sampled)
    fine_power = _powers(leg, plants)
    energy = float(np.trapezoid(fine_power, dx=SHOT_STEP) + fine_power[-1] * (course.time - steps * SHOT_STEP))
    return Bound(leg.question, course.time, energy, tries, defects, open_loop, samples, sampled, power)


def _powers(leg: LegProblem, plants: Array) -> Array:
    _, power = plant_function(leg.airframe, leg.question.wind).map(len(plants))(plants.T)
    return np.asarray(power).ravel()


def _gap(ends: Array, wanted: Array) -> Gap:
    away = ends - wanted
    unit = wanted[:, 6:10] / np.linalg.norm(wanted[:, 6:10], axis=1, keepdims=True)
    cosine = np.clip(np.abs(np.sum(ends[:, 6:10] * unit, axis=1)), 0.0, 1.0)
    return Gap(
        position=float(np.linalg.norm(away[:, :3], axis=1).max()),
        velocity=float(np.linalg.norm(away[:, 3:6], axis=1).max()),
        attitude=float(2.0 * np.arccos(cosine).max()),
        rates=float(np.linalg.norm(away[:, 10:13], axis=1).max()),
    )


def as_lines(bound: Bound) -> list[str]:
    """The answer with its checks, in words."""
    guesses, meshes = (
        f"{apart:.2%}" if math.isfinite(apart) else "not known" for apart in (bound.guesses_apart, bound.meshes_apart)
    )
    lines = [
        f"{bound.question.title()}, {bound.question.goal()}: {bound.time:.2f} s, {bound.energy:.0f} J",
        *(
            f"  guess {one.guess}, {one.intervals} intervals: "
            + (one.reason or f"cost {one.cost:.4f} in {one.iterations} iterations")
            for one in bound.tries
        ),
        f"  apart: two guesses {guesses}, two meshes {meshes}{'' if bound.agrees else ' (NOT within 1 %)'}",
        f"  the plant after 50 ms from anywhere on it: {_in_words(bound.defects)} away at most",
    ]
    return lines + [f"  flown without correction for {t:g} s: {_in_words(gap)} away" for t, gap in bound.open_loop]


def _in_words(gap: Gap) -> str:
    return (
        f"{gap.position:.1g} m, {gap.velocity:.1g} m/s, {math.degrees(gap.attitude):.1g} deg, "
        f"{math.degrees(gap.rates):.1g} deg/s"
    )
