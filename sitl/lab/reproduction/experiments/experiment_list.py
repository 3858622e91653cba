"""The experiments in the document's order, and how several are run at once."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import as_completed

from sitl import SitlError
from sitl.lab.reproduction.experiment import Conditions, Experiment, ExperimentResult
from sitl.lab.reproduction.experiments.actuator_lag import ACTUATOR_LAG
from sitl.lab.reproduction.experiments.actuator_limits import ACTUATOR_LIMITS
from sitl.lab.reproduction.experiments.back_transition import BACK_TRANSITION
from sitl.lab.reproduction.experiments.governor_sigmoids import GOVERNOR_SIGMOIDS
from sitl.lab.reproduction.experiments.hover_flights import FAR_TARGET, HOVER_FLIGHT, LQI_IN_WIND
from sitl.lab.reproduction.experiments.linear_domain import LINEAR_DOMAIN
from sitl.lab.reproduction.experiments.nu_redefinition import NU_REDEFINITION
from sitl.lab.reproduction.experiments.printed_numbers import PRINTED_NUMBERS
from sitl.lab.reproduction.experiments.vertical_plane import VERTICAL_PLANE
from sitl.lab.reproduction.experiments.wing_shapes import WING_SHAPES
from sitl.tools.worker_pool import worker_pool

EXPERIMENTS: dict[str, Experiment] = {
    experiment.name: experiment
    for experiment in (
        ACTUATOR_LIMITS,
        PRINTED_NUMBERS,
        LQI_IN_WIND,
        LINEAR_DOMAIN,
        GOVERNOR_SIGMOIDS,
        HOVER_FLIGHT,
        VERTICAL_PLANE,
        FAR_TARGET,
        BACK_TRANSITION,
        ACTUATOR_LAG,
        WING_SHAPES,
        NU_REDEFINITION,
    )
}
SLOWEST_FIRST = ("motors", "vertical-plane")  # so that no core waits for the last one alone


def chosen(names: Sequence[str] | None) -> list[Experiment]:
    """The experiments of these names in the document's order; all of them if no name is given.

    Raises:
        SitlError: If there is no such experiment.
    """
    for name in names or ():
        if name not in EXPERIMENTS:
            raise SitlError(f"no experiment {name!r}: there are {', '.join(EXPERIMENTS)}")
    return [experiment for name, experiment in EXPERIMENTS.items() if not names or name in names]


def run_one(name: str, seed: int) -> tuple[ExperimentResult, float]:
    """Run an experiment; its result and how long it took [s]."""
    began = time.perf_counter()
    result = EXPERIMENTS[name].run(Conditions(seed))
    return result, time.perf_counter() - began


def run_all(
    experiments: Sequence[Experiment], seed: int, jobs: int, on_progress: Callable[[str], None]
) -> dict[str, ExperimentResult]:
    """Run experiments, several processes at once; results by name.

    Args:
        experiments: To run.
        seed: Of every random draw in them.
        jobs: Processes at once.
        on_progress: Called with a line of text for each finished experiment.
    """
    order = sorted((e.name for e in experiments), key=lambda name: name not in SLOWEST_FIRST)
    results: dict[str, ExperimentResult] = {}

    def add(name: str, result: ExperimentResult, took: float) -> None:
        results[name] = result
        on_progress(f"{len(results)}/{len(order)} {name}: {len(result.statements)} statements, {took:.1f} s")

    if jobs == 1 or len(order) == 1:
        for name in order:
            add(name, *run_one(name, seed))
        return results
    with worker_pool(min(jobs, len(order))) as pool:
        waiting = {pool.submit(run_one, name, seed): name for name in order}
        for future in as_completed(waiting):
            add(waiting[future], *future.result())
    return results
