"""Memory of a plan between ticks, apart from its progress through its blocks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from protocol.flight_plans.expressions.evaluation import Scalar
from protocol.flight_plans.plan_geometry import EnuPoint
from protocol.flight_plans.plan_names import NAV_CLIMB, NAV_DESCENT
from sitl.autopilot.flight_plan.aims import PLAN_ORIGIN, Aim, bearing_between
from sitl.autopilot.flight_plan.plan_inputs import MotorRequest

__all__ = ["FIRST_VALUES", "HOVER_THROTTLE", "THROTTLE_CLIMB", "CircleCount", "PlanMemory", "RoutineMemory"]

FIRST_VALUES: Final[Mapping[str, Scalar]] = {
    "sweep": 25.0,  # between the lines of a survey [m]
    "nav_takeoff_direction": 0.0,
    "nav_climb": 0.0,
    "fp_pitch": 0.0,
    "fp_throttle": 0.0,
    "fp_climb": 0.0,
    "rectangle_survey_sweep_num": 0,
    "PolySurveySweepNum": 0,
    "PolySurveySweepBackNum": 0,
}
HOVER_THROTTLE = 0.5  # share of full throttle that neither climbs nor sinks
THROTTLE_CLIMB = 4.0  # vertical speed by throttle beyond that [m/s]


@dataclass(slots=True)
class CircleCount:
    """Turns about a centre since the stage began."""

    turned: float = 0.0  # clockwise [rad]
    qdr: float = 0.0  # bearing from the centre [rad]
    _is_begun: bool = False

    def update(self, centre: EnuPoint, p: EnuPoint) -> None:
        """One tick about a centre."""
        qdr = bearing_between(centre, p)
        if self._is_begun:
            self.turned += math.remainder(qdr - self.qdr, math.tau)
        self.qdr, self._is_begun = qdr, True


@dataclass(slots=True)
class RoutineMemory:
    """Memory of the navigation routines from call to call."""

    pattern: object = None  # what is flown: of a line, a flower, a survey, a take-off or a landing
    waypoints: tuple[str, ...] = ()  # that a set-up named
    part: int = -1  # of the pattern
    begun: int = 0  # parts of all patterns
    called: float = -math.inf  # when a take-off or landing was called last [s]


@dataclass(slots=True)
class PlanMemory:
    """Variables of the plan and of the autopilot that a plan can change."""

    variables: dict[str, Scalar] = field(default_factory=dict)  # of the plan
    whole: frozenset[str] = frozenset()  # those of them that hold whole numbers
    radius: float | None = None  # nav.radius [m]; None: that of the settings
    climb_speed: float = NAV_CLIMB  # [m/s]
    descent_speed: float = NAV_DESCENT  # [m/s]
    heading: float | None = None  # clockwise from north [rad]; None: the vehicle's own
    max_speed: float | None = None  # of the hover [m/s]; None: that of the settings
    forces_forward: bool = False  # legs are flown forward where possible
    throttle: float = 0.0  # that of the last aim, 0..1
    baseleg_qdr: float = 0.0  # [rad]
    ground_height: float = 0.0  # of the ground reference above the plan's ground [m]
    altitude_shift: float = 0.0  # of the altitude reference [m]
    detects_ground: bool = False
    circle: CircleCount = field(default_factory=CircleCount)
    last_point: EnuPoint = PLAN_ORIGIN  # where the last leg ended
    flight_time: float = 0.0  # [s]
    motors: list[MotorRequest] = field(default_factory=list)  # asked for since the last look
    routines: RoutineMemory = field(default_factory=RoutineMemory)
    wanted: Aim | None = None  # by a navigation routine, until the executor takes it
    extras: dict[str, Scalar] = field(default_factory=lambda: dict(FIRST_VALUES))  # variables without an effect here
