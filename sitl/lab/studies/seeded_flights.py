"""Flights from many seeds, shared among processes: their order and results do not depend on how many."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

from sitl import SitlError
from sitl.tools.worker_pool import worker_pool

Draw = TypeVar("Draw")
Result = TypeVar("Result")


def ignore_progress(done: int) -> None:
    """Nobody watches how many flights are done."""


def seeds(flights: int, first: int) -> range:
    """Seeds ``first`` to ``first + flights - 1``.

    Raises:
        SitlError: If there are none, or a negative one.
    """
    if flights < 1:
        raise SitlError(f"{flights} flights: there must be at least 1")
    if first < 0:
        raise SitlError(f"seed {first}: seeds are not negative")
    return range(first, first + flights)


def fly_draws(
    fly: Callable[[Draw], Result],
    draws: Sequence[Draw],
    jobs: int,
    at_once: int = 1,
    on_progress: Callable[[int], None] = ignore_progress,
) -> list[Result]:
    """Fly every draw, or every seed.

    Args:
        fly: Flies one; a function that other processes find by its name.
        draws: What is flown.
        jobs: Processes at once.
        at_once: How many are handed to a process at once.
        on_progress: Called with the number of flights done, after each.

    Raises:
        SitlError: If there is nothing to fly, or no process that flies.
    """
    if not draws or jobs < 1:
        raise SitlError(f"{len(draws)} flights by {jobs} processes: both must be at least 1")
    results = []
    for result in _flown(fly, draws, jobs, at_once):
        results.append(result)
        on_progress(len(results))
    return results


def _flown(fly: Callable[[Draw], Result], draws: Sequence[Draw], jobs: int, at_once: int) -> Iterator[Result]:
    if jobs == 1:
        yield from map(fly, draws)
        return
    with worker_pool(min(jobs, len(draws))) as pool:
        yield from pool.map(fly, draws, chunksize=at_once)
