"""Flights of one task side by side: their beginnings, random draws, and intervals by the compiled step."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sitl import (
    Airframe,
    Array,
    Law,
    Navigation,
    Reference,
    SensorSet,
    Simulation,
    SitlError,
    Start,
    Tuning,
    Vector,
    load_airframe,
    load_sensors,
)
from sitl.compiled import compiling, is_compiled
from sitl.defaults import STUDY_AIRFRAME
from sitl.estimation.filter import MAX_HORIZON, Step
from sitl.estimation.sensing import observe
from sitl.gym.action_kinds import ACTED, AS_REFERENCE, action_kind
from sitl.gym.fleet_step import FleetArrays, Outcome, SenseArrays, Turn, step_by_commands, step_by_controller
from sitl.gym.flight_tasks import task_of
from sitl.gym.rewards import OBSERVED, Goal
from sitl.gym.variation import Intervals, variation_of
from sitl.model.ground import LEVEL_GROUND, feet_aloft
from sitl.model.state import Body, Plant
from sitl.sensors.draws import PERIOD, SLOW_PERIODS, in_fine_steps
from sitl.sensors.instruments import (
    AIDS,
    DROPOUT,
    FAST_COLUMNS,
    POSE_POSITION_NOISE,
    SLOW_COLUMNS,
)
from sitl.simulation.avionics import Avionics
from sitl.simulation.flight import Environment, JumpEntry
from sitl.simulation.loop import due_now, estimate_wind, move, take_jump, tick
from sitl.simulation.sensed import sensed
from sitl.simulation.start import entered
from sitl.simulation.tuning import CONTROLLERS
from sitl.storage import record_of, record_type

DRAWN = 200  # control periods of a block of random draws
INTERVAL_PERIODS = 10  # control periods of an action, unless told otherwise
LARGEST_SEED = 2**62
STILL = Vector(0.0, 0.0, 0.0)
PARTS_BY_COMMANDS = (move, sensed)
PARTS_BY_CONTROLLER = (tick, due_now, take_jump, estimate_wind)
FIRST_LAWS = {"indi": Law.INDI, "robust-pi": Law.ROBUST_PI}  # in which an episode begins; else the zero-moment law


class BatchOptions(NamedTuple):
    """Options of the environments."""

    observe: str = "truth"  # or "sensors": the navigation filter's estimate
    actions: str = "actuators"  # of ACTION_KINDS
    airframe: str = STUDY_AIRFRAME  # parameter set or TOML file
    periods: int = INTERVAL_PERIODS  # control periods of 2 ms in a step
    vary: Intervals | str | None = None  # see variation_of
    controller: str = "hybrid"  # of CONTROLLERS: what flies where actions are references
    sensors: str | None = None  # TOML file; None: as shipped
    threads: int = 1  # that fly a vector of environments


@lru_cache(maxsize=8)
def _first_flight(airframe: Airframe, controller: str, latency_of: SensorSet | None) -> Simulation:
    """A hover whose records all flights begin from; never flown."""
    navigation = Navigation.TRUTH if latency_of is None else Navigation.SENSORS
    made = Simulation(
        airframe,
        start=Start(up=100.0, airborne=True),
        tuning=Tuning(controller=CONTROLLERS[controller]),
        navigation=navigation,
        sensors=latency_of,
    )
    made.begin_flight(FIRST_LAWS.get(controller, Law.HOVER_ZERO_MOMENT))
    return made


class FlightBatch:
    """Flights side by side, each by its own generator: a batch of one flies the same bits as one of a thousand.

    Args:
        task: Its name.
        count: How many.
        options: Of the environments.

    Raises:
        SitlError: If an option is not usable.
    """

    def __init__(self, task: str, count: int, options: BatchOptions) -> None:
        self.task, self.options, self.count = task_of(task), options, count
        self.kind = action_kind(options.actions)
        self.is_sensed = _is_sensed(options.observe)
        _check_counts(count, options)
        self.airframe = load_airframe(options.airframe).parameters
        self.sensors = load_sensors(options.sensors)
        self.variation = variation_of(self.airframe, self.task.weather, options.vary)
        self._first = _first_flight(self.airframe, options.controller, self.sensors if self.is_sensed else None)
        flight = self._first.flight
        self._turning = flight.plant.actuators
        if self.kind != AS_REFERENCE:  # shown in logs, where no law of ours flies
            flight = flight._replace(controller=flight.controller._replace(law=int(Law.HOVER_ATTITUDE)))
        self._template = record_of(type(flight), flight)
        self.fleet, self.senses = self._arrays(), self._instruments()
        self.outcome = Outcome(
            observations=np.zeros((count, OBSERVED), np.float32),
            rewards=np.zeros(count),
            lost=np.zeros(count, bool),
            flies=np.zeros(count, bool),
        )
        self._scratch = np.zeros((options.threads, OBSERVED))
        self._noise: list[np.random.Generator] = [np.random.default_rng(0)] * count
        self._pool = ThreadPoolExecutor(options.threads) if options.threads > 1 else None
        self._step: Callable[..., None] = step_by_controller if self.kind == AS_REFERENCE else step_by_commands
        self._compile()

    @property
    def seconds(self) -> float:
        """Length of a step [s]."""
        return self.options.periods * PERIOD

    @property
    def max_steps(self) -> int:
        """Steps of an episode that is not lost."""
        return math.ceil(self.task.seconds / self.seconds)

    def begin(self, which: Iterable[int], randoms: Iterable[np.random.Generator]) -> None:
        """Begin new episodes.

        Args:
            which: Numbers of the flights.
            randoms: The generator of each.
        """
        for i, random in zip(which, randoms, strict=True):
            body = self.task.begin(random, self.task.goal.place)
            self.put(i, body, random)

    def put(self, i: int, body: Body, random: np.random.Generator) -> None:
        """Begin an episode of flight ``i`` in a state; weather, airframe and noise are drawn."""
        fleet, conditions = self.fleet, self.variation.draw(random)
        if self.is_sensed or self.variation.has_gusts or self.kind == AS_REFERENCE:
            self._noise[i] = np.random.default_rng(int(random.integers(LARGEST_SEED)))
        flight = self._template[0].copy()
        plant = Plant(body, self._turning, feet_aloft())
        is_told = self.kind == AS_REFERENCE  # by our controller, which estimates the wind itself
        estimate = observe(plant, STILL, STILL if is_told else conditions.wind, False)
        if is_told:
            before = self._first.flight._replace(plant=plant, estimate=estimate)
            fleet.flights[i] = entered(before, before.controller.law, self._first.design)
        else:
            flight["plant"], flight["estimate"] = plant, estimate
            fleet.flights[i] = flight
        fleet.flights["periods"][i] = 0
        fleet.flights["energy"][i] = 0.0
        if self.variation.changes_airframe:
            fleet.airframes[i] = conditions.airframe
        fleet.airs["wind"][i], fleet.airs["gust_rms"][i] = conditions.wind, conditions.gusts
        if conditions.gusts > 0.0:
            gust = in_fine_steps(self._noise[i].standard_normal(3)) * conditions.gusts
            fleet.flights["gust"][i] = tuple(gust.tolist())
        if self.is_sensed:
            self._switch_on(i, plant, conditions.wind, conditions.airframe)

    def look(self) -> npt.NDArray[np.float32]:
        """Observations of all flights, which do not move, (n, OBSERVED)."""
        self.outcome.flies[:] = False
        self.fly(np.zeros((self.count, ACTED)), 0)
        return self.outcome.observations.copy()

    def step(self, actions: Any, flies: npt.NDArray[np.bool_]) -> Outcome:  # noqa: ANN401 - what numpy takes
        """Fly an interval; what it gives is overwritten by the next call, but for the observations.

        Args:
            actions: (n, 4) from -1 to 1.
            flies: (n,) others are only observed.

        Returns:
            Observations, rewards (a second's rate times the interval), whether each is lost.

        Raises:
            SitlError: If the actions are not finite, or too few.
        """
        acted = np.ascontiguousarray(actions, float)
        if acted.shape != (self.count, ACTED) or not np.isfinite(acted).all():
            raise SitlError(f"actions must be {self.count} rows of {ACTED} finite numbers")
        self.outcome.flies[:] = flies
        self._refill(flies)
        self.fly(acted, self.options.periods)
        self.outcome.rewards[:] *= self.seconds
        return self.outcome._replace(observations=self.outcome.observations.copy())

    def fly(self, actions: Array, periods: int) -> None:
        """The compiled call alone, by random draws as they are.

        Args:
            actions: (n, 4) from -1 to 1, contiguous.
            periods: Control periods; 0: only observe.
        """
        if self._pool is None:
            self._part(actions, 0, Turn(0, self.count, periods, self.kind))
            return
        ends = np.linspace(0, self.count, self.options.threads + 1).astype(int).tolist()
        turns = [Turn(first, end, periods, self.kind) for first, end in itertools.pairwise(ends)]
        list(self._pool.map(lambda job: self._part(actions, *job), enumerate(turns)))

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None

    # Inside

    def _arrays(self) -> FleetArrays:
        n, first = self.count, self._first
        air = record_of(Environment, first.environment._replace(wind=STILL, gust_rms=0.0))
        told = record_of(Reference, self.task.reference)
        reads = DRAWN if self.kind == AS_REFERENCE and not self.is_sensed else 0
        return FleetArrays(
            flights=np.repeat(self._template, n),
            airframes=np.repeat(record_of(Airframe, self.airframe), n),
            airs=np.repeat(air, n),
            goals=np.repeat(record_of(Goal, self.task.goal), n),
            references=np.repeat(told, n),
            told=told,
            designs=first.design_record,
            jumps=np.zeros(n, record_type(JumpEntry)),
            gusts=np.zeros((n, DRAWN if self.variation.has_gusts else 0, 3)),
            readings=np.zeros((n, reads, 5)),
        )

    def _instruments(self) -> SenseArrays:
        n, block = self.count, DRAWN if self.is_sensed else 0
        return SenseArrays(
            aboard=np.repeat(self._first.avionics.records, n if self.is_sensed else 1),
            steps=np.zeros((n, MAX_HORIZON if self.is_sensed else 0), record_type(Step)),
            fast=np.zeros((n, block, FAST_COLUMNS)),
            slow=np.zeros((n, block // SLOW_PERIODS, SLOW_COLUMNS)),
        )

    def _switch_on(self, i: int, plant: Plant, wind: Vector, airframe: Airframe) -> None:
        """Instruments with errors of their own, and a converged filter, whose estimate is the first."""
        seed = int(self._noise[i].integers(LARGEST_SEED))
        avionics = Avionics(Navigation.SENSORS, self.sensors, self.airframe, seed)
        avionics.redesign(self.airframe, self._first.design.gains.wind)
        avionics.converge(plant, 0, wind, LEVEL_GROUND, airframe)
        self.senses.aboard[i] = avionics.records[0]
        self.senses.steps[i] = avionics.steps
        estimate, nominal = self.fleet.flights["estimate"], avionics.filter.nominal
        for part in ("position", "velocity", "attitude"):
            estimate[part][i] = getattr(nominal, part)
        estimate["wind"][i] = STILL

    def _refill(self, flies: npt.NDArray[np.bool_]) -> None:
        """New blocks of draws for the flights that have used theirs up."""
        gusts, readings, senses = self.fleet.gusts, self.fleet.readings, self.senses
        if not (gusts.size or readings.size or senses.fast.size):
            return
        for i in np.flatnonzero(flies & (self.fleet.flights["periods"] % DRAWN == 0)):
            noise = self._noise[i]
            if gusts.size:
                gusts[i] = noise.standard_normal((DRAWN, 3))
            if readings.size:
                readings[i] = noise.standard_normal((DRAWN, 5))
            if senses.fast.size:
                # Columns of poses stay zero: these vehicles have no motion capture.
                senses.fast[i, :, :POSE_POSITION_NOISE] = in_fine_steps(
                    noise.standard_normal((DRAWN, POSE_POSITION_NOISE))
                )
                senses.slow[i] = in_fine_steps(noise.standard_normal((DRAWN // SLOW_PERIODS, SLOW_COLUMNS)))
                senses.slow[i, :, DROPOUT : DROPOUT + AIDS] = noise.random((DRAWN // SLOW_PERIODS, AIDS))

    def _part(self, actions: Array, thread: int, turn: Turn) -> None:
        self._step(self.fleet, self.senses, actions, self.outcome, self._scratch[thread], turn)

    def _compile(self) -> None:
        """Compile the step, or read it from disk; nothing moves."""
        if not is_compiled(self._step):
            parts = [*PARTS_BY_COMMANDS, *(PARTS_BY_CONTROLLER if self.kind == AS_REFERENCE else ())]
            self._first.warm_up_parts(parts)
            with compiling(1):
                self._part(np.zeros((self.count, ACTED)), 0, Turn(0, 0, 0, self.kind))


def _is_sensed(observe: str) -> bool:
    if observe not in {"truth", "sensors"}:
        raise SitlError(f"observe {observe!r}: there is truth, sensors")
    return observe == "sensors"


def _check_counts(count: int, options: BatchOptions) -> None:
    if count < 1 or options.threads < 1:
        raise SitlError(f"{count} environments by {options.threads} threads: both must be at least 1")
    if options.periods < 1 or DRAWN % options.periods:
        raise SitlError(f"periods {options.periods}: must divide {DRAWN}")
    if options.controller not in CONTROLLERS:
        raise SitlError(f"controller {options.controller!r}: there is {', '.join(CONTROLLERS)}")
