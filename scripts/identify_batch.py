"""Accuracy and confidence of identification: many flights of altered airframes, each identified from its log.

``python scripts/identify_batch.py --airframe collage --flights 24`` prints, for every effect and parameter, the mean,
the median and the greatest error and how often the 95 % interval holds the truth. A flight that ends in a crash, as
with too little thrust for the stop at its end, is identified by what it flew before.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sitl.errors import SitlError
from sitl.lab.identification import flown_log, rotations
from sitl.lab.identification.flight_log import LogConventions, SensorRecord, Series, read_flight
from sitl.lab.identification.identify_flight import identify_record
from sitl.lab.identification.result import EFFECTS, effect_values
from sitl.lab.identification.unknowns import of_mass, value_of
from sitl.model.airframe import Airframe
from sitl.model.airframe_files import load

WANDER_TIME = 5.0  # [s]


class Score(NamedTuple):
    """One value of one flight."""

    error: float  # relative
    interval: float  # half of it, relative
    holds: bool
    told: bool


def main() -> None:
    """Fly, identify, print."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--airframe", default="collage")
    options.add_argument("--flights", type=int, default=24)
    options.add_argument("--first", type=int, default=1)
    options.add_argument("--off", type=float, default=0.2)
    options.add_argument("--wind", type=float, default=3.0, help="greatest [m/s]")
    options.add_argument("--gusts", type=float, default=0.0)
    options.add_argument("--imu-every", type=int, default=1, help="of the 250 samples a second")
    options.add_argument("--wander", type=float, default=0.0, help="of the measured attitude besides, in 5 s [deg]")
    options.add_argument("--commands-every", type=int, default=1, help="of the 500 a second")
    args = options.parse_args()
    base = load(args.airframe).parameters
    scores: dict[str, list[Score]] = {}
    crashed = 0
    for seed in range(args.first, args.first + args.flights):
        true = flown_log.off_airframe(base, args.off, seed)
        speed = args.wind * float(np.random.default_rng(seed).uniform())
        wind = (speed * math.cos(seed), speed * math.sin(seed))
        flown = flown_log.fly_excitation(true, base, seed=seed, wind=wind, gusts=args.gusts)
        if flown.crashed:
            crashed += 1
            print(f"seed {seed}: crashed after {flown.time[-1]:.0f} s, identified by what it flew", flush=True)
        try:
            found = _score(flown, true, base, seed, args)
        except SitlError as error:
            print(f"seed {seed}: {error}", flush=True)
            continue
        for name, score in found.items():
            scores.setdefault(name, []).append(score)
        worst = max((abs(found[e.name].error), e.name) for e in EFFECTS)
        held = sum(score.holds for score in found.values())
        print(f"seed {seed}: {held} of {len(found)} held; worst effect {worst[1]} {100 * worst[0]:.2f} %", flush=True)
    _print(scores, crashed)


def _score(
    flown: flown_log.FlownTruth, true: Airframe, base: Airframe, seed: int, args: argparse.Namespace
) -> dict[str, Score]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "flight.tlog"
        flown_log.write_log(_wandering(flown, math.radians(args.wander), seed), path, base, seed=seed)
        record = read_flight(path, LogConventions(None, base))
    record = SensorRecord(
        _thinned(record.imu, args.imu_every),
        _thinned(record.commands, args.commands_every),
        record.attitude,
        record.motion,
        record.sources,
    )
    found = identify_record(record, base)
    same = of_mass(true, base.m)
    truths = dict(zip((e.name for e in EFFECTS), effect_values(true, base), strict=True))
    truths |= {row.key: value_of(same, row.key) for row in found.parameters}
    rows = {row.key or row.name: row for row in (*found.effects, *found.parameters)}
    return {
        name: Score(
            (row.estimate - truths[name]) / (abs(truths[name]) or 0.1),
            row.interval / (abs(truths[name]) or 0.1),
            abs(row.estimate - truths[name]) <= row.interval,
            row.told,
        )
        for name, row in rows.items()
    }


def _wandering(flown: flown_log.FlownTruth, deviation: float, seed: int) -> flown_log.FlownTruth:
    """The flight with attitudes that wander about the true ones, as an Ornstein-Uhlenbeck process."""
    if deviation == 0.0:
        return flown
    random, off = np.random.default_rng(seed), np.zeros((len(flown.time), 3))
    kept = math.exp(-flown_log.LOG_STEP / WANDER_TIME)
    drawn = deviation * math.sqrt(1.0 - kept**2) * random.standard_normal(off.shape)
    for i in range(1, len(off)):
        off[i] = kept * off[i - 1] + drawn[i]
    body = flown.body.copy()
    body[:, 6:10] = rotations.product(rotations.of_vector(off), body[:, 6:10])
    return flown._replace(body=body)


def _thinned(series: Series, every: int) -> Series:
    return Series(series.time[::every], series.values[::every])


def _print(scores: dict[str, list[Score]], crashed: int) -> None:
    heads = f"{'mean':>8}{'median':>9}{'greatest':>10}{'interval':>10}{'held':>7}{'told':>7}"
    print(f"\n{'':<30}{heads}   ({crashed} crashed)")
    for name, group in scores.items():
        errors = [abs(score.error) for score in group]
        interval = np.median([score.interval for score in group])
        held, told = (np.mean([getattr(score, field) for score in group]) for field in ("holds", "told"))
        print(
            f"{name:<30}{100 * np.mean([score.error for score in group]):7.2f}%{100 * np.median(errors):8.2f}%"
            f"{100 * max(errors):9.2f}%{100 * interval:9.2f}%"
            f"{100 * held:6.0f}%{100 * told:6.0f}%"
        )
    told_ones = [score.holds for group in scores.values() for score in group if score.told]
    print(f"held in all, of what was told: {100 * np.mean(told_ones):.1f} %")


if __name__ == "__main__":
    main()
