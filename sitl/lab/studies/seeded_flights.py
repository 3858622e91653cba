"""Flights from many seeds: the craft, the processes they are shared among, their progress and results."""

from __future__ import annotations

import argparse
import json
import math
import signal
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple, TypeVar

from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.plans.plan import MissionItem
from sitl import Aircraft, Airframe, Navigation, Simulation, SitlError, Start, Tuning, load_airframe, load_sensors
from sitl.autopilot.world import ARENAS, World
from sitl.defaults import GENTLE, HOME, STUDY_AIRFRAME
from sitl.design.paparazzi_indi import believed
from sitl.lab.study_options import PAPARAZZI
from sitl.simulation.tuning import CONTROLLERS, INDI, uses_indi

# Flights from many seeds, shared among processes: their order and results do not depend on how many.

# Worker processes for studies: an interrupt ends them at once and without tracebacks.


@contextmanager
def worker_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """A pool of freshly started processes; tasks that still wait when the block fails are dropped.

    Args:
        workers: How many processes.
    """
    end_quietly = signal.signal, (signal.SIGINT, signal.SIG_DFL)  # no KeyboardInterrupt traceback from each worker
    with ProcessPoolExecutor(workers, get_context("spawn"), *end_quietly) as pool:
        try:
            yield pool
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


# The vehicle that a study flies: an airframe, what it navigates by, and its instruments.


class Craft(NamedTuple):
    """Names and files, which other processes read again."""

    airframe: str = STUDY_AIRFRAME  # parameter set or TOML file; the design model
    navigation: Navigation = Navigation.SENSORS
    sensors: str | None = None  # TOML file; None: as shipped
    controller: str = "hybrid"  # of CONTROLLERS, or PAPARAZZI
    pace: int = GENTLE  # of INDI

    @property
    def model(self) -> Airframe:
        """The airframe as it is designed for."""
        return load_airframe(self.airframe).parameters

    @property
    def tuning(self) -> Tuning:
        """Of its controller."""
        if self.controller == PAPARAZZI:
            return Tuning(controller=INDI, paparazzi=1)
        return Tuning(controller=CONTROLLERS[self.controller], pace=self.pace)

    def fly(self, seed: int, start: Start, airframe: Airframe | None = None) -> Simulation:
        """A vehicle of this kind.

        Args:
            seed: Of gusts and instruments.
            start: Where it begins.
            airframe: As it is; the design model by default.
        """
        model = self.model
        return Simulation(
            airframe or model,
            seed=seed,
            start=start,
            tuning=self.tuning,
            design_model=believed(model) if self.controller == PAPARAZZI else model,
            navigation=self.navigation,
            sensors=load_sensors(self.sensors),
        )


DEFAULT_CRAFT = Craft()


# Shared by the studies that fly missions: the world they fly in, waypoints, and the end of a mission.


STUDY_WORLD = World(LocalFrame(HOME), ARENAS["open"])
SAMPLE_PERIODS = 10  # control periods between two looks at a flight
LOOK_TIME = 0.02  # the same [s]


def waypoint(north: float, west: float, up: float, hold: float = 0.0) -> MissionItem:
    """A waypoint in the local frame.

    Args:
        north: [m].
        west: [m].
        up: Above the origin [m].
        hold: Time to stay there [s].
    """
    params = (hold, 0.0, 0.0, math.nan)
    return MissionItem(
        command=mavlink.MAV_CMD_NAV_WAYPOINT,
        frame=mavlink.MAV_FRAME_LOCAL_NED,
        params=params,
        x=round(north * 1e4),
        y=round(-west * 1e4),
        z=-up,
    )


def has_finished_mission(aircraft: Aircraft) -> bool:
    """Whether the last item of its mission is done."""
    mission = aircraft.autopilot.mission
    return mission is not None and mission.finished


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


PROGRESS_INTERVAL = 10  # flights between two progress lines


def craft_of(args: argparse.Namespace) -> Craft:
    """The craft that the arguments of a seeded study choose.

    Raises:
        SitlError: If there is no such airframe, a file is not valid, or nothing would heed the pace.
    """
    load_sensors(args.sensors)
    controller = args.controller or DEFAULT_CRAFT.controller
    if args.pace != GENTLE and (controller == PAPARAZZI or not uses_indi(Tuning(controller=CONTROLLERS[controller]))):
        raise SitlError(f"--brisk: {controller} flies by other gains, which have one pace")
    return Craft(args.airframe, Navigation(args.nav), args.sensors, controller, args.pace)


def check_seeded(args: argparse.Namespace, limits: Mapping[str, float], counts: Sequence[str] = ()) -> None:
    """Refuse bad arguments before any flight.

    Args:
        args: Of a seeded study.
        limits: Greatest value of each argument that must not be negative; it may have several values.
        counts: Further arguments that must be at least 1.

    Raises:
        SitlError: Names the argument and its value, or the folder that is missing.
    """
    for name in ("flights", "jobs", *counts):
        if getattr(args, name) < 1:
            raise SitlError(f"--{name} {getattr(args, name)}: there must be at least 1")
    if args.first < 0:
        raise SitlError(f"--first {args.first}: seeds are not negative")
    for name, maximum in limits.items():
        given = getattr(args, name)
        for value in given if isinstance(given, list) else [given]:
            if not 0.0 <= value <= maximum:
                raise SitlError(f"--{name} {value:g} is not within 0 and {maximum:g}")
    if args.json is not None and not args.json.parent.is_dir():
        raise SitlError(f"{args.json}: there is no folder {args.json.parent}")


def print_progress(done: int, of: int) -> None:
    """A line on the standard error now and then, and at the end."""
    if done % PROGRESS_INTERVAL == 0 or done == of:
        print(f"{done}/{of} flown", file=sys.stderr, flush=True)


def write_json(path: Path, written: object) -> None:
    """Write results as JSON.

    Raises:
        SitlError: The file cannot be written.
    """
    try:
        path.write_text(json.dumps(written, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise SitlError(f"{path}: {error.strerror}") from error
