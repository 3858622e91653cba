"""Aims of the stages that lead to no waypoint: set-points, sticks, attitudes, and another aircraft."""

from __future__ import annotations

import math

from protocol.flight_plans.evaluation import evaluate
from protocol.flight_plans.expressions import Expression, VariableName
from protocol.flight_plans.flight_plan import AttitudeStage, EnuPoint, FollowStage, GuidedStage, ManualStage, XyzStage
from sitl.autopilot.flight_plan.aims import Aim, AimKey, bearing_between, qdr_point
from sitl.autopilot.flight_plan.name_values import NameValues
from sitl.autopilot.flight_plan.navigation_modules.guided_aims import guided_aim
from sitl.autopilot.flight_plan.operator_view import AimKind
from sitl.guidance.moving_reference import from_heading_axes

__all__ = ["FreeAims", "FreeStage"]

FreeStage = AttitudeStage | FollowStage | GuidedStage | ManualStage | XyzStage
GRAVITY = 9.81  # [m/s2]
FULL_COMMAND = 9600.0  # of a manual stage: MAX_PPRZ
FULL_TURN = math.radians(30.0)  # of the heading by a full yaw command, as by a full stick [rad/s]
MAX_LEAN = math.radians(60.0)  # of an attitude; larger angles count as this [rad]
SAME_LEAN = math.radians(1.0)  # a bank that changes by less goes on with its turn [rad]
FOLLOW_LAG = 1.34  # by which the linear hover law trails a moving point [s]


class FreeAims:
    """Makes the aims of one plan's stages without waypoints.

    Args:
        names: Of the plan in flight.

    Attributes:
        hindrance: Why the last aim only holds; empty if it does what its stage says.
    """

    def __init__(self, names: NameValues) -> None:
        self._names = names
        self.begin(AimKey(), names.p)

    def begin(self, key: AimKey, begun: EnuPoint) -> None:
        """Another stage is in force, which began there."""
        self._key, self._begun, self.hindrance = key, begun, ""
        self._guided: Aim | None = None
        self._turn: tuple[float, Aim] | None = None  # bank [rad], and the turn that it makes
        self._lost_at: EnuPoint | None = None  # where the vehicle was when the aircraft it follows was lost

    def aim(self, stage: FreeStage) -> Aim:
        """Aim of a stage at this tick; attitudes and commands leave the altitude to their vertical mode."""
        self.hindrance = ""
        match stage:
            case GuidedStage():
                return self._set_point(stage)
            case XyzStage():
                return self._by_sticks()
            case FollowStage():
                return self._behind(stage)
            case ManualStage():
                return self._by_commands(stage)
            case AttitudeStage():
                return self._leaning(stage)

    def _by_sticks(self) -> Aim:
        north, west, up = self._names.inputs.stick_velocity
        return Aim(AimKind.VELOCITY, self._key, end=EnuPoint(-west, north, self._begun.z), climb=up)

    def _behind(self, stage: FollowStage) -> Aim:
        """Behind another aircraft on its course, and above it; hold while it is not heard."""
        names = self._names
        system = self._value(stage.ac_id)
        found = names.inputs.others.at(system, names.inputs.view.time)
        if found is None:
            self._lost_at = self._lost_at or names.p
            self.hindrance = f"aircraft {system:g} is not heard"
            return Aim(AimKind.POINT, self._key, end=self._lost_at, is_hovered=True)
        self._lost_at = None
        target, v = names.inputs.frame.to_plan(found.p), names.inputs.frame.turned(found.v)
        course = bearing_between(names.p, target) if found.course is None else found.course
        behind = qdr_point(target, math.degrees(course) + 180.0, self._value(stage.distance))
        up = max(target.z + self._value(stage.height), names.plan.security_height)
        ahead = EnuPoint(behind.x + FOLLOW_LAG * v.x, behind.y + FOLLOW_LAG * v.y, up)
        return Aim(AimKind.POINT, self._key, end=ahead, is_hovered=True)

    def _by_commands(self, stage: ManualStage) -> Aim:
        """Roll and pitch commands as a velocity to the right and forward, as sticks are flown."""
        roll, pitch, yaw = (
            min(max(self._value(command) / FULL_COMMAND, -1.0), 1.0) for command in (stage.roll, stage.pitch, stage.yaw)
        )
        speed = self._names.inputs.settings.hover_speed / max(math.hypot(roll, pitch), 1.0)
        aim = self._moving(-pitch * speed, roll * speed)  # a positive pitch is nose up: backwards
        return aim._replace(turn_rate=FULL_TURN * yaw)

    def _leaning(self, stage: AttitudeStage) -> Aim:
        """The level attitude stays; a bank in forward flight turns, a lean of the hover accelerates as it does."""
        roll, pitch = self._angle(stage.roll), self._angle(stage.pitch)
        if self._names.inputs.view.forward and roll != 0.0:
            return self._banked(roll)
        if roll == 0.0 and pitch == 0.0:
            return Aim(AimKind.POINT, self._key, end=self._begun)
        gained = GRAVITY * self._names.position.stage_time
        forward, right = -gained * math.tan(pitch), gained * math.tan(roll)
        share = min(1.0, self._names.inputs.settings.hover_speed / max(math.hypot(forward, right), 1e-9))
        return self._moving(share * forward, share * right)

    def _banked(self, roll: float) -> Aim:
        """The circle of a coordinated turn, beside the vehicle."""
        if self._turn is not None and abs(self._turn[0] - roll) < SAME_LEAN:
            return self._turn[1]
        names = self._names
        airspeed, course = names.inputs.settings.airspeed, math.atan2(names.v.x, names.v.y)
        radius = airspeed**2 / (GRAVITY * math.tan(roll))
        centre = qdr_point(names.p, math.degrees(course) + 90.0, radius)
        before = None if self._turn is None else self._turn[1].key
        key = self._key if before is None else before._replace(part=before.part + 1)
        self._turn = roll, Aim(AimKind.ARC, key, end=centre._replace(z=self._begun.z), radius=radius)
        return self._turn[1]

    def _moving(self, forward: float, right: float) -> Aim:
        """A velocity in the axes of the heading [m/s], at the altitude where the stage began."""
        north, west, _ = from_heading_axes((forward, -right, 0.0), self._names.inputs.view.heading)
        return Aim(AimKind.VELOCITY, self._key, end=EnuPoint(-west, north, self._begun.z))

    def _set_point(self, stage: GuidedStage) -> Aim:
        """A set-point of the guided mode: north, east, down and yaw, each as its flag says; offsets count once."""
        if self._guided is not None:
            return self._guided
        values = [self._value(command) for command in stage.commands[:4]]
        values += [0.0] * (4 - len(values))
        self._guided = guided_aim(self._names, int(self._value(stage.flags)), values)._replace(key=self._key)
        return self._guided

    def _angle(self, expression: Expression | None) -> float:
        """An angle of an attitude [rad]; ``auto`` is none."""
        if expression is None or expression.tree == VariableName("auto"):
            return 0.0
        return min(max(math.radians(self._value(expression)), -MAX_LEAN), MAX_LEAN)

    def _value(self, expression: Expression | None) -> float:
        return 0.0 if expression is None else float(evaluate(expression.tree, self._names))
