"""Inputs of a flight plan at one tick, and its requests to the autopilot."""

from __future__ import annotations

from enum import Enum, auto
from typing import NamedTuple

from sitl.autopilot.flight_plan.other_aircraft import OtherAircraft
from sitl.autopilot.flight_plan.plan_frame import PlanFrame
from sitl.autopilot.safety.world import World
from sitl.autopilot.settings import Settings
from sitl.control.reference import Point
from sitl.guidance.view import VehicleView
from sitl.prediction.chooser import Chooser

__all__ = ["MotorRequest", "PlanInputs"]

NOBODY = OtherAircraft()


class MotorRequest(Enum):
    """A plan's request to the motors."""

    START = auto()
    STOP = auto()


class PlanInputs(NamedTuple):
    """The vehicle and its autopilot, as they are at one tick."""

    view: VehicleView
    world: World
    settings: Settings
    chooser: Chooser | None = None  # None: every leg is hovered
    armed: bool = False
    flying: bool = False  # whether it is to be in the air
    datalink_time: float = 0.0  # since the ground station was heard [s]
    stick_velocity: Point = (0.0, 0.0, 0.0)  # that the sticks ask for, world NWU [m/s]; zero without any
    radio_lost: bool = False  # sticks were heard, and stopped
    others: OtherAircraft = NOBODY  # that may be followed
    frame: PlanFrame = PlanFrame()  # where the plan lies
