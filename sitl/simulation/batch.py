"""Batches: thousands of simulations flown together on all cores, each bit for bit as if flown alone."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import groupby

import numpy as np

from sitl.errors import SitlError
from sitl.model.airframe import Array
from sitl.model.plant import is_finite
from sitl.simulation.actuator_faults import NO_FAULTS
from sitl.simulation.block import fly_block
from sitl.simulation.dispatch import REGISTER
from sitl.simulation.flight import Flight, JumpEntry, Sample
from sitl.simulation.loop import DIVERGED, FLOWN, JUMPS_FULL
from sitl.simulation.noise import BLOCK
from sitl.simulation.recording import Recording
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import whole_periods
from sitl.storage import WIDTH, block_of, from_block, record_type

MAX_JUMPS = 256  # of a flight in one call
FEW = 250  # rows of draws put side by side at once


def fly_batch(
    simulations: Iterable[Simulation], seconds: float, *, rate: float | None = None, threads: int = 2
) -> list[Recording]:
    """Fly simulations for a time, side by side; each ends as if it had been flown alone.

    They may differ in everything: airframe, seed, start, wind, reference, law. Those with the same tuning and design
    model, begun at the same time, share vector instructions, the more the longer they are under the same hover law.

    Args:
        simulations: What to fly, changed in place.
        seconds: How long, a whole number of control periods.
        rate: Samples a second to be recorded; none by default.
        threads: How many cores to use.

    Returns:
        A recording of every simulation, in order; without a rate, recordings of no samples with the jumps.

    Raises:
        UnknownLawError: If a flight is under no law of the core; nothing was flown.
        SitlError: If a flight has laws of its own, sensors, failures or an arena, and is flown alone; nothing was
            flown. Or if one diverged, jumped without end or more than MAX_JUMPS times; all others were flown.
    """
    flown = list(simulations)
    if len({id(simulation) for simulation in flown}) < len(flown):
        raise SitlError("the same simulation is in the batch twice")
    for simulation in flown:
        simulation.register.law(simulation.flight.controller.law)
        if simulation.register is not REGISTER:
            raise SitlError("a simulation with laws of its own is flown alone, not in a batch")
        if simulation.faults != NO_FAULTS or simulation.avionics.is_sensed:
            raise SitlError("a simulation with failed actuators or sensors aboard is flown alone, not in a batch")
        if not simulation.surroundings.is_open:
            raise SitlError("a simulation in an arena or a wind field is flown alone, not in a batch")
    periods = whole_periods(seconds)
    order = sorted(range(len(flown)), key=lambda i: (flown[i].design_key, i))
    groups = [list(group) for _, group in groupby(order, key=lambda i: flown[i].design_key)]
    blocks = [
        _Block([flown[i] for i in group[first : first + WIDTH]], periods, rate)
        for group in groups
        for first in range(0, len(group), WIDTH)
    ]
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(_Block.fly, blocks))
    recordings = {id(simulation): recording for block in blocks for simulation, recording in block.finished()}
    faults = [fault for block in blocks for fault in block.faults]
    if faults:
        raise SitlError(f"{len(faults)} of {len(flown)} flights failed; the first: {faults[0]}")
    return [recordings[id(simulation)] for simulation in flown]


class _Block:
    """Up to WIDTH simulations of one design; empty columns fly along with the first and are forgotten."""

    def __init__(self, simulations: Sequence[Simulation], periods: int, rate: float | None) -> None:
        self.simulations = list(simulations)
        self.faults: list[str] = []
        self._periods, self._every = periods, whole_periods(1.0 / rate) if rate else 1
        padded = [*self.simulations, *[self.simulations[0]] * (WIDTH - len(self.simulations))]
        self._flights = block_of([simulation.flight._replace(limits=0) for simulation in padded])
        self._references = block_of([simulation.reference for simulation in padded])
        self._airs = block_of([simulation.environment for simulation in padded])
        self._airframes = block_of([simulation.airframe for simulation in padded])
        self._gusty = any(self._is_gusty(simulation) for simulation in padded)
        self._samples = np.zeros((WIDTH, -(-periods // self._every) if rate else 0), record_type(Sample))
        self._jumps = np.zeros((WIDTH, MAX_JUMPS), record_type(JumpEntry))
        self._noted, self._ends = np.zeros(WIDTH, np.int64), np.zeros(WIDTH, np.int64)
        self._rows, self._in_force = np.zeros(WIDTH, np.int64), np.zeros(4 * WIDTH)

    def fly(self) -> None:
        """Fly all periods."""
        design, first = self.simulations[0].design_record, self.simulations[0].periods
        done = kept = 0
        while done < self._periods:
            now = min(self._periods - done, BLOCK - (first + done) % BLOCK)
            gusts, draws = self._draw(first + done, now)
            kept = fly_block(
                self._flights, self._references, self._airs, design, self._airframes, gusts, draws, now, self._every,
                kept, self._samples, self._jumps, self._noted, self._ends,
                self._rows, self._in_force,
            )  # fmt: skip
            done += now

    def finished(self) -> list[tuple[Simulation, Recording]]:
        """Give every simulation its flight back."""
        done = []
        for i, simulation in enumerate(self.simulations):
            jumps = simulation.continue_from(from_block(Flight, self._flights, i), self._jumps[i, : self._noted[i]])
            done.append((simulation, Recording.of(self._samples[i], jumps)))
            end = int(self._ends[i]) or (FLOWN if is_finite(from_block(Flight, self._flights, i).plant) else DIVERGED)
            if end == JUMPS_FULL:
                self.faults.append(f"more than {MAX_JUMPS} jumps in one call")
            elif end != FLOWN:
                self.faults.append(str(simulation.failure(end)))
        return done

    def _draw(self, period: int, count: int) -> tuple[Array, Array]:
        """Draws of all columns from a period on, (n, 3, WIDTH) and (n, 5, WIDTH)."""
        gusts, draws = np.zeros((count if self._gusty else 0, 3, WIDTH)), np.zeros((count, 5, WIDTH))
        drawn = [simulation.draws.rows(period, gusts=self._is_gusty(simulation)) for simulation in self.simulations]
        for first in range(0, count, FEW):  # at once they would not stay in the processor's cache
            few = slice(first, min(first + FEW, count))
            for i, (gust, sensed) in enumerate(drawn):
                draws[few, :, i] = sensed[few, :, 0]
                if len(gust):
                    gusts[few, :, i] = gust[few, :, 0]
        return gusts, draws

    @staticmethod
    def _is_gusty(simulation: Simulation) -> bool:
        return simulation.environment.gust_rms > 0.0
