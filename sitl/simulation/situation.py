"""Answers to autopilot and telemetry about a flight, worked out of the estimate that the laws see."""

from __future__ import annotations

import inspect
import math

from protocol.dialect.vocabulary import Law, Regime
from sitl.compiled import entry
from sitl.control import indi_guidance, reference
from sitl.control.estimate import Estimate
from sitl.control.forward_flight import forward_guidance
from sitl.control.forward_flight.forward_guidance import GuidanceGains
from sitl.control.reference import LEG, MIN_AHEAD, Reference
from sitl.model.quaternions import x_axis
from sitl.simulation.simulation import Simulation
from sitl.supervisor import guards
from sitl.supervisor.guards import LYAPUNOV_PATIENCE, Guard

ON_LEG = frozenset({Law.FORWARD_LINE_OF_SIGHT, Law.FORWARD_LINEAR})
HOVER_SPEED_SHARE = 1.3  # of the speed limit of the hover: faster is still a stop [-]
GOVERNED = frozenset({Law.HOVER_ZERO_MOMENT, Law.ALIGN})
REGIMES_ON_PATH = frozenset({Regime.FRONT_TRANSITION, Regime.FORWARD, Regime.BACK_TRANSITION})


def regime(simulation: Simulation) -> Regime:
    """The regime of flight: that of the law in force or, under INDI, which flies in all, what the vehicle does."""
    if simulation.law is not Law.INDI:
        return simulation.law.regime
    e, r = simulation.estimate, simulation.reference
    if r.forward and not _stops(simulation):
        return Regime.FORWARD if guards.wing_borne.test(e, r) else Regime.FRONT_TRANSITION
    return Regime.UPRIGHT if _hovers(e, r) else Regime.BACK_TRANSITION


def _hovers(e: Estimate, r: Reference) -> bool:
    """Whether an estimate is upright, and over the ground hardly faster than a reference's hover."""
    slow = math.hypot(e.velocity.x, e.velocity.y) < max(guards.TURNING_SPEED, HOVER_SPEED_SHARE * r.speed)
    return slow and x_axis(e.attitude).z > guards.TURNING_UPRIGHT


def _stops(simulation: Simulation) -> bool:
    """Whether INDI has come so near to the end of the path, or so fast, that this is what limits its speed."""
    p, v, path = simulation.estimate.position, simulation.estimate.velocity, simulation.reference.path
    if path.kind != LEG or not path.stop:
        return False
    left = math.hypot(path.end.x - p.x, path.end.y - p.y)
    stopping = indi_guidance.stopping_speed(left, simulation.design.gains.indi.guidance)
    is_braking = left < MIN_AHEAD or math.hypot(v.x, v.y) > indi_guidance.FOLLOWS * stopping
    return stopping < path.airspeed and is_braking


def cross_track(simulation: Simulation) -> float:
    """Distance to the left of the path flown forward [m]; 0 in the hover."""
    if regime(simulation) not in REGIMES_ON_PATH:
        return 0.0
    return reference.cross_track(simulation.reference.path, simulation.estimate.position)


def hovers_again(simulation: Simulation) -> bool:
    """Whether it already hovers but has not yet left TO_HOVER, which may wait for the wind to drop.

    After a while no V is asked for any more: it is that of another law, and a wind may hold it up for ever.
    """
    e, known = simulation.estimate, simulation.design.thresholds
    if simulation.law is not Law.TO_HOVER or not guards.standing.test(e):
        return False
    enough = known.v_settled if guards.wind_calm.test(e) else known.v_waited
    return simulation.law_time >= LYAPUNOV_PATIENCE or simulation.v_hover < enough


@entry
def _braking(speed: float, along: float, across: float, gains: GuidanceGains) -> float:
    return forward_guidance.stopping_distance(speed, along, across, gains)


def stopping_distance(simulation: Simulation) -> float:
    """Distance over the ground that braking from the present velocity takes [m]."""
    e = simulation.estimate
    speed = math.hypot(e.velocity.x, e.velocity.y)
    if simulation.law is Law.INDI:
        return indi_guidance.stopping_distance(speed, simulation.design.gains.indi.guidance)
    ux, uy = (e.velocity.x / speed, e.velocity.y / speed) if speed > 0.1 else (1.0, 0.0)
    along, across = e.wind.x * ux + e.wind.y * uy, e.wind.x * uy - e.wind.y * ux
    return _braking(speed, along, across, simulation.design.gains.line_of_sight.guidance)


def v_forward(simulation: Simulation) -> float | None:
    """V of the linear forward law about the leg that is flown; None where there is none."""
    on_leg = simulation.law in ON_LEG and simulation.reference.path.kind == LEG
    return simulation.diagnostics.v_forward if on_leg else None


def v_attitude(simulation: Simulation) -> float | None:
    """V of the attitude law [rad2]; None while it does not fly."""
    return simulation.diagnostics.v_attitude if simulation.law is Law.HOVER_ATTITUDE else None


def governor(simulation: Simulation) -> float:
    """Share of the position loop's force that the governor takes away, 0..1; 0 under laws that have none."""
    return simulation.diagnostics.governor if simulation.law in GOVERNED else 0.0


def holds(simulation: Simulation, *asked: Guard) -> bool:
    """Whether guards hold now, whatever the law in force."""
    flight = simulation.flight
    given = {
        **flight.controller._asdict(),
        **flight.controller.states._asdict(),
        **simulation.diagnostics._asdict(),
        "estimate": flight.estimate,
        "reference": simulation.reference,
        "thresholds": simulation.design.thresholds,
        "guidance": simulation.design.gains.line_of_sight.guidance,
    }
    return all(guard.test(*(given[name] for name in inspect.signature(guard.test).parameters)) for guard in asked)
