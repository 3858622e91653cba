"""Cases flown: the vehicle of a case, its orders at their times, its end, and what is measured of it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.names import FAILURE_UNITS
from protocol.plans.plan import MissionItem
from sitl import (
    PERIOD,
    Aircraft,
    Airframe,
    Body,
    Configuration,
    DivergedError,
    Law,
    Navigation,
    Quaternion,
    Recording,
    Regime,
    Register,
    SensorSet,
    Settings,
    Simulation,
    SitlError,
    Start,
    Tuning,
    Vector,
    WorldSettings,
    along,
    hover_at,
    leg,
)
from sitl.autopilot.answers import ACCEPTED, Answer
from sitl.autopilot.world import World
from sitl.defaults import HOME
from sitl.design.paparazzi_indi import believed
from sitl.lab.campaigns.flight_table import (
    AT_CRASH,
    AT_GROUND,
    AT_HOME,
    AT_MISSION,
    FAILURES,
    PERIODS_A_SECOND,
    TimedOrder,
)
from sitl.lab.campaigns.measures import FlightSetting, LookWalker, measured
from sitl.lab.campaigns.number_expressions import TIME_NAME, NumberWalker, Value, has_name
from sitl.lab.campaigns.specification import Case, Specification, draw, load_specification
from sitl.lab.studies.seeded_flights import has_finished_mission, waypoint
from sitl.lab.studies.wrong_models import noisier
from sitl.lab.study_options import PAPARAZZI
from sitl.simulation.dispatch import REGISTER
from sitl.simulation.situation import regime
from sitl.simulation.tuning import CONTROLLERS, INDI
from sitl.tools.error_guard import place_of
from sitl.vehicle.aircraft import is_forward

NO_SPEED = -1.0  # of MAV_CMD_DO_CHANGE_SPEED: the throttle stays


class RecordedSimulation(Simulation):
    """A simulation that keeps samples, taken by the compiled loop.

    Args:
        airframe: As of :class:`sitl.Simulation`.
        seconds: How long samples are kept.
        every: Control periods between two.
        others: Arguments of :class:`sitl.Simulation`.
    """

    def __init__(self, airframe: Airframe, seconds: float, every: int, **others: Any) -> None:  # noqa: ANN401
        super().__init__(airframe, **others)
        self._rows = np.zeros(int(seconds * PERIODS_A_SECOND) // every + 2, self._arrays.no_samples.dtype)
        self._kept, self._every = 0, every

    def advance(self, periods: int) -> None:
        """Fly control periods; see :meth:`sitl.Simulation.advance`."""
        try:
            self._kept += self._fly(periods, self._every, self._rows[self._kept :])
        except DivergedError as error:
            self._kept += error.kept
            raise

    def recording(self) -> Recording:
        """The samples so far, the last one of now, if that is finite."""
        kept, now = Recording.of(self._rows[: self._kept], tuple(self.jumps)), self.sample()
        if not np.isfinite(now.position).all():
            return kept
        names = [field.name for field in dataclasses.fields(Recording) if field.name != "jumps"]
        joined = {name: np.concatenate((getattr(kept, name), getattr(now, name))) for name in names}
        return Recording(**joined, jumps=kept.jumps)


class FlownCase(NamedTuple):
    """Result of one case."""

    number: int
    end: str  # condition that ended it, or time, diverged, error
    error: str  # why there are no measures, or not the whole flight; empty if all is well
    measures: tuple[float, ...]  # in the order of the specification; NaN: none


class CaseAircraft(Aircraft):
    """The vehicle of a case, in the air.

    Attributes:
        ended_by: The condition that ended the flight; ``time`` if none did; empty while it flies.
        ended_at: When that was [s].
        forward_at: Times at which it flew forward, if measures ask for that [s].

    Args:
        specification: The campaign.
        case: Of it.
        register: Of the laws that fly it.

    Raises:
        SitlError: A value that was drawn does not fit.
    """

    def __init__(self, specification: Specification, case: Case, register: Register = REGISTER) -> None:
        self.specification, self.case = specification, case
        self.ended_by, self.ended_at, self._settled = "", math.inf, 0
        self._known: dict[str, Value] = case.values | {"seed": float(case.seed)}
        self._numbers, flight = NumberWalker(self._known), specification.flight
        self._due = [one for one in flight.orders if not one.given_if or self._numbers.number(one.given_if)]
        self.forward_at: list[float] = []
        told = " ".join(specification.texts)  # what costs time is looked at where measures ask for it
        self._tells_forward, self._tells_warnings = "FLIGHT." in told, "warned" in told
        self._tells_astray, self._warned, self._astray = "astray" in told, math.nan, 0.0
        self._given_at, self._named = 0.0, {order.name: math.nan for order in flight.orders if order.name}
        self._every, self._after_orders = round(PERIODS_A_SECOND / flight.rate), self._number(flight.after_orders)
        self.recorded = self._vehicle(register)
        world = World(LocalFrame(HOME), specification.files.arena)
        settings = Configuration(Settings(), self.recorded.tuning, WorldSettings())
        self._over_time = {name: text for name, text in flight.parameters.items() if has_name(text, TIME_NAME)}
        super().__init__(self.recorded, world, settings.replaced(self._valued(flight.parameters)), airborne=True)
        if flight.start.law is not None:
            self.recorded.enter(Law[self._word(flight.start.law)])
        self._home = self._point(flight.home.at) if flight.home else (0.0, 0.0, 0.0)

    # Flying

    @property
    def is_over(self) -> bool:
        """Whether the flight has ended and what is flown after that is flown."""
        return bool(self.ended_by) and self._time_left(self.ended_at + self.specification.flight.after) <= 0

    def fly(self) -> None:
        """Fly to the end.

        Raises:
            SitlError: An order is refused, or the simulation leaves the finite numbers.
        """
        while not self.is_over:
            self.advance(self._stretch())

    def advance(self, periods: int) -> None:
        """Fly for control periods, or until the flight is over."""
        flies = self.specification.flight.vehicle.autopilot
        while periods > 0 and not self.is_over:
            if self._over_time and self.vehicle.periods % self._every == 0:
                self.configure(self.configuration.replaced(self._valued(self._over_time, self.vehicle.time)))
            if not flies:
                self._give_orders()
            flown = min(periods, self._stretch())
            super().advance(flown) if flies else self.vehicle.advance(flown)
            periods -= flown
            self._look()

    def _stretch(self) -> int:
        """Control periods until something may have to be done."""
        flight = self.specification.flight
        until = self.ended_at + flight.after if self.ended_by else self._limit()
        looks = any(order.when for order in self._due) or (flight.ends and not self.ended_by)
        if flight.vehicle.autopilot or looks or self._over_time:
            look = self._every - self.vehicle.periods % self._every
            return min(look, max(self._time_left(until), 1))
        later = [order.at for order in self._due if self._time_left(order.at) > 0]
        return max(self._time_left(min([until, *later])), 1)

    def _limit(self) -> float:
        """Latest end of the flight [s]."""
        flight = self.specification.flight
        return flight.seconds if self._due else min(flight.seconds, self._given_at + self._after_orders)

    def _time_left(self, until: float) -> int:
        """Control periods until a time."""
        return round(until * PERIODS_A_SECOND) - self.vehicle.periods

    def _look(self) -> None:
        flight, is_time = self.specification.flight, self.vehicle.periods % self._every == 0
        if is_time and self._tells_forward and is_forward(self.vehicle):
            self.forward_at.append(self.vehicle.time)
        if self.ended_by:
            return
        if is_time and self._tells_astray:
            here, believed = self.vehicle.truth.body.position, self.vehicle.estimate.position
            self._astray = max(self._astray, math.dist(here, believed))
        if self._tells_warnings and math.isnan(self._warned):
            self._listen()
        for order in [one for one in self._due if one.when] if is_time else []:
            if self._time_left(order.at) <= 0 and (self._time_left(order.latest) <= 0 or self._is_so(order.when)):
                self._give(order)
        holding = [end for end in flight.ends if self._holds(end)] if is_time else []
        if holding or self._time_left(self._limit()) <= 0:
            self.ended_by, self.ended_at = (holding or ["time"])[0], self.vehicle.time

    def _listen(self) -> None:
        """Note the first warning, at the look that it comes before; all are left for whoever else reads them."""
        for notice in self.autopilot.notices():
            self.autopilot.say(notice.severity, notice.text)
            if notice.severity <= mavlink.MAV_SEVERITY_WARNING:
                self._warned = -(-self.vehicle.periods // self._every) * self._every * PERIOD

    def _holds(self, end: str) -> bool:
        vehicle, home = self.vehicle, self.specification.flight.home
        if end == AT_MISSION:
            return has_finished_mission(self)
        if end == AT_CRASH:
            return vehicle.crash is not None
        if end == AT_GROUND:
            return vehicle.law.regime is Regime.GROUND
        if end != AT_HOME:
            return self._is_so(end)
        body = vehicle.truth.body
        if home is None or self._due:
            return False
        is_near = math.dist(body.position, self._home) < home.radius and math.hypot(*body.velocity) < home.speed
        self._settled = self._settled + 1 if is_near else 0
        return self._settled * self._every >= home.seconds * PERIODS_A_SECOND

    def _is_so(self, condition: str) -> bool:
        """Whether a condition of the flight holds now."""
        vehicle = self.vehicle
        now: dict[str, Value] = {"time": vehicle.time, TIME_NAME: vehicle.time, "regime": regime(vehicle).name}
        return bool(LookWalker(vehicle.sample(), self.specification.series, self._known | now).number(condition))

    # Orders

    def _decide(self) -> None:
        self._give_orders()
        super()._decide()

    def _give_orders(self) -> None:
        for order in [one for one in self._due if not one.when and self._time_left(one.at) <= 0]:
            self._give(order)

    def _give(self, order: TimedOrder) -> None:
        self._due.remove(order)
        self._given_at, self._warned, self._astray = self.vehicle.time, math.nan, 0.0
        if order.name:
            self._named[order.name] = self._given_at
        answer = self._obey(order)
        if answer is not None and answer.result != ACCEPTED:
            raise SitlError(f"order {order.do!r} at {self._given_at:g} s refused: {answer.text}")

    def _obey(self, order: TimedOrder) -> Answer | None:
        guided, told = self.autopilot.guided, order.told
        asked = {"hold": guided.hold, "land": guided.land, "return": guided.return_to_launch}
        if order.do in asked:
            return asked[order.do]()
        match order.do:
            case "go to":
                return self._go_to(self._point(told["to"]))
            case "fail":
                return self._fail(told)
            case "leg":
                (x, y, z), end = self.vehicle.truth.body.position, self._point(told["to"])
                path = leg((x, y, z), end, self._number(told.get("airspeed", 15.0)))
                self.vehicle.reference = along(self.vehicle.reference, path, self.vehicle.reference.heading)
            case "mission":
                self._begin_mission(told)
            case "enter":
                self.vehicle.enter(Law[self._word(told["law"])])
            case "throw":
                self._throw(told)
            case "set":
                self.configure(self.configuration.replaced(self._valued(told["parameters"])))
        return None

    def _fail(self, told: dict[str, Any]) -> Answer:
        unit, failure = FAILURE_UNITS[self._word(told["unit"])], FAILURES[self._word(told["failure"])]
        answer = self.failures.inject(unit, failure, int(self._number(told.get("instance", 0.0))))
        self.vehicle.faults = self.vehicle.faults._replace(seed=self.case.seed)  # one at random goes its own way
        return answer

    def _go_to(self, point: tuple[float, float, float]) -> Answer | None:
        if self.specification.flight.vehicle.autopilot:
            return self.autopilot.guided.go_to(point)
        self.vehicle.reference = hover_at(point, self.vehicle.reference.heading)
        return None

    def _begin_mission(self, told: dict[str, Any]) -> None:
        items = [waypoint(*(self._number(value) for value in line)) for line in told.get("waypoints", [])]
        if "land" in told:
            place = waypoint(*self._point(told["land"]))
            items.append(dataclasses.replace(place, command=mavlink.MAV_CMD_NAV_LAND))
        if "airspeed" in told:
            speed = (0.0, self._number(told["airspeed"]), NO_SPEED, 0.0)
            change, frame = mavlink.MAV_CMD_DO_CHANGE_SPEED, mavlink.MAV_FRAME_MISSION
            items.insert(0, MissionItem(command=change, frame=frame, params=speed, x=0, y=0, z=0.0))
        self.autopilot.missions.load(items)
        self.autopilot.missions.start()

    def _throw(self, told: dict[str, Any]) -> None:
        body = self.vehicle.truth.body
        velocity = Vector(*self._point(told["velocity"])) if "velocity" in told else body.velocity
        rates = Vector(*self._point(told["rates"])) if "rates" in told else body.rates
        if "axis" in told:
            axis = np.array(self._point(told["axis"]))
            turned = self._number(told.get("rate", 0.0)) * axis / np.linalg.norm(axis)
            rates = Vector(*(float(x) for x in turned))
        attitude = body.attitude
        if "attitude" in told:
            q = np.array([self._number(value) for value in told["attitude"]])
            attitude = Quaternion(*(float(x) for x in q / np.linalg.norm(q)))
        self.vehicle.place(Body(body.position, velocity, attitude, rates))

    # What the case has drawn

    def _vehicle(self, register: Register) -> RecordedSimulation:
        files, flight, wanted = self.specification.files, self.specification.flight, self.specification.flight.vehicle
        controller, start = self._word(wanted.controller), flight.start
        design_model = believed(files.airframe) if controller == PAPARAZZI else files.airframe
        made = RecordedSimulation(
            self.case.airframe(files.airframe),
            flight.seconds + flight.after,
            self._every,
            seed=self.case.seed,
            start=Start(*self._point((start.north, start.west, start.up)), self._number(start.heading), airborne=True),
            tuning=self._tuning(controller),
            design_model=design_model,
            navigation=Navigation(self._word(wanted.navigation)),
            sensors=self._sensors(),
            register=register,
        )
        if not wanted.told:
            made.avionics.sensors = files.sensors  # those that it believes in; they stay as they are
            made.retune(made.tuning)
        return made

    def _tuning(self, controller: str) -> Tuning:
        tuning, alone = tuning_of(controller), self._number(self.specification.flight.vehicle.alone)
        return tuning._replace(v_leave=math.inf) if alone else tuning

    def _sensors(self) -> SensorSet:
        sensors, wanted = self.specification.files.sensors, self.specification.flight.vehicle
        noise = self._number(wanted.noise)
        if wanted.latency is None and noise == 1.0:
            return sensors
        latency = sensors.pipeline.latency if wanted.latency is None else self._number(wanted.latency)
        return noisier(sensors, noise, latency)

    def _number(self, value: Value) -> float:
        return self._numbers.number(value) if isinstance(value, str) else float(value)

    def _word(self, value: Value) -> str:
        return str(self.case.values.get(str(value), value))

    def _valued(self, given: dict[str, Value], time: float = 0.0) -> dict[str, float]:
        numbers = NumberWalker(self._known | {TIME_NAME: time})
        return {name: numbers.number(str(value)) for name, value in given.items()}

    def _point(self, values: tuple[Value, ...]) -> tuple[float, float, float]:
        x, y, z = (self._number(value) for value in values)
        return x, y, z

    # What is measured

    def facts(self, *, diverged: bool) -> dict[str, float]:
        """Numbers of the flight, by name (:data:`sitl.lab.campaigns.measures.FLIGHT_FACTS`)."""
        vehicle, view = self.vehicle, self.view()
        return {
            "time": min(self.ended_at, vehicle.time),
            "energy": vehicle.energy,
            "jumps": float(len(vehicle.jumps)),
            "failsafes": float(sum(jump.target is Law.FAILSAFE for jump in vehicle.jumps)),
            "tilt": view.tilt,
            "crashed": float(vehicle.crash is not None),
            "diverged": float(diverged),
            "landed": float(view.landed),
            "forward": float(is_forward(vehicle)),
            "mission": float(self.ended_by == AT_MISSION),
            "ground": float(self.ended_by == AT_GROUND),
            "home": float(self.ended_by == AT_HOME),
            "cut": float(bool(self.autopilot.terminated)),
            "impact": vehicle.crash.speed if vehicle.crash is not None else 0.0,
            "warned": self._warned,
            "astray": self._astray,
            "seed": float(self.case.seed),
            **self._named,
        }


def tuning_of(controller: str) -> Tuning:
    """The tuning of a controller by its name.

    Raises:
        SitlError: There is no such controller.
    """
    if controller == PAPARAZZI:
        return Tuning(controller=INDI, paparazzi=1)
    if controller not in CONTROLLERS:
        raise SitlError(f"there is no controller {controller!r}; there are {', '.join((*CONTROLLERS, PAPARAZZI))}")
    return Tuning(controller=CONTROLLERS[controller])


def fly_case(specification: Specification, case: Case, register: Register = REGISTER) -> FlownCase:
    """Fly one case, by the laws of a register; an error is kept with it."""
    try:
        return measured_case(CaseAircraft(specification, case, register))
    except Exception as error:  # whatever goes wrong in one of a million flights must not end the rest
        return _failed(specification, case, error)


class ShippedFlight(NamedTuple):
    """One case of a shipped campaign: its measures by name, its end and error."""

    measures: dict[str, float]
    end: str
    error: str


def fly_shipped(name: str, changes: Mapping[str, Any], number: int = 0) -> ShippedFlight:
    """Fly one case of a shipped campaign.

    Args:
        name: Of the campaign.
        changes: Values in place of its file's, by place, such as ``run.seed``.
        number: Of the case.

    Raises:
        SitlError: There is no such campaign, or a value does not fit.
    """
    specification = load_specification(name, changes)
    flown = fly_case(specification, draw(specification, number))
    return ShippedFlight(dict(zip(specification.measures, flown.measures, strict=True)), flown.end, flown.error)


def measured_case(aircraft: CaseAircraft) -> FlownCase:
    """Fly what is left of a case, and measure it.

    Raises:
        SitlError: An order is refused, or a measure has no value.
    """
    s, case, error = aircraft.specification, aircraft.case, ""
    try:
        aircraft.fly()
    except DivergedError as divergence:
        error = str(divergence).split(":", maxsplit=1)[0]
    around, airframe = aircraft.vehicle.surroundings, aircraft.vehicle.airframe
    setting = FlightSetting(around.ground, airframe, frozenset(aircraft.forward_at))
    numbers = case.values | aircraft.facts(diverged=bool(error))
    measures = measured(s.measures, s.series, numbers, aircraft.recorded.recording(), setting)
    return FlownCase(case.number, "diverged" if error else aircraft.ended_by, error, tuple(measures))


def _failed(specification: Specification, case: Case, error: Exception) -> FlownCase:
    text = str(error) if isinstance(error, SitlError) else f"{type(error).__name__} in {place_of(error)}: {error}"
    return FlownCase(case.number, "error", text, (math.nan,) * len(specification.measures))
