"""A flight that tells all: steps of place, height and heading in the hover, then a weave of legs in forward flight.

The vehicle's own laws fly it; only references change. Each step of a reference is answered by all actuators, and the
turns to either side, climbs and airspeeds come in different orders, so that their effects can be told apart.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from sitl import Reference, Vector, along, hover_at, leg
from sitl.control.reference import Point

EXCITATION_HEIGHT = 60.0  # of the hover [m]
HOVER_SPEED = 4.0  # [m/s]
HOVER_STEP_TIME, LEG_STEP_TIME, ENTRY_TIME, STOP_TIME = 2.5, 3.0, 6.0, 8.0  # of each step [s]
LEG_REACH = 200.0  # longer than what is flown of one [m]
DEEPEST = 10.0  # below the first height that the last hover may be [m]


class HoverStep(NamedTuple):
    """One place to hover at, from where the flight began."""

    offset: Point  # world NWU [m]
    heading: float  # [deg]


class LegStep(NamedTuple):
    """One leg from wherever the vehicle is."""

    turn: float  # to the left of the leg before [deg]
    slope: float  # of its climb [-]
    airspeed: float  # [m/s]


HOVER_STEPS = (
    HoverStep((3.0, 0.0, 0.0), 0.0),
    HoverStep((3.0, 3.0, 2.0), 60.0),
    HoverStep((-3.0, 3.0, -2.0), 150.0),
    HoverStep((0.0, -3.0, 2.0), -120.0),
    HoverStep((-3.0, 0.0, -2.0), -30.0),
    HoverStep((3.0, 0.0, 0.0), 0.0),
    HoverStep((0.0, 0.0, 0.0), 0.0),
)
LEG_STEPS = (
    LegStep(0.0, 0.0, 14.0),
    LegStep(25.0, 0.04, 14.0),
    LegStep(-25.0, -0.04, 14.0),
    LegStep(30.0, 0.04, 17.0),
    LegStep(30.0, -0.04, 17.0),
    LegStep(-20.0, 0.04, 15.0),
    LegStep(40.0, -0.04, 15.0),
    LegStep(40.0, 0.04, 12.0),
    LegStep(-20.0, -0.04, 12.0),
    LegStep(40.0, 0.04, 13.0),
    LegStep(40.0, -0.04, 16.0),
    LegStep(-20.0, 0.04, 16.0),
    LegStep(30.0, -0.04, 14.0),
    LegStep(40.0, 0.04, 14.0),
    LegStep(30.0, -0.04, 18.0),
)


class ReferenceStep(NamedTuple):
    """A reference and how long it is kept [s]."""

    reference: Reference
    seconds: float


class Excitation:
    """The references of the flight, one after the other.

    Args:
        hover: Steps in the hover.
        legs: Steps in forward flight; none: it stays in the hover.
    """

    def __init__(self, hover: Sequence[HoverStep] = HOVER_STEPS, legs: Sequence[LegStep] = LEG_STEPS) -> None:
        self._hover, self._legs = hover, legs
        self.position = Vector(0.0, 0.0, EXCITATION_HEIGHT)  # of the vehicle: whoever flies keeps it up to date

    def steps(self) -> Iterator[ReferenceStep]:
        """Each step, made when the one before has been flown."""
        place = hover_at((0.0, 0.0, EXCITATION_HEIGHT), 0.0)
        for step in self._hover:
            x, y, z = step.offset
            place = hover_at((x, y, EXCITATION_HEIGHT + z), math.radians(step.heading), HOVER_SPEED)
            yield ReferenceStep(place, HOVER_STEP_TIME)
        heading = 0.0
        for number, one in enumerate(self._legs):
            heading += math.radians(one.turn)
            here = self.position
            ahead = (LEG_REACH * math.cos(heading), LEG_REACH * math.sin(heading), LEG_REACH * one.slope)
            there = (here.x + ahead[0], here.y + ahead[1], here.z + ahead[2])
            path = leg(here, there, one.airspeed)
            yield ReferenceStep(along(place, path, heading), LEG_STEP_TIME if number else ENTRY_TIME)
        if self._legs:
            here = self.position
            end = (here.x, here.y, max(here.z, EXCITATION_HEIGHT - DEEPEST))
            yield ReferenceStep(hover_at(end, heading, HOVER_SPEED), STOP_TIME)
