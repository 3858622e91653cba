"""Textbook hybrid systems: jumps as data, solutions on hybrid time, and the systems themselves."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, NamedTuple, TypeVar

import numpy as np

from sitl import Array, SitlError, ZenoError
from sitl.supervisor.table import diagram
from sitl.tools.plotting import mermaid

# Jumps as data: the discrete half of a hybrid system.
#
# A table gives each mode its ordered jumps. A jump has a jump set (``is_due``), a jump map (``target`` and ``after``)
# and a name. The flow between jumps is :func:`solve`.

Mode = TypeVar("Mode", bound=Hashable)


def unchanged(x: Any) -> Any:  # noqa: ANN401 - a table's states have any type
    """The jump map of a jump that changes only the mode."""
    return x


class GuardedJump(NamedTuple):
    """One row of a table."""

    name: str
    is_due: Callable[[Any], bool]  # whether the state is in the jump set
    target: Any  # mode after the jump
    reason: Any = None  # recorded with the jump
    after: Callable[[Any], Any] = unchanged  # state after the jump


JumpTable = Mapping[Mode, tuple[GuardedJump, ...]]


def enabled(table: JumpTable[Mode], mode: Mode, x: object) -> GuardedJump | None:
    """The jump that ``x`` takes in ``mode``: the first whose guard holds; None in the flow set.

    Jumps have priority over flow, and earlier jumps over later ones, so that solutions are unique.
    """
    return next((jump for jump in table[mode] if jump.is_due(x)), None)


def settle(table: JumpTable[Mode], mode: Mode, x: object) -> tuple[Mode, list[GuardedJump]]:
    """Take jumps and apply their resets, at one instant, until no jump is enabled.

    Args:
        table: Ordered jumps of every mode.
        mode: To begin in.
        x: The state that the guards see.

    Returns:
        The mode reached and the jumps taken, in order.

    Raises:
        ZenoError: If there are more jumps than modes: then some mode came twice.
    """
    taken: list[GuardedJump] = []
    while (jump := enabled(table, mode, x)) is not None:
        taken.append(jump)
        mode, x = jump.target, jump.after(x)
        if len(taken) > len(table):
            raise ZenoError(f"jumps without end: {' -> '.join(j.name for j in taken)} at {x}")
    return mode, taken


# Hybrid systems and their solutions on hybrid time (t, j), after Goebel, Sanfelice and Teel.
#
# .. math:: \dot x = f(x) \;\; (x \in C), \qquad x^+ = g(x) \;\; (x \in D)
#
# The four data are tables keyed by mode: the flow maps f, the flow sets C, and the jumps, which hold D (guards)
# and g (resets and targets). Where a state is in both C and D it jumps; where it is in neither the solution ends.
# Jumps that crowd towards a finite time (Zeno) end it too, with that time estimated: no run is endless.


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


# The textbook hybrid systems of the report's training chapter, and the classic Zeno one.
#
# Each is a table of data for :func:`solve`, with closed forms of its solutions,
# so that every run can be checked.


G = 9.81  # [m/s2]
MAX_JUMPS_SHOWN = 5  # jumps listed at each end of a summary


@dataclass(frozen=True)
class TextbookSystem:
    """A system with a run that shows what it is known for."""

    description: str
    variables: tuple[str, ...]  # of the state, with units
    system: HybridSystem
    mode: str
    x0: tuple[float, ...]
    horizon: float  # [s]
    facts: Callable[[Arc], list[str]]  # closed forms beside this solution
    dt: float = 0.01  # step of the solution [s]

    def run(self) -> Arc:
        """Solve the default run."""
        return solve(self.system, self.mode, self.x0, self.horizon, dt=self.dt)

    def summary(self) -> str:
        """The default run as text: its jumps on hybrid time, how it ended, and the closed forms."""
        arc = self.run()
        lines = [self.description, f"state: {', '.join(self.variables)}", ""]
        lines += _jump_lines(arc) if arc.events else ["no jumps: it only flows"]
        t, j, x = arc.t[-1], arc.j[-1], _numbers(arc.x[-1])
        lines += ["", f"ends at (t, j) = ({t:.6f}, {j}) with x = {x}: {arc.end.value}"]
        if arc.zeno_time is not None:
            lines.append(f"infinitely many jumps before t = {arc.zeno_time:.6f} s")
        lines += self.facts(arc)
        if arc.events:
            lines += ["", mermaid(self.system.jumps)]
        return "\n".join(lines)


def systems() -> dict[str, TextbookSystem]:
    """The systems by name."""
    return {
        "pendulum": pendulum(),
        "pendulum-wall": pendulum_wall(),
        "water-tanks": water_tanks(),
        "room-heating": room_heating(),
        "bouncing-ball": bouncing_ball(),
    }


def pendulum(length: float = 1.0, damping: float = 0.0) -> TextbookSystem:
    """A pendulum that only flows: theta'' = -(g / length) sin(theta) - damping theta'."""

    def facts(arc: Arc) -> list[str]:
        energy = pendulum_energy(arc.x, length)
        return [f"energy per mass {energy[0]:.6f} J/kg at the start, {energy[-1]:.6f} J/kg at the end"]

    return TextbookSystem(
        description="A pendulum: no jump set, so its hybrid time is ordinary time",
        variables=("angle [rad]", "rate [rad/s]"),
        system=HybridSystem({"swing": _swing(length, damping)}, {"swing": ()}),
        mode="swing",
        x0=(1.0, 0.0),
        horizon=10.0,
        facts=facts,
    )


def pendulum_wall(length: float = 1.0, wall: float = 0.0, restitution: float = 0.8) -> TextbookSystem:
    """A pendulum that swings above a wall at an angle and bounces off it.

    Args:
        length: [m]
        wall: Angle of the wall, the pendulum stays above it [rad]. Gravity presses it onto a wall above zero,
            and the impacts accumulate.
        restitution: Share of the rate that an impact gives back, 0..1.
    """
    impact = GuardedJump(
        "impact",
        lambda x: bool(x[0] <= wall and x[1] < 0.0),
        "swing",
        "the wall is met from above",
        lambda x: np.array((wall, -restitution * x[1])),
    )

    def facts(arc: Arc) -> list[str]:
        energy = pendulum_energy(arc.x, length)
        return [
            f"energy per mass {energy[0]:.6f} J/kg at the start, {energy[-1]:.6f} J/kg at the end",
            f"each impact keeps {restitution**2:.2f} of the kinetic energy",
        ]

    return TextbookSystem(
        description="A pendulum against a wall: impacts reverse the rate and take energy",
        variables=("angle [rad]", "rate [rad/s]"),
        system=HybridSystem(
            {"swing": _swing(length, 0.0)}, {"swing": (impact,)}, {"swing": lambda x: bool(x[0] >= wall or x[1] >= 0.0)}
        ),
        mode="swing",
        x0=(1.0, 0.0),
        horizon=10.0,
        facts=facts,
    )


def pendulum_energy(x: Array, length: float) -> Array:
    """Energy per mass of (angle, rate) rows [J/kg], zero hanging at rest."""
    return np.asarray(0.5 * (length * x[..., 1]) ** 2 + G * length * (1.0 - np.cos(x[..., 0])))


def water_tanks(inflow: float = 0.75, outflows: tuple[float, float] = (0.5, 0.5)) -> TextbookSystem:
    """Two draining tanks and one hose that moves to the tank whose level falls to its mark.

    Args:
        inflow: Of the hose [m/s of level].
        outflows: Of the tanks [m/s of level]. With max(outflows) < inflow < sum(outflows) both levels
            fall, and the hose switches infinitely often before both are at their marks.
    """
    drain = np.array(outflows)

    def filling(tank: int) -> Callable[[Array], Array]:
        rate = -drain
        rate[tank] += inflow
        return lambda _: rate

    def low(tank: int) -> Callable[[Array], bool]:
        return lambda x: bool(x[tank] <= 0.0)

    x0 = (1.0, 1.0)
    expected = water_tanks_zeno_time(x0, inflow, outflows)

    def facts(_: Arc) -> list[str]:
        if math.isinf(expected):
            return ["the inflow covers the outflows: not Zeno"]
        return [f"closed form of the Zeno time: {expected:.6f} s"]

    return TextbookSystem(
        description="Two water tanks under one hose: Zeno when less flows in than out",
        variables=("level above the mark of tank 1 [m]", "of tank 2 [m]"),
        system=HybridSystem(
            {"fill_1": filling(0), "fill_2": filling(1)},
            {
                "fill_1": (GuardedJump("tank_2_low", low(1), "fill_2", "tank 2 is down to its mark"),),
                "fill_2": (GuardedJump("tank_1_low", low(0), "fill_1", "tank 1 is down to its mark"),),
            },
        ),
        mode="fill_1",
        x0=x0,
        horizon=20.0,
        facts=facts,
    )


def water_tanks_zeno_time(x0: tuple[float, float], inflow: float, outflows: tuple[float, float]) -> float:
    """Time at which both levels are at their marks: their sum over the net outflow [s]."""
    loss = sum(outflows) - inflow
    return sum(x0) / loss if loss > 0.0 else math.inf


def room_heating(
    outside: float = 5.0, heater: float = 25.0, band: tuple[float, float] = (19.0, 21.0), tau: float = 600.0
) -> TextbookSystem:
    """A room losing heat to the outside, and a heater with hysteresis.

    Args:
        outside: Temperature outside [deg C].
        heater: How much warmer than outside the heater would make the room in the end [K].
        band: Heater on at or below, off at or above [deg C].
        tau: Time constant of the room [s].
    """
    cold, warm = band

    def towards(end: float) -> Callable[[Array], Array]:
        return lambda x: (end - x) / tau

    def facts(arc: Arc) -> list[str]:
        period = room_heating_period(outside, heater, band, tau)
        if len(arc.events) < 3:
            return [f"no full cycle; closed form of the period {period:.3f} s"]
        lasted = arc.events[-1].t - arc.events[-3].t
        return [f"period {lasted:.3f} s; closed form {period:.3f} s"]

    return TextbookSystem(
        description="Room heating: a thermostat whose hysteresis keeps jumps apart",
        variables=("temperature [deg C]",),
        system=HybridSystem(
            {"off": towards(outside), "on": towards(outside + heater)},
            {
                "off": (GuardedJump("too_cold", lambda x: bool(x[0] <= cold), "on", f"{cold:g} deg C or less"),),
                "on": (GuardedJump("warm_enough", lambda x: bool(x[0] >= warm), "off", f"{warm:g} deg C or more"),),
            },
        ),
        mode="off",
        x0=(20.0,),
        horizon=3600.0,
        facts=facts,
        dt=tau / 100.0,
    )


def room_heating_period(outside: float, heater: float, band: tuple[float, float], tau: float) -> float:
    """Time of one cooling and one heating [s]."""
    cold, warm = band
    hot = outside + heater
    return tau * (math.log((warm - outside) / (cold - outside)) + math.log((hot - cold) / (hot - warm)))


def bouncing_ball(height: float = 10.0, restitution: float = 0.8) -> TextbookSystem:
    """A ball dropped at rest on the ground, which it meets infinitely often in a finite time.

    Args:
        height: Initial height [m].
        restitution: Share of the speed that a bounce gives back, 0..1.
    """
    bounce = GuardedJump(
        "bounce",
        lambda x: bool(x[0] <= 0.0 and x[1] < 0.0),
        "flight",
        "the ground is met from above",
        lambda x: np.array((0.0, -restitution * x[1])),
    )
    expected = bouncing_ball_zeno_time(height, restitution)
    return TextbookSystem(
        description="A bouncing ball: the classic Zeno solution",
        variables=("height [m]", "speed upwards [m/s]"),
        system=HybridSystem(
            {"flight": lambda x: np.array((x[1], -G))},
            {"flight": (bounce,)},
            {"flight": lambda x: bool(x[0] >= 0.0 or x[1] >= 0.0)},
        ),
        mode="flight",
        x0=(height, 0.0),
        horizon=20.0,
        facts=lambda _: [f"closed form of the Zeno time: {expected:.6f} s"],
    )


def bouncing_ball_zeno_time(height: float, restitution: float) -> float:
    """Fall time times (1 + e) / (1 - e) [s]; infinite for a ball that loses nothing."""
    if restitution >= 1.0:
        return math.inf
    return math.sqrt(2.0 * height / G) * (1.0 + restitution) / (1.0 - restitution)


def _swing(length: float, damping: float) -> Callable[[Array], Array]:
    return lambda x: np.array((x[1], -G / length * math.sin(x[0]) - damping * x[1]))


def _jump_lines(arc: Arc) -> list[str]:
    lines = [f"{'t [s]':>12} {'j':>4}  jump"]
    for number, event in enumerate(arc.events):
        if MAX_JUMPS_SHOWN <= number < len(arc.events) - MAX_JUMPS_SHOWN:
            if number == MAX_JUMPS_SHOWN:
                lines.append(f"{'...':>12} {'':>4}  {len(arc.events) - 2 * MAX_JUMPS_SHOWN} more")
            continue
        change = f"x = {_numbers(event.before)}"
        if not np.array_equal(event.before, event.after):
            change += f" -> {_numbers(event.after)}"
        lines.append(f"{event.t:12.6f} {event.j:4d}  {event.name} ({event.reason}): {event.target}, {change}")
    return lines


def _numbers(x: Any) -> str:  # noqa: ANN401 - any sequence of numbers
    return "(" + ", ".join(f"{value:.4g}" for value in x) + ")"


SUPERVISOR = "supervisor"


def study_hybrid(args: argparse.Namespace) -> int:
    """List the systems or run one and print its solution on hybrid time (t, j)."""
    if args.name == SUPERVISOR:
        print(diagram())
        return 0

    known = systems()
    if args.name is None:
        for name, system in known.items():
            print(f"{name:<16}{system.description}")
        print(f"{SUPERVISOR:<16}The vehicle's own table of jumps, as a Mermaid diagram")
        return 0
    if args.name not in known:
        raise SitlError(f"no system {args.name!r}: there are {', '.join((*known, SUPERVISOR))}")
    print(known[args.name].summary())
    return 0
