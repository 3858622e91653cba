"""The experiments in the document's order, and how several are run at once."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context

from sitl.errors import SitlError
from sitl.studies.reproduction import (
    hovering,
    matrices,
    motors,
    redefinition,
    shapes,
    sigmoids,
    transition,
    vertical_plane,
)
from sitl.studies.reproduction.experiment import Experiment, Outcome

_LQI, _HOVER, _FAR = hovering.EXPERIMENTS
EXPERIMENTS: dict[str, Experiment] = {
    experiment.name: experiment
    for experiment in (
        matrices.EXPERIMENT,
        _LQI,
        sigmoids.EXPERIMENT,
        _HOVER,
        vertical_plane.EXPERIMENT,
        _FAR,
        transition.EXPERIMENT,
        motors.EXPERIMENT,
        shapes.EXPERIMENT,
        redefinition.EXPERIMENT,
    )
}
SLOWEST_FIRST = ("motors", "vertical-plane")  # so that no core waits for the last one alone


def chosen(names: Sequence[str] | None) -> list[Experiment]:
    """The experiments of these names, in the document's order; all of them for None.

    Raises:
        SitlError: If there is no such experiment.
    """
    for name in names or ():
        if name not in EXPERIMENTS:
            raise SitlError(f"no experiment {name!r}: there are {', '.join(EXPERIMENTS)}")
    return [experiment for name, experiment in EXPERIMENTS.items() if not names or name in names]


def run_one(name: str, seed: int) -> tuple[Outcome, float]:
    """Run an experiment; its outcome and how long it took [s]."""
    began = time.perf_counter()
    outcome = EXPERIMENTS[name].run(seed)
    return outcome, time.perf_counter() - began


def run_all(experiments: Sequence[Experiment], seed: int, jobs: int, say: Callable[[str], None]) -> dict[str, Outcome]:
    """Run experiments, several processes at once.

    Args:
        experiments: Which.
        seed: Of whatever is random in them.
        jobs: How many at once.
        say: Told of each that is done.
    """
    order = sorted((e.name for e in experiments), key=lambda name: name not in SLOWEST_FIRST)
    done: dict[str, Outcome] = {}

    def note(name: str, outcome: Outcome, took: float) -> None:
        done[name] = outcome
        say(f"{len(done)}/{len(order)} {name}: {len(outcome.rows)} statements, {took:.1f} s")

    if jobs == 1 or len(order) == 1:
        for name in order:
            note(name, *run_one(name, seed))
        return done
    quiet = signal.signal, (signal.SIGINT, signal.SIG_DFL)  # an interrupted worker ends without a word
    with ProcessPoolExecutor(min(jobs, len(order)), get_context("spawn"), *quiet) as pool:
        waiting = {pool.submit(run_one, name, seed): name for name in order}
        try:
            for future in as_completed(waiting):
                note(waiting[future], *future.result())
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return done
