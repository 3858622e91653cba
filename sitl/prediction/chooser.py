"""The choice between hovering and flying, as the autopilot makes it for the legs it knows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol, TypeAlias

from protocol.dialect.vocabulary import LegMode
from protocol.ranges import LEGS_AHEAD, MIN_FORWARD_HEIGHT
from sitl.control.reference import Point
from sitl.guidance.legs import MIN_TURN_SPEED
from sitl.guidance.view import VehicleView
from sitl.model.airframe import Airframe
from sitl.model.arithmetic import arctangent, sine_cosine, wrapped
from sitl.model.vectors import level_norm
from sitl.prediction.corners import Leg
from sitl.prediction.mode_choice import Decision, choose_modes
from sitl.prediction.predictor import Abilities
from sitl.simulation.tuning import Tuning

MAX_TOLD = 256  # legs of which the last choice is kept


class LegSettings(Protocol):
    """The pilot's settings about legs; the autopilot's settings have them, among others."""

    @property
    def leg_mode(self) -> int:
        """0 the better one, 1 always hover, 2 forward flight wherever possible."""

    @property
    def min_leg(self) -> float:
        """Shorter legs are hovered [m]."""

    @property
    def leg_time(self) -> float:
        """Time limit per leg [s]; 0: none."""

    @property
    def hover_speed(self) -> float:
        """Horizontal speed limit of the hover [m/s]."""

    @property
    def airspeed(self) -> float:
        """Of the cruise [m/s]."""


class LegEnd(NamedTuple):
    """A point of a chain of legs, and how the leg to it was asked to be flown."""

    p: Point  # world NWU [m]
    asked: LegMode = LegMode.NONE
    seq: int = 65535  # mission item; 65535: none


_LegKey: TypeAlias = tuple[Point, Point | None]  # where a leg ends, and the one after it: it may begin anywhere


def _key(stops: Sequence[LegEnd], i: int) -> _LegKey:
    return stops[i].p, stops[i + 1].p if i + 1 < len(stops) else None


class Chooser:
    """Decides for chains of legs; collects the decisions for the wire.

    A leg that was told to be hovered, or flown, stays so unless the other way is clearly better.

    Attributes:
        airframe: That the laws are designed for.
        tuning: Of the laws; whoever changes theirs changes it here, and the next prediction follows.
        can_fly_forward: Whether the airframe has the trims for it.
    """

    def __init__(self, airframe: Airframe, tuning: Tuning, *, can_fly_forward: bool) -> None:
        self.airframe = airframe
        self.tuning = tuning
        self.can_fly_forward = can_fly_forward
        self._made: list[tuple[int, Decision]] = []
        self._told: dict[_LegKey, LegMode] = {}  # the last choice for each leg, the latest one last

    def made(self) -> list[tuple[int, Decision]]:
        """Decisions since the last call, with the mission item each leg ends at."""
        made, self._made = self._made, []
        return made

    def energy(self, view: VehicleView, start: Point, end: Point, settings: LegSettings, *, flying: bool) -> float:
        """Energy of one leg flown the better way, begun in forward flight or not [J]; records no decision."""
        leg, _ = _leg(start, end, _course(view), view.wind)
        made = choose_modes(
            [leg],
            self._abilities(settings),
            settings.min_leg,
            [LegMode(settings.leg_mode)],
            lead=0.0 if flying else None,
        )[0]
        return made.forward.energy if made.leg_mode is LegMode.FORWARD else made.hover.energy

    def _abilities(self, settings: LegSettings, airspeed: float | None = None) -> Abilities:
        airspeed = settings.airspeed if airspeed is None else airspeed
        return Abilities(
            airframe=self.airframe,
            tuning=self.tuning,
            can_fly_forward=self.can_fly_forward,
            hover_speed=settings.hover_speed,
            airspeed=airspeed,
            deadline=settings.leg_time,
        )

    def choose(
        self, view: VehicleView, start: Point, stops: Sequence[LegEnd], settings: LegSettings, airspeed: float
    ) -> list[Decision]:
        """Decisions for the legs from ``start`` through ``stops``; the first is reported."""
        lead = math.dist(view.p[:2], start[:2]) if view.forward else None
        decisions = self._decide(view.wind, _course(view), start, stops, settings, airspeed, lead)
        self._made.append((stops[0].seq, decisions[0]))
        return decisions

    def predict(
        self, wind: Point, heading: float, start: Point, stops: Sequence[LegEnd], settings: LegSettings
    ) -> list[Decision]:
        """Prediction for legs that begin and end in the hover, and the way to fly them; nobody is told.

        Args:
            wind: World NWU [m/s].
            heading: Before the first leg [rad].
            start: Where it begins, world NWU [m].
            stops: Where each ends; at most ``LEGS_AHEAD`` are looked at.
            settings: Of the pilot.
        """
        return self._decide(wind, heading, start, stops, settings, settings.airspeed, None)

    def _decide(
        self,
        wind: Point,
        heading: float,
        start: Point,
        stops: Sequence[LegEnd],
        settings: LegSettings,
        airspeed: float,
        lead: float | None,
    ) -> list[Decision]:
        abilities = self._abilities(settings, airspeed)
        default = LegMode(settings.leg_mode)
        legs, asked, here = [], [], start
        for stop in stops[:LEGS_AHEAD]:
            leg, heading = _leg(here, stop.p, heading, wind)
            legs.append(leg)
            asked.append(stop.asked or default)
            here = stop.p
        keys = [_key(stops, i) for i in range(len(legs))]
        told = [self._told.get(key, LegMode.NONE) for key in keys]
        made = choose_modes(legs, abilities, settings.min_leg, asked, lead=lead, told=told)
        self._remember(keys, made)
        return made

    def _remember(self, keys: Sequence[_LegKey], made: Sequence[Decision]) -> None:
        """Keep the ways as told."""
        for key, decision in zip(keys, made, strict=True):
            self._told.pop(key, None)
            self._told[key] = decision.leg_mode
        for key in list(self._told)[:-MAX_TOLD]:
            del self._told[key]

    def orbits(self, height: float, asked: LegMode, settings: LegSettings) -> bool:
        """Whether a circle with a radius is flown forward."""
        wanted = asked or LegMode(settings.leg_mode)
        return self.can_fly_forward and wanted is not LegMode.HOVER and height >= MIN_FORWARD_HEIGHT


def _course(view: VehicleView) -> float:
    """Course over the ground in forward flight, heading else [rad]."""
    is_flying = view.forward and level_norm(view.v[0], view.v[1]) > MIN_TURN_SPEED
    return arctangent(view.v[1], view.v[0]) if is_flying else view.heading


def _leg(start: Point, end: Point, heading: float, wind: Point) -> tuple[Leg, float]:
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = level_norm(dx, dy)
    course = arctangent(dy, dx) if length > 0.1 else heading
    s, c = sine_cosine(course)
    leg = Leg(
        distance=length,
        climb=end[2] - start[2],
        tail_wind=wind[0] * c + wind[1] * s,
        cross_wind=wind[1] * c - wind[0] * s,
        turn=wrapped(course - heading),
        height=min(start[2], end[2]),
    )
    return leg, course
