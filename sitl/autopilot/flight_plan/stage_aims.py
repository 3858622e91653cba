"""The aim of a stage: where it sends the vehicle, and whether it has arrived."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TypeAlias

from protocol.flight_plans.attributes import NameUse
from protocol.flight_plans.evaluation import Scalar, UnknownNameError, evaluate
from protocol.flight_plans.expressions import Expression, VariableName
from protocol.flight_plans.flight_plan import (
    AttitudeStage,
    CircleStage,
    EightStage,
    EnuPoint,
    FollowStage,
    GoStage,
    GuidedStage,
    HeadingStage,
    HomeStage,
    ManualStage,
    OvalStage,
    Stage,
    StayStage,
    SurveyStage,
    XyzStage,
)
from protocol.flight_plans.plan_limits import is_loop_waypoint
from protocol.flight_plans.plan_names import plan_constants
from sitl.autopilot.flight_plan.aims import Aim, AimKey, AimKind, bearing_between, qdr_point
from sitl.autopilot.flight_plan.patterns import (
    Piece,
    PieceTracker,
    eight_pieces,
    guided_aim,
    oval_pieces,
    survey_pieces,
)
from sitl.autopilot.flight_plan.plan_functions import NameValues, approaches
from sitl.autopilot.flight_plan.plan_state import HOVER_THROTTLE, THROTTLE_CLIMB
from sitl.guidance.setpoints import from_heading_axes

# Aims of the stages that lead to no waypoint: set-points, sticks, attitudes, and another aircraft.


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


MAX_CLIMB = 2.0  # vertical speed that a throttle is taken for [m/s]
Shape: TypeAlias = tuple[EnuPoint, EnuPoint, float]
MovingStage = (
    GoStage
    | StayStage
    | CircleStage
    | OvalStage
    | EightStage
    | SurveyStage
    | HeadingStage
    | AttitudeStage
    | ManualStage
    | HomeStage
)


class StageAims:
    """Makes the aims of one plan; the stage in force keeps its pattern here.

    Args:
        names: Of the plan in flight.
    """

    def __init__(self, names: NameValues) -> None:
        self._names = names
        self._key = AimKey()
        self._begun = EnuPoint(0.0, 0.0, 0.0)  # where the vehicle was when the stage began
        self._from = EnuPoint(0.0, 0.0, 0.0)  # where the last leg ended when the stage began
        self._tracker: PieceTracker | None = None
        self._shape: Shape | None = None  # of the pattern
        self._free = FreeAims(names)

    def begin(self, entries: int) -> None:
        """Have a stage in force.

        Args:
            entries: How many stages have been entered: another number is another stage.
        """
        if entries != self._key.stage:
            memory = self._names.memory
            self._key, self._begun, self._from = AimKey(entries), self._names.p, memory.last_point
            self._tracker, self._shape = None, None
            self._free.begin(self._key, self._begun)
            memory.circle = type(memory.circle)()

    @property
    def hindrance(self) -> str:
        """The reason why the last aim only holds; empty if it does as its stage says."""
        return self._free.hindrance

    def aim(self, stage: Stage) -> Aim | None:
        """Aim of a stage at this tick; None: it has arrived, or there is nothing to fly."""
        match stage:
            case GoStage():
                return self._go(stage)
            case StayStage():
                return self._stay(stage)
            case CircleStage() | OvalStage() | EightStage() | SurveyStage():
                return self._pattern(stage)
            case HeadingStage():
                return self._heading(stage)
            case AttitudeStage() | ManualStage():
                return self._with_vertical(stage, self._free.aim(stage))
            case GuidedStage() | XyzStage() | FollowStage():
                return self._free.aim(stage)
            case _:
                return self._home()

    # Kinds of stages

    def _stay(self, stage: StayStage) -> Aim:
        aim = Aim(AimKind.POINT, self._key, end=self._place(stage.wp), name=self._waypoint(stage.wp))
        return self._with_vertical(stage, aim)

    def _pattern(self, stage: CircleStage | OvalStage | EightStage | SurveyStage) -> Aim:
        match stage:
            case CircleStage():
                return self._circle(stage)
            case OvalStage():
                return self._oval(stage)
            case EightStage():
                return self._eight(stage)
            case _:
                return self._survey(stage)

    def _go(self, stage: GoStage) -> Aim | None:
        names, to = self._names, self._place(stage.wp, stage.wp_qdr, stage.wp_dist)
        routed = stage.hmode == "route" or stage.from_wp is not None
        start = self._from if stage.from_wp is None else self._place(stage.from_wp, stage.from_qdr, stage.from_dist)
        seconds = self._value(stage.approaching_time, 0.0)
        if stage.exceeding_time is not None:
            seconds = -self._value(stage.exceeding_time, 0.0)
        if approaches(names.p, names.v, to, start if routed else None, seconds, names.inputs.settings.acceptance):
            names.memory.last_point = to._replace(z=self._altitude(stage, to))
            return None
        kind = AimKind.LEG if stage.hmode == "route" else AimKind.POINT
        name = "" if stage.wp_qdr is not None else self._waypoint(stage.wp)
        return self._with_vertical(stage, Aim(kind, self._key, start=start, end=to, name=name))

    def _circle(self, stage: CircleStage) -> Aim:
        centre = self._place(stage.wp, stage.wp_qdr, stage.wp_dist)
        radius = self._value(stage.radius, 0.0)
        self._names.memory.circle.update(centre, self._names.p, radius)
        aim = Aim(AimKind.ARC, self._key, end=centre, radius=radius)
        return self._with_vertical(stage, aim._replace(name=self._waypoint(stage.wp)))

    def _oval(self, stage: OvalStage) -> Aim:
        one, two, radius = self._place(stage.p1), self._place(stage.p2), self._value(stage.radius, 0.0)
        self._track((one, two, radius), oval_pieces)
        return self._with_vertical(stage, self._piece(one))

    def _eight(self, stage: EightStage) -> Aim:
        one, two, radius = self._place(stage.center), self._place(stage.turn_around), self._value(stage.radius, 0.0)
        self._track((one, two, radius), eight_pieces)
        return self._with_vertical(stage, self._piece(one))

    def _survey(self, stage: SurveyStage) -> Aim:
        one, two, grid = self._place(stage.wp1), self._place(stage.wp2), self._value(stage.grid, 0.0)
        self._track((one, two, grid), partial(survey_pieces, north_south=stage.orientation != "WE"))
        return self._piece(one)

    def _track(self, shape: Shape, make: Callable[[EnuPoint, EnuPoint, float], tuple[Piece, ...]]) -> None:
        """Go on in a pattern; one whose points or size have changed goes on in the same piece."""
        if self._shape != shape:
            self._shape, index = shape, 0 if self._tracker is None else self._tracker.index
            self._tracker = PieceTracker(make(*shape), index)

    def _piece(self, centre: EnuPoint) -> Aim:
        """The piece of a pattern that is flown now."""
        tracker = self._tracker
        if tracker is None or not tracker.pieces:
            return Aim(AimKind.POINT, self._key, end=centre)
        piece = tracker.at(self._names.p)
        key = self._key._replace(part=tracker.index)
        if piece.radius == 0.0:
            return Aim(AimKind.LEG, key, start=piece.start, end=piece.end, followers=tracker.followers())
        self._names.memory.circle.update(piece.end, self._names.p, piece.radius)
        return Aim(AimKind.ARC, key, end=piece.end, radius=piece.radius)

    def _heading(self, stage: HeadingStage) -> Aim:
        course = math.radians(self._value(stage.course, 0.0))
        aim = Aim(AimKind.COURSE, self._key, start=self._begun, end=self._begun, course=course)
        return self._with_vertical(stage, aim)

    def _home(self) -> Aim:
        names = self._names
        high = float(plan_constants(names.plan)["HOME_MODE_HEIGHT"])
        return Aim(AimKind.POINT, self._key, end=names.waypoints.home._replace(z=high), name="HOME")

    # What they share

    def _with_vertical(self, stage: MovingStage, aim: Aim) -> Aim:
        """The aim with the altitude or vertical speed of a stage's vertical mode."""
        memory, mode = self._names.memory, getattr(stage, "vmode", None)
        memory.throttle = HOVER_THROTTLE
        if mode == "climb":
            climb = self._value(getattr(stage, "climb", None), 0.0)
            memory.throttle = min(max(HOVER_THROTTLE + climb / THROTTLE_CLIMB, 0.0), 1.0)
            return aim._replace(climb=climb)
        if mode == "throttle":
            memory.throttle = min(max(self._value(getattr(stage, "throttle", None), 0.0), 0.0), 1.0)
            climb = (memory.throttle - HOVER_THROTTLE) * THROTTLE_CLIMB
            return aim._replace(climb=min(max(climb, -MAX_CLIMB), MAX_CLIMB))
        if mode == "xyz":
            return aim._replace(climb=self._names.inputs.stick_velocity[2])
        high = self._altitude(stage, aim.end)
        low = aim.start.z if mode == "glide" else high
        return aim._replace(start=aim.start._replace(z=low), end=aim.end._replace(z=high))

    def _altitude(self, stage: object, point: EnuPoint) -> float:
        """Above the plan's ground [m]: that of the stage, or of its waypoint."""
        names = self._names
        alt, height = getattr(stage, "alt", None), getattr(stage, "height", None)
        if height is not None:
            return self._value(height, 0.0) + names.memory.ground_height
        if alt is not None:
            return self._value(alt, 0.0) - names.plan.ground_alt - names.memory.altitude_shift
        return point.z

    def _place(self, use: NameUse, qdr: Expression | None = None, distance: Expression | None = None) -> EnuPoint:
        point = self._names.waypoints.at(self._waypoint(use))
        if qdr is None and distance is None:
            return point
        return qdr_point(point, self._value(qdr, 0.0), self._value(distance, 0.0))

    def _waypoint(self, use: NameUse) -> str:
        """The waypoint that a stage names, or that the counter of a loop numbers."""
        names = self._names
        name = names.waypoints.known(use.name)
        if is_loop_waypoint(use):
            name = names.waypoints.name_of(names.loop_value(use.name[1:]))
        if name is None:
            raise UnknownNameError(f"there is no waypoint {use.name}")
        return name

    def _value(self, expression: Expression | None, default: float) -> float:
        value: Scalar = default if expression is None else evaluate(expression.tree, self._names)
        return float(value)
