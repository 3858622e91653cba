"""Hover or cruise? The choice between the time and energy that a leg takes either way.

This is the report's question: to reach a point, is it better to hover or to fly forward? Both ways are predicted
(:mod:`sitl.prediction.predictor`): in the hover at the speed that the governor leaves in the wind; in forward flight
through alignment, acceleration, cruise, the climbing stop and what is left to settle. Energy is what
the airframe counts: at the propeller shafts, or from the battery.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from enum import IntEnum
from functools import lru_cache
from typing import NamedTuple

from protocol.dialect.vocabulary import DecisionReason, LegMode
from protocol.ranges import LEGS_AHEAD, MIN_FORWARD_HEIGHT
from sitl.prediction.corners import FlyingOn, Leg, flying_on
from sitl.prediction.point_mass import IMPOSSIBLE, Prediction
from sitl.prediction.predictor import Abilities, predict_forward, predict_hover

MAX_CLIMB_SLOPE, MAX_DESCENT_SLOPE = 1.0, 0.35  # of a leg in forward flight
CHANGE_SHARE = 0.1  # of a leg's energy that another way than before has to save: as much as predictions err
LATE, UNASKED, UNABLE = 1e9, 1e12, 1e15  # what being late, not as asked, or not possible counts for [J]


class Decision(NamedTuple):
    """The choice for one leg, with both predictions."""

    leg: Leg
    hover: Prediction
    forward: Prediction
    leg_mode: LegMode
    reason: DecisionReason


def forbidden(leg: Leg, abilities: Abilities) -> DecisionReason:
    """The reason why a leg cannot be flown forward, or NONE."""
    if not abilities.can_fly_forward:
        return DecisionReason.NO_TRIM
    if leg.height < MIN_FORWARD_HEIGHT:
        return DecisionReason.TOO_LOW
    slope = leg.climb / max(leg.distance, 1e-6)
    if slope > MAX_CLIMB_SLOPE or slope < -MAX_DESCENT_SLOPE:
        return DecisionReason.TOO_STEEP
    return DecisionReason.NONE


def decide(leg: Leg, abilities: Abilities, min_leg: float, asked: LegMode = LegMode.NONE) -> Decision:
    """Choose the way of flying one leg from hover to hover.

    Args:
        leg: The leg.
        abilities: What the vehicle can do.
        min_leg: Shorter legs are never flown forward [m].
        asked: The way somebody asked for; followed unless it is impossible.
    """
    return choose_modes([leg], abilities, min_leg, [asked])[0]


def choose_modes(
    legs: Sequence[Leg],
    abilities: Abilities,
    min_leg: float,
    asked: Sequence[LegMode],
    *,
    lead: float | None = None,
    told: Sequence[LegMode] | None = None,
) -> list[Decision]:
    """Choose the ways of consecutive legs without a stop between them: those flown in a row share their transitions.

    Dynamic programming over the two ways; exact for the predictions made.

    Args:
        legs: The legs.
        abilities: What the vehicle can do.
        min_leg: Shorter legs are never begun in forward flight [m].
        asked: The way somebody asked for, leg by leg.
        lead: So far before the first leg the vehicle is in forward flight [m]; None: it hovers there.
        told: The way that was chosen before, leg by leg, or NONE: another has to be better by ``CHANGE_SHARE``.
    """
    told = [LegMode.NONE] * len(legs) if told is None else told
    barred = [_barred(leg, abilities, min_leg) for leg in legs]
    may_fly = [one is DecisionReason.NONE and way is not LegMode.HOVER for one, way in zip(barred, asked, strict=True)]
    rows = _rows(legs, abilities, may_fly, lead)
    chain = _Chain(abilities, legs, rows, [predict_hover(leg, abilities) for leg in legs], barred, asked, told)
    following = dict.fromkeys(_State, 0.0)  # smallest cost of what follows, by the state before it
    choice: list[dict[_State, _State]] = []
    for i in reversed(range(len(legs))):
        best: dict[_State, tuple[float, _State]] = {}
        for before in _State:
            after = _State.BEGUN if before is _State.HOVER else _State.THROUGH
            upright = _hover_cost(i, chain, before) + following[_State.HOVER]
            wing = _wing_cost(i, chain, before) + following[after]
            best[before] = (wing, after) if wing < upright else (upright, _State.HOVER)
        following = {before: cost for before, (cost, _) in best.items()}
        choice.insert(0, {before: after for before, (_, after) in best.items()})
    states = [_State.HOVER if lead is None else _State.THROUGH]
    for chosen in choice:
        states.append(chosen[states[-1]])
    ways = [state is not _State.HOVER for state in states]
    return [_decision(i, chain, ways) for i in range(len(legs))]


class _Chain(NamedTuple):
    """Consecutive legs, and leg by leg what is known of them."""

    abilities: Abilities
    legs: Sequence[Leg]
    rows: Sequence[FlyingOn]  # of those that are flown on through
    hover: Sequence[Prediction]
    barred: Sequence[DecisionReason]
    asked: Sequence[LegMode]
    told: Sequence[LegMode]  # before

    def change(self, i: int, way: LegMode, energy: float) -> float:
        """Cost of another way than that told before [J]: so that gusts do not turn a choice to and fro."""
        return CHANGE_SHARE * energy if self.told[i] not in {way, LegMode.NONE} else 0.0

    def forward(self, i: int, *, begin: bool, end: bool) -> Prediction:
        """Leg i in forward flight; arguments as of :func:`sitl.prediction.predictor.predict_forward`."""
        return _forward(self.legs[i], self.abilities, begin=begin, end=end, row=self.rows[i])


class _State(IntEnum):
    """The mode in which a leg was flown, from which the next one begins."""

    HOVER = 0
    BEGUN = 1  # forward, from the hover
    THROUGH = 2  # forward all along


def _barred(leg: Leg, abilities: Abilities, min_leg: float) -> DecisionReason:
    reason = forbidden(leg, abilities)
    if reason is DecisionReason.NONE and leg.distance < min_leg:
        return DecisionReason.TOO_SHORT
    return reason


def _rows(legs: Sequence[Leg], abilities: Abilities, may_fly: Sequence[bool], lead: float | None) -> list[FlyingOn]:
    """The flight of each leg in the longest row that may be flown forward with it."""
    rows: list[FlyingOn] = []
    while len(rows) < len(legs):
        begun = len(rows)
        row = list(itertools.takewhile(lambda pair: pair[1], zip(legs[begun:], may_fly[begun:], strict=True)))
        if not row:
            rows.append(FlyingOn(abilities.airspeed))
            continue
        is_long = len(row) == LEGS_AHEAD
        rows += flying_on([leg for leg, _ in row], abilities.airspeed, lead=None if begun else lead, is_long=is_long)
    return rows


@lru_cache(maxsize=4096)
def _forward(leg: Leg, abilities: Abilities, *, begin: bool, end: bool, row: FlyingOn) -> Prediction:
    return predict_forward(leg, abilities, begin=begin, end=end, row=row)


def _wing_cost(i: int, chain: _Chain, before: _State) -> float:
    """Cost of leg i flown forward, with the transition that begins it; that to the hover only if it is the last."""
    if chain.barred[i] is not DecisionReason.NONE or chain.asked[i] is LegMode.HOVER:
        return math.inf
    taken = chain.forward(i, begin=before is _State.HOVER, end=i + 1 == len(chain.legs))
    cost = min(taken.energy, UNABLE) + (LATE if _is_late(taken, chain.abilities) else 0.0)
    return cost + chain.change(i, LegMode.FORWARD, min(taken.energy, UNABLE))


def _hover_cost(i: int, chain: _Chain, before: _State) -> float:
    """Cost of leg i in the hover, with the stop that ends the leg before it if that was flown forward."""
    hover, barred, asked = chain.hover[i], chain.barred[i], chain.asked[i]
    cost = min(hover.energy, UNABLE) + (LATE if _is_late(hover, chain.abilities) else 0.0)
    cost += chain.change(i, LegMode.HOVER, min(hover.energy, UNABLE))
    if before is not _State.HOVER:
        cost += _stop(max(i - 1, 0), chain, begin=before is _State.BEGUN)
    return cost + (UNASKED if asked is LegMode.FORWARD and barred is DecisionReason.NONE else 0.0)


def _stop(i: int, chain: _Chain, *, begin: bool) -> float:
    """Energy that ending leg i in the hover costs over flying on; it may make the leg late."""
    whole, without = (chain.forward(i, begin=begin, end=end) for end in (True, False))
    if math.isinf(whole.energy):
        return UNABLE
    late = _is_late(whole, chain.abilities) and not _is_late(without, chain.abilities)
    return whole.energy - without.energy + (LATE if late else 0.0)


def _is_late(taken: Prediction, abilities: Abilities) -> bool:
    return 0.0 < abilities.deadline < taken.time


def _decision(i: int, chain: _Chain, ways: Sequence[bool]) -> Decision:
    """The decision on leg i; ``ways``: whether it flew forward before the first leg, then each leg's."""
    forward, hover, barred, abilities = IMPOSSIBLE, chain.hover[i], chain.barred[i], chain.abilities
    if barred in {DecisionReason.NONE, DecisionReason.TOO_SHORT} and abilities.can_fly_forward:
        end = i + 1 == len(chain.legs) or not ways[i + 2]
        forward = chain.forward(i, begin=not ways[i], end=end)
    leg_mode = LegMode.FORWARD if ways[i + 1] else LegMode.HOVER
    return Decision(
        leg=chain.legs[i],
        hover=hover,
        forward=forward,
        leg_mode=leg_mode,
        reason=_reason(leg_mode, hover, forward, barred, chain.asked[i], abilities.deadline),
    )


def _reason(
    leg_mode: LegMode, hover: Prediction, forward: Prediction, barred: DecisionReason, asked: LegMode, deadline: float
) -> DecisionReason:
    if leg_mode is LegMode.HOVER and barred is not DecisionReason.NONE:
        return barred
    if asked is leg_mode:
        return DecisionReason.COMMAND
    mine, other = (hover, forward) if leg_mode is LegMode.HOVER else (forward, hover)
    if math.isinf(other.time):
        return DecisionReason.WIND
    if mine.energy > other.energy and deadline > 0.0:
        return DecisionReason.DEADLINE
    return DecisionReason.ENERGY if mine.energy <= other.energy else DecisionReason.ROW
