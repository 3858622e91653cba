"""The textbook hybrid systems of the report's training chapter, and the classic Zeno one.

Each is a table of data for :func:`sitl.lab.reproduction.textbook.solution.solve`, with closed forms of its solutions,
so that every run can be checked.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sitl import Array
from sitl.lab.reproduction.textbook.automaton import GuardedJump
from sitl.lab.reproduction.textbook.solution import Arc, HybridSystem, solve
from sitl.tools.plotting import mermaid

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
