"""An aircraft whose day happens to it: the operator acts and things fail at their times, flown fast or live."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.flight_plans.plan_geometry import EnuPoint
from protocol.frames import LocalFrame
from protocol.names.labels import FAILURE_TYPES, FAILURE_UNITS
from protocol.names.modes import Mode
from sitl.autopilot.answers import ACCEPTED, DENIED, Answer
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import World
from sitl.day.day_file import Day, DayError, OperatorAction, PlannedFailure
from sitl.defaults import AIRFRAME, HOME
from sitl.enclosure.arena_files import load_arena
from sitl.errors import SitlError
from sitl.model.airframe_files import load
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.avionics import Navigation
from sitl.simulation.simulation import Simulation
from sitl.tools.flight_plan_files import load_checked_plan
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.parameters import Configuration, WorldSettings


class DayEvent(NamedTuple):
    """Something that happened in the day."""

    time: float  # [s]
    kind: str  # operator, failure, block or end
    text: str
    is_refused: bool = False


class _Due(NamedTuple):
    at: float
    kind: str
    text: str
    do: Callable[[], Answer]


class DayAircraft(Aircraft):
    """The vehicle of a day, on the ground of its arena.

    Attributes:
        day: What was asked for.
        happened: What has happened so far.

    Args:
        day: The day.

    Raises:
        SitlError: A file that the day names cannot be used.
    """

    def __init__(self, day: Day) -> None:
        self.day = day
        self.happened: list[DayEvent] = []
        self._block = ""
        arena = load_arena(day.arena)
        if arena.wall is not None:
            arena = arena._replace(wall=arena.wall._replace(schedule=day.schedule, bursts=day.bursts))
        elif day.schedule or day.bursts:
            raise DayError(f"wind: the arena '{arena.name}' has no wind wall")
        planned = load_checked_plan(day.plan, day.plan_names) if day.plan is not None else None
        vehicle = Simulation(
            load(day.airframe or AIRFRAME).parameters,
            seed=day.seed,
            navigation=day.navigation or (Navigation.MOCAP if arena.has_net else Navigation.SENSORS),
            sensors=load_sensors(None if day.sensors is None else str(day.sensors)),
            aligned=False,
        )
        origin = HOME if planned is None else planned.origin
        settings = Configuration(Settings(), vehicle.tuning, WorldSettings()).replaced(day.parameters)
        super().__init__(vehicle, World(LocalFrame(origin), arena), settings)
        if planned is not None:
            planned.require_flown()
            self.autopilot.flight_plan.load(planned.check, planned.mapping)
            self.autopilot.set_mode(Mode.FLIGHT_PLAN)
        due = [_Due(a.at, "operator", _words(a), partial(self._act, a)) for a in day.actions]
        for failure in day.failures:
            due += self._failing(failure)
        due.append(_Due(day.duration, "end", "The day is over; the vehicle flies on", lambda: Answer(ACCEPTED)))
        self._due = sorted(due, key=lambda event: event.at)

    @property
    def is_over(self) -> bool:
        """Whether the day has ended, or the vehicle is broken."""
        return self.vehicle.time >= self.day.duration or self.vehicle.crash is not None

    def _decide(self) -> None:
        while self._due and self._due[0].at <= self.vehicle.time:
            event = self._due.pop(0)
            answer = event.do()
            refused = answer.result != ACCEPTED
            text = f"{event.text}: {answer.text or 'refused'}" if refused else event.text
            self.happened.append(DayEvent(self.vehicle.time, event.kind, text, refused))
            self.autopilot.say(mavlink.MAV_SEVERITY_WARNING if refused else mavlink.MAV_SEVERITY_INFO, text)
        super()._decide()
        self._note_block()

    def _note_block(self) -> None:
        executor = self.autopilot.flight_plan.executor
        if executor is not None and executor.flow.present.name != self._block:
            self._block = executor.flow.present.name
            self.happened.append(DayEvent(self.vehicle.time, "block", f"block {self._block}"))

    def _act(self, action: OperatorAction) -> Answer:
        autopilot = self.autopilot
        if action.kind == "block":
            return autopilot.flight_plan.jump_to_block(action.name)
        if action.kind == "waypoint":
            return autopilot.flight_plan.move_waypoint(action.name, EnuPoint(*action.value))
        if action.kind == "variable":
            return autopilot.flight_plan.set_variable(action.name, action.value[0])
        if action.kind == "parameter":
            return self._set_parameter(action.name, action.value[0])
        if action.kind == "arm":
            return autopilot.arming.arm() if action.value[0] else autopilot.arming.disarm()
        if action.name not in Mode.__members__:
            return Answer(DENIED, f"there is no mode {action.name}: there are {', '.join(Mode.__members__)}")
        return autopilot.set_mode(Mode[action.name])

    def _set_parameter(self, name: str, value: float) -> Answer:
        try:
            self.configure(self.configuration.replaced({name: value}))
        except SitlError as error:
            return Answer(DENIED, str(error))
        return Answer(ACCEPTED)

    def _failing(self, failure: PlannedFailure) -> list[_Due]:
        words = failure.unit if failure.instance == 0 else f"{failure.unit} {failure.instance}"

        def inject(kind: str) -> Callable[[], Answer]:
            return lambda: self.failures.inject(FAILURE_UNITS[failure.unit], FAILURE_TYPES[kind], failure.instance)

        begins = _Due(failure.at, "failure", f"failure: {words} {failure.failure}", inject(failure.failure))
        heals = _Due(failure.at + failure.lasts, "failure", f"failure over: {words}", inject("ok"))
        return [begins, heals]


def _words(action: OperatorAction) -> str:
    if action.kind == "arm":
        return "operator arms" if action.value[0] else "operator disarms"
    if action.kind == "waypoint":
        east, north, up = action.value
        return f"operator moves {action.name} to {east:g} m east, {north:g} m north, {up:g} m up"
    if action.kind in {"variable", "parameter"}:
        return f"operator sets {action.name} to {action.value[0]:g}"
    return f"operator: {action.kind} {action.name}"
