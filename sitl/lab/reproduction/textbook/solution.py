r"""Hybrid systems and their solutions on hybrid time (t, j), after Goebel, Sanfelice and Teel.

.. math:: \dot x = f(x) \;\; (x \in C), \qquad x^+ = g(x) \;\; (x \in D)

The four data are tables keyed by mode: the flow maps f, the flow sets C, and the jumps, which hold D (guards)
and g (resets and targets). Where a state is in both C and D it jumps; where it is in neither the solution ends.
Jumps that crowd towards a finite time (Zeno) end it too, with that time estimated: no run is endless.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, NamedTuple

import numpy as np

from sitl import Array, SitlError
from sitl.lab.reproduction.textbook.automaton import GuardedJump, enabled

CYCLE = 6  # jumps compared with as many before them: a multiple of rhythms of one, two, three or six jumps
RESOLUTION = 1e-14  # of a jump time within its step [s]
MAX_JUMPS_AT_ONCE = 20  # jumps at one instant; more count as endless


class HybridError(SitlError):
    """A hybrid system is not well posed: its tables do not fit together or its flow stops being finite."""


@dataclass(frozen=True)
class HybridSystem:
    """The data (C, f, D, g) of a hybrid system."""

    flows: Mapping[Any, Callable[[Array], Array]]  # mode -> x'
    jumps: Mapping[Any, tuple[GuardedJump, ...]]
    flow_sets: Mapping[Any, Callable[[Array], bool]] = field(default_factory=dict)  # mode -> x in C; absent: all

    def __post_init__(self) -> None:
        modes = self.flows.keys()
        if self.jumps.keys() != modes or not self.flow_sets.keys() <= modes:
            raise HybridError(f"modes that flow {list(modes)} are not those that jump {list(self.jumps)}")
        for mode, jumps in self.jumps.items():
            for jump in jumps:
                if jump.target not in modes:
                    raise HybridError(f"jump {jump.name!r} of {mode} leads to an unknown mode {jump.target}")

    def may_flow(self, mode: Hashable, x: Array) -> bool:
        """Whether x is in the flow set and not in the jump set, which has priority."""
        inside = self.flow_sets.get(mode)
        return (inside is None or bool(inside(x))) and enabled(self.jumps, mode, x) is None


class SolutionEnd(Enum):
    """The reason why a solution ends."""

    HORIZON = "the time asked for is reached"
    JUMPS = "the number of jumps allowed is reached"
    ZENO = "jump times accumulate (Zeno)"
    STUCK = "the state can neither flow nor jump"


class JumpEvent(NamedTuple):
    """One jump of a solution."""

    t: float  # [s]
    j: int  # after the jump
    name: str
    reason: Any
    source: Any
    target: Any
    before: Array
    after: Array


@dataclass(frozen=True)
class Arc:
    """A solution: rows are points of its hybrid time domain, in order; a jump adds a row at the same t."""

    t: Array  # (n,) [s]
    j: Array  # (n,)
    x: Array  # (n, state)
    mode: tuple[Any, ...]  # (n,)
    events: tuple[JumpEvent, ...]
    end: SolutionEnd
    zeno_time: float | None  # estimate of the accumulation time, if the solution is Zeno [s]


def solve(
    system: HybridSystem, mode: Hashable, x: Sequence[float], horizon: float, *, dt: float = 0.01, max_jumps: int = 1000
) -> Arc:
    """The solution from (mode, x) up to hybrid time (horizon, max_jumps).

    Flow is integrated by Runge-Kutta 4; a jump is located within its step by bisection on the flow, so a visit
    to the jump set shorter than ``dt`` can be missed.

    Args:
        system: The data.
        mode: Initial mode.
        x: Initial state.
        horizon: SolutionEnd of ordinary time [s].
        dt: Longest step [s].
        max_jumps: Bound on j.

    Raises:
        HybridError: If dt is not positive, the mode is unknown or the state stops being finite.
    """
    if dt <= 0.0 or mode not in system.flows:
        raise HybridError(f"cannot start in mode {mode} with step {dt}: modes are {list(system.flows)}")
    run = _Run(system, mode, np.array(x, dtype=float), horizon, dt, max_jumps)
    while (end := run.jump_or_end()) is None:
        run.flow()
    return run.arc(end)


def accumulation(times: Sequence[float]) -> float | None:
    """Time at which jumps that keep crowding by the same ratio would be infinitely many [s].

    Compares the time the last ``CYCLE`` jumps took with that of the ``CYCLE`` before them; exact for geometric
    sequences whose rhythm divides ``CYCLE``. None if there are too few jumps or they do not crowd.
    """
    if len(times) <= 2 * CYCLE:
        return None
    recent, former = times[-1] - times[-1 - CYCLE], times[-1 - CYCLE] - times[-1 - 2 * CYCLE]
    if recent >= former:
        return None
    return times[-1] + recent * recent / (former - recent)


class _Run:
    """A solution while it is computed."""

    ZENO_TAIL = 1e-6  # a solution this near to its accumulation time counts as Zeno [s]

    def __init__(
        self, system: HybridSystem, mode: Hashable, x: Array, horizon: float, dt: float, max_jumps: int
    ) -> None:
        self.system, self.mode, self.x, self.t = system, mode, x, 0.0
        self.horizon, self.dt, self.max_jumps = horizon, dt, max_jumps
        self.events: list[JumpEvent] = []
        self.zeno_time: float | None = None
        self._rows: list[tuple[float, int, Array, Hashable]] = []
        self._record()

    def jump_or_end(self) -> SolutionEnd | None:
        """Take every jump that is due now; why the solution ends, or None if it flows on."""
        instant = len(self.events)
        while (jump := enabled(self.system.jumps, self.mode, self.x)) is not None:
            if len(self.events) == self.max_jumps:
                return SolutionEnd.JUMPS
            self._take(jump)
            self.zeno_time = self.t if len(self.events) - instant > MAX_JUMPS_AT_ONCE else self._crowding()
            if self.zeno_time is not None:
                return SolutionEnd.ZENO
        if self.t >= self.horizon:
            return SolutionEnd.HORIZON
        return None if self.system.may_flow(self.mode, self.x) else SolutionEnd.STUCK

    def flow(self) -> None:
        """Flow to the next multiple of dt, or up to the jump that falls before it."""
        grid = self.dt * (np.floor(self.t / self.dt + 1e-9) + 1.0)
        step = min(float(grid), self.horizon) - self.t
        x = self._flowed(step)
        if not np.isfinite(x).all():
            raise HybridError(f"the flow of {self.mode} stops being finite after t = {self.t} s at {self.x}")
        if not self.system.may_flow(self.mode, x):
            inside = 0.0
            while step - inside > RESOLUTION and inside < (middle := 0.5 * (inside + step)) < step:
                if self.system.may_flow(self.mode, self._flowed(middle)):
                    inside = middle
                else:
                    step = middle
            x = self._flowed(step)
        self.t, self.x = self.t + step, x
        self._record()

    def arc(self, end: SolutionEnd) -> Arc:
        """The solution so far."""
        t, j, x, mode = zip(*self._rows, strict=True)
        return Arc(np.array(t), np.array(j), np.array(x), mode, tuple(self.events), end, self.zeno_time)

    def _crowding(self) -> float | None:
        estimate = accumulation([event.t for event in self.events[-2 * CYCLE - 1 :]])
        return estimate if estimate is not None and estimate - self.t < self.ZENO_TAIL else None

    def _take(self, jump: GuardedJump) -> None:
        after = np.array(jump.after(self.x), dtype=float)
        number = len(self.events) + 1
        self.events.append(JumpEvent(self.t, number, jump.name, jump.reason, self.mode, jump.target, self.x, after))
        self.mode, self.x = jump.target, after
        self._record()

    def _record(self) -> None:
        self._rows.append((self.t, len(self.events), self.x, self.mode))

    def _flowed(self, h: float) -> Array:
        f, x = self.system.flows[self.mode], self.x
        k1 = f(x)
        k2 = f(x + 0.5 * h * k1)
        k3 = f(x + 0.5 * h * k2)
        k4 = f(x + h * k3)
        return np.asarray(x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4))
