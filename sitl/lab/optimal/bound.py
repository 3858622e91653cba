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
    ControlProblem,
    Course,
    Progress,
    Solved,
    UnsolvedError,
    adapted_mesh,
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
# In the plane and in space; the last one where the others do not agree.
MESH_INTERVALS = {False: (40, 60, 90, 135, 200, 300, 450), True: (20, 30, 45, 68, 100, 150)}
MORE_PATIENCE, PATIENT_FROM = 4, 2  # times as many iterations where they do not, and the mesh they begin on
DEAR_TIME, SOME_TIME = 300.0, 30.0  # price of a second of related questions [W]
AGREEMENT = 0.01  # of costs, relative
PURSUED = 2  # guesses on the finer meshes
LATE_MESH = 3  # number of the one on which others are tried if two do not agree: mostly finer ones bring them together
FAR_BEHIND = 1.04  # over the best cost on the mesh before: not refined where two others agree
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
    def guesses_apart(self) -> float:
        """As of :func:`guesses_apart`."""
        return guesses_apart(self.tries)

    @property
    def meshes_apart(self) -> float:
        """As of :func:`meshes_apart`."""
        return meshes_apart(self.tries)

    @property
    def agrees(self) -> bool:
        """Whether two guesses and two meshes agree within 1 %."""
        return agree(self.tries)

    def as_table(self) -> dict[str, Any]:
        """The answer as JSON holds it, to be read by :func:`bound_of`."""
        table = self._asdict() | {name: getattr(self, name).tolist() for name in ("times", "plant", "power")}
        return table | {"question": None, "tries": [one._asdict() for one in self.tries]}


def guesses_apart(tries: Sequence[Try]) -> float:
    """Cost of the second best guess over the best one's on the finest mesh that two reached; NaN without one."""
    reached = [list(costs.values()) for _, costs in sorted(_finer_costs(tries).items(), reverse=True)]
    return next((_best_two_apart(costs) for costs in reached if len(costs) > 1), math.nan)


def meshes_apart(tries: Sequence[Try]) -> float:
    """Relative difference of the best costs on the two finest meshes; NaN without two."""
    best = [min(costs.values()) for _, costs in sorted(_finer_costs(tries).items())[-2:]]
    return abs(best[0] / best[1] - 1.0) if len(best) > 1 else math.nan


def agree(tries: Sequence[Try]) -> bool:
    """Whether two guesses and two meshes agree within 1 %."""
    return guesses_apart(tries) <= AGREEMENT and meshes_apart(tries) <= AGREEMENT


def _finer_costs(tries: Sequence[Try]) -> dict[int, dict[str, float]]:
    """Best costs on the finer meshes by intervals and guess: the coarsest mesh only leads there."""
    found: dict[int, dict[str, float]] = {}
    for one in tries:
        if math.isfinite(one.cost) and one.intervals > tries[0].intervals:
            costs = found.setdefault(one.intervals, {})
            costs[one.guess] = min(one.cost, costs.get(one.guess, math.inf))
    return found


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
    search = _Search(leg, ignore_iterations if quiet else print_iterations(title))
    best = search.best()
    if not quiet:
        print(f"\r{'':<78}\r", end="", file=sys.stderr, flush=True)
    if best is None:
        reasons = "; ".join(f"guess {one.guess!r}: {one.reason}" for one in search.tries if one.reason)
        raise UnsolvedError(f"no optimum found for {title}: {reasons}")
    return _flown(leg, best.course, tuple(search.tries))


def _best_two_apart(costs: Sequence[float]) -> float:
    """Relative difference of the two least costs; NaN of fewer."""
    best = sorted(costs)[:2]
    return best[1] / best[0] - 1.0 if len(best) > 1 else math.nan


class _Search:
    """Guesses solved on finer and finer meshes until the two best agree, and their meshes."""

    def __init__(self, leg: LegProblem, tell: Progress) -> None:
        self.leg, self.tell = leg, tell
        self.meshes = MESH_INTERVALS[leg.layout.size == PLANT_STATES]
        self.tries: list[Try] = []
        self.patience = 1

    def best(self) -> Solved | None:
        """The best course on the finest mesh that was needed; None if no guess leads to one."""
        found = self._begun(MANNERS)
        more = list(MORE_MANNERS)
        last = math.nan  # the best cost on the mesh before
        for mesh, intervals in enumerate(self.meshes[1:-1], 1):
            found = self._refined(found, intervals) or found
            while mesh >= LATE_MESH and more and not self._agree(found):
                found = self._with_another(found, more.pop(0), mesh)
            if self._agree(found) and abs(last / found[0][1].cost - 1.0) <= AGREEMENT:
                break
            last = found[0][1].cost if found else math.nan
            found = found[:PURSUED]
        found = found if agree(self.tries) else self._patiently(found)
        return found[0][1] if found else None

    def _patiently(self, found: list[tuple[str, Solved]]) -> list[tuple[str, Solved]]:
        """The same with more iterations, on one mesh more, and beside it from answers to related questions."""
        self.patience = MORE_PATIENCE
        found = _sorted([*found[:PURSUED], *self._related(found)])
        for intervals in self.meshes[PATIENT_FROM:]:
            found = self._refined(found[: PURSUED + 1], intervals) or found
            if agree(self.tries):
                break
        return found

    def _related(self, found: list[tuple[str, Solved]]) -> list[tuple[str, Solved | None]]:
        """Courses to this question, begun at those to easier ones."""
        begins = [one.course for _, one in found[:1]] or [guess(self.leg, manner) for manner in MANNERS]
        solved: list[tuple[str, Solved | None]] = []
        for name, question in related_questions(self.leg.question):
            problem, mesh = leg_problem(question).problem, crowded_mesh(self.meshes[1])
            easier = next(filter(None, (self._easier(problem, mesh, begin) for begin in begins)), None)
            if easier is not None:
                solved.append((name, self._tried(name, mesh, easier.course)))
        return solved

    def _easier(self, problem: ControlProblem, mesh: Array, begin: Course) -> Solved | None:
        """The solution of a related question, which is none of the tries of this one; None if it is not solved."""
        try:
            return solve(problem, mesh, begin, self.tell, patience=self.patience)
        except UnsolvedError:
            return None

    def _agree(self, found: list[tuple[str, Solved]]) -> bool:
        return _best_two_apart([one.cost for _, one in found]) <= AGREEMENT

    def _begun(self, manners: Sequence[Manner]) -> list[tuple[str, Solved]]:
        """Guesses on the coarsest mesh, the best first."""
        mesh = crowded_mesh(self.meshes[0])
        found = [(manner.name, self._tried(manner.name, mesh, guess(self.leg, manner))) for manner in manners]
        return _sorted(found)

    def _refined(self, found: list[tuple[str, Solved]], intervals: int) -> list[tuple[str, Solved]]:
        """The same on a mesh made for each, the best first; those far behind are left once two others agree."""
        better: list[tuple[str, Solved]] = []
        for name, one in found:
            if one.cost > FAR_BEHIND * found[0][1].cost and self._agree(better):
                break
            better = _sorted([*better, (name, self._finer(name, one, intervals))])
        return better

    def _with_another(self, found: list[tuple[str, Solved]], manner: Manner, mesh: int) -> list[tuple[str, Solved]]:
        """One more guess, brought as far as the others."""
        another = self._begun([manner])
        for intervals in self.meshes[1 : mesh + 1]:
            another = self._refined(another, intervals)
        return _sorted([*found, *another])

    def _finer(self, name: str, one: Solved, intervals: int) -> Solved | None:
        """The solution on more intervals, begun near it, or where that leads nowhere, from farther off."""
        mesh = adapted_mesh(one.course, intervals, self.leg.problem.scales[1])
        near = self._tried(name, mesh, one.course, is_near=True)
        return near or self._tried(name, mesh, one.course)

    def _tried(self, name: str, mesh: Array, begin: Course, *, is_near: bool = False) -> Solved | None:
        try:
            one = solve(self.leg.problem, mesh, begin, self.tell, is_near=is_near, patience=self.patience)
        except UnsolvedError as error:
            self.tries.append(Try(name, len(mesh) - 1, math.inf, 0, str(error)))
            return None
        self.tries.append(Try(name, len(mesh) - 1, one.cost, one.iterations, ""))
        return one


def related_questions(question: Question) -> list[tuple[str, Question]]:
    """Easier questions whose answers are near this one's, with names for the guesses that they make."""
    price = DEAR_TIME if math.isinf(question.time_price) else question.time_price + SOME_TIME
    related = [(f"as with {price:g} W of time", question._replace(time_price=price))]
    left = 0.5 * question.share_left
    return [*related, (f"as with {left:.0%} left", question._replace(share_left=left))] if left else related


def _sorted(found: Sequence[tuple[str, Solved | None]]) -> list[tuple[str, Solved]]:
    """Those that were solved, the best first."""
    return sorted(((name, one) for name, one in found if one is not None), key=lambda pair: pair[1].cost)


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
