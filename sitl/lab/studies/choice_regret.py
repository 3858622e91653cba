"""Random legs flown both ways: what the choice between hover and forward flight costs over the better one."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from protocol.dialect.vocabulary import LegMode
from sitl.lab.studies.break_even import FlownLeg, abilities, draw, error_words, fly_leg, prediction_error
from sitl.lab.studies.proportions import counted
from sitl.lab.studies.seeded_flights import check_seeded, fly_draws, print_progress, write_json
from sitl.prediction.corners import Leg

ALLOWED_REGRET = 0.05  # in the mean [-]


class BothWays(NamedTuple):
    """One leg in the hover and in forward flight."""

    hover: FlownLeg
    forward: FlownLeg

    @property
    def chosen(self) -> FlownLeg:
        """The way that was predicted to need less energy."""
        return min(self, key=lambda one: one.predicted.energy)

    @property
    def better(self) -> FlownLeg:
        """The way that needed less."""
        return min(self, key=lambda one: one.energy)

    @property
    def regret(self) -> float:
        """Energy of the choice over that of the better way, less 1; infinite where the choice never arrived."""
        return self.chosen.energy / self.better.energy - 1.0 if math.isfinite(self.chosen.energy) else math.inf


def fly_both(drawn: tuple[Leg, float], airframe: str, pace: int) -> BothWays:
    """Fly a leg with its airspeed both ways."""
    leg, airspeed = drawn
    hover, forward = (fly_leg(leg, mode, airspeed, airframe, pace) for mode in (LegMode.HOVER, LegMode.FORWARD))
    return BothWays(hover, forward)


def summary(flown: Sequence[BothWays]) -> list[str]:
    """Costs of the choices, as lines of text."""
    regrets = np.array([one.regret for one in flown])
    wrong = sum(one.chosen is not one.better for one in flown)
    hovered = sum(one.chosen is one.hover for one in flown)
    worst = max(flown, key=lambda one: one.regret)
    lines = [
        f"{len(flown)} legs: {hovered} hovered, {len(flown) - hovered} forward",
        f"the other way needed less: {counted(wrong, len(flown))}",
        f"regret: mean {regrets.mean():.2%}, 95 % of legs below {np.quantile(regrets, 0.95):.2%}, "
        f"worst {worst.regret:.1%} ({_words(worst)})",
    ]
    for name, always in zip(BothWays._fields, ("to hover all of them", "to fly all forward"), strict=True):
        cost = sum(getattr(one, name).energy for one in flown) / sum(one.better.energy for one in flown) - 1.0
        lines.append(f"{always} would cost {cost:.1%} more than the better way")
        error = prediction_error([getattr(one, name) for one in flown])
        lines.append(
            f"error of the prediction, {name}: time {error_words(error.time)}, energy {error_words(error.energy)}"
        )
    return [*lines, "errors: median / 90 % / mean"]


def _words(one: BothWays) -> str:
    leg = one.hover.leg
    return (
        f"{leg.distance:.0f} m, climb {leg.climb:+.0f} m, wind {leg.tail_wind:+.1f} along, {leg.cross_wind:+.1f} across"
    )


def study_regret(args: argparse.Namespace) -> int:
    """Fly the legs and print what the choice costs; exit code 1 if it is too much, or a choice never arrives."""
    check_seeded(args, {})
    legs = draw(args.flights, abilities(args.airframe, pace=args.pace), args.first, forward=True)
    flown = fly_draws(
        partial(fly_both, airframe=args.airframe, pace=args.pace),
        legs,
        args.jobs,
        on_progress=lambda done: print_progress(done, len(legs)),
    )
    print("\n".join(summary(flown)), flush=True)
    if args.json is not None:
        write_json(args.json, [{"regret": one.regret, "chosen": one.chosen.leg_mode.name} for one in flown])
    return 0 if float(np.mean([one.regret for one in flown])) <= ALLOWED_REGRET else 1
