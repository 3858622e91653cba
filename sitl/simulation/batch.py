"""Batches: many simulations flown together on all cores, each bit for bit as if flown alone."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from sitl.errors import SitlError
from sitl.simulation.flight import Sample
from sitl.simulation.recording import Recording
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import whole_periods
from sitl.storage import record_type


def fly_batch(
    simulations: Iterable[Simulation], seconds: float, *, rate: float | None = None, threads: int = 2
) -> list[Recording]:
    """Fly simulations for a time, a thread for each core; each ends as if it had been flown alone.

    They may differ in everything: airframe, laws, navigation, arena, failures, seed, start, wind, reference.

    Args:
        simulations: What to fly, changed in place.
        seconds: How long, a whole number of control periods.
        rate: Samples a second to be recorded; none by default.
        threads: How many cores to use.

    Returns:
        A recording of every simulation, in order; without a rate, recordings of no samples with the jumps.

    Raises:
        UnknownLawError: If a flight is under no law of its register; nothing was flown.
        SitlError: If a simulation is there twice; nothing was flown. Or if one diverged or jumped without end; all
            others were flown.
    """
    flown = list(simulations)
    if len({id(simulation) for simulation in flown}) < len(flown):
        raise SitlError("the same simulation is in the batch twice")
    whole_periods(seconds)
    for simulation in flown:
        simulation.register.law(simulation.flight.controller.law)
    for simulation in {simulation.register: simulation for simulation in flown}.values():
        simulation.warm_up()  # compiled by one thread
    with ThreadPoolExecutor(threads) as pool:
        results = list(pool.map(lambda simulation: _fly(simulation, seconds, rate), flown))
    faults = [result for result in results if isinstance(result, SitlError)]
    if faults:
        raise SitlError(f"{len(faults)} of {len(flown)} flights failed; the first: {faults[0]}")
    return [result for result in results if isinstance(result, Recording)]


def _fly(simulation: Simulation, seconds: float, rate: float | None) -> Recording | SitlError:
    """Fly one; gives the error that it ended with, if any."""
    before = len(simulation.jumps)
    try:
        if rate:
            return simulation.record(seconds, rate)
        simulation.step(seconds)
    except SitlError as error:
        return error
    return Recording.of(np.zeros(0, record_type(Sample)), tuple(simulation.jumps[before:]))
