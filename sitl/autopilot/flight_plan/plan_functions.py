"""The functions that a plan may call: what each gives, and what it changes in the plan's memory."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final, TypeAlias

from protocol.flight_plans.evaluation import Argument, Scalar, UnknownNameError
from protocol.flight_plans.flight_plan import EnuPoint, inside_polygon, plan_frame
from protocol.flight_plans.plan_limits import MAX_COORDINATE
from protocol.flight_plans.plan_names import WAYPOINT_FIELDS, WAYPOINTS, block_number
from protocol.frames import Geodetic
from sitl.autopilot.flight_plan.aims import away, bearing_between
from sitl.autopilot.flight_plan.plan_state import MotorRequest, PlanState, named_point, number, waypoint_name
from sitl.autopilot.flight_plan.routines import ROUTINE_VALUES
from sitl.autopilot.flight_plan.variable_values import battery_voltage, has_fix, read_variable, store_variable

PlanFunction: TypeAlias = Callable[[PlanState, Sequence[Argument]], Scalar | Mapping[str, float]]
CLOSE_DEGREES = 10.0  # angles nearer than this are close
CLOSE_RADIANS = 0.0177
NAV_MODE = 13  # the only mode that a plan may ask for: it is in force while the plan flies


def _here(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    """A waypoint comes to where the vehicle is; its altitude stays."""
    name = waypoint_name(state, arguments[0])
    state.waypoints.move(name, EnuPoint(state.p.x, state.p.y, state.waypoints.at(name).z))
    return 0


def _here_and_high(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    state.waypoints.move(waypoint_name(state, arguments[0]), state.p)
    return 0


def _copy(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    state.waypoints.move(waypoint_name(state, arguments[0]), named_point(state, arguments[1]))
    return 0


def _copy_level(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    name, other = waypoint_name(state, arguments[0]), named_point(state, arguments[1])
    state.waypoints.move(name, EnuPoint(other.x, other.y, state.waypoints.at(name).z))
    return 0


def _set_height(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    """As Paparazzi's ``waypoint_set_alt``: the height above the origin, for all its name."""
    name = waypoint_name(state, arguments[0])
    state.waypoints.move(name, state.waypoints.at(name)._replace(z=float(number(arguments[1]))))
    return 0


def _motors(state: PlanState, *, on: bool) -> Scalar:
    state.memory.motors.append(MotorRequest.START if on else MotorRequest.STOP)
    return 0


def _set_mode(state: PlanState, arguments: Sequence[Argument]) -> Scalar:  # noqa: ARG001
    if number(arguments[0]) != NAV_MODE:
        raise UnknownNameError(f"mode {arguments[0]} is not flown by a plan")
    return 0


def _detect_ground(state: PlanState, *, begin: bool) -> Scalar:
    if begin:
        state.memory.detects_ground = True
        return 0
    return int(state.memory.detects_ground and state.inputs.view.landed)


def _ground_reference(state: PlanState, arguments: Sequence[Argument]) -> Scalar:  # noqa: ARG001
    state.memory.ground_height = state.p.z
    return 0


def _heading_to(state: PlanState, x: float, y: float) -> Scalar:
    state.memory.heading = bearing_between(state.p, EnuPoint(x, y, 0.0))
    return 0


def _turn_heading(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    target = str(arguments[0])
    turned = read_variable(state, target) + number(arguments[1])
    store_variable(state, target, math.remainder(turned, math.tau))
    return 0


def _set_heading(state: PlanState, heading: float) -> Scalar:
    state.memory.heading = math.remainder(heading, math.tau)
    return 0


def _max_speed(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    state.memory.max_speed = max(float(number(arguments[0])), 0.0)
    return 0


def _baseleg(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    """Put the centre of the last turn beside the approach fix, so that the turn ends on the way to the touchdown."""
    af, td = named_point(state, arguments[0]), named_point(state, arguments[1])
    radius, length = float(number(arguments[3])), max(away(af, td), 1e-6)
    x, y = (td.x - af.x) / length, (td.y - af.y) / length
    state.waypoints.move(waypoint_name(state, arguments[2]), EnuPoint(af.x + y * radius, af.y - x * radius, af.z))
    state.memory.baseleg_qdr = math.pi - math.atan2(-y, -x) + (math.pi if radius < 0.0 else 0.0)
    return 0


def _inside(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    corners = state.waypoints.corners(str(arguments[0]))
    return int(inside_polygon(corners, number(arguments[1]), number(arguments[2])))


def _block_index(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    number = block_number(state.plan, str(arguments[0]))
    if number is None:
        raise UnknownNameError(f"there is no block {arguments[0]!r}")
    return number


def _close(a: Scalar, b: Scalar) -> Scalar:
    return int(abs(math.remainder(a - b, 360.0)) < CLOSE_DEGREES)


def approaches(p: EnuPoint, v: EnuPoint, to: EnuPoint, start: EnuPoint | None, seconds: float, radius: float) -> bool:
    """Whether a vehicle arrives at a point.

    Args:
        p: Where it is.
        v: Its velocity [m/s].
        to: Where it goes.
        start: Where the leg began: the line normal to it at its end counts as well; None: not.
        seconds: The place that counts is that of so many seconds ahead, negative: behind.
        radius: Nearer than this is there [m].
    """
    there = EnuPoint(p.x + seconds * v.x, p.y + seconds * v.y, p.z)
    if away(there, to) < radius:
        return True
    if start is None:
        return False
    dx, dy = to.x - start.x, to.y - start.y
    return dx * dx + dy * dy > 0.0 and (to.x - there.x) * dx + (to.y - there.y) * dy < 0.0


def _approaching(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    to, radius = named_point(state, arguments[0]), state.inputs.settings.acceptance
    start = named_point(state, arguments[1]) if len(arguments) == 3 else None
    return int(approaches(state.p, state.v, to, start, float(number(arguments[-1])), radius))


def _pure(function: Callable[..., Scalar]) -> PlanFunction:
    """A function of numbers alone."""
    return lambda _, arguments: function(*map(number, arguments))


def _without_arguments(function: Callable[[PlanState], Scalar | Mapping[str, float]]) -> PlanFunction:
    """A function without arguments."""
    return lambda state, _: function(state)


def _euler(state: PlanState) -> Mapping[str, float]:
    view = state.inputs.view
    return {"phi": 0.0, "theta": view.tilt if view.forward else 0.0, "psi": math.remainder(-view.heading, math.tau)}


def _ned(point: EnuPoint) -> Mapping[str, float]:
    return {"x": point.y, "y": point.x, "z": -point.z}


def _square_root(x: Scalar) -> Scalar:
    return math.sqrt(x)


def _nothing(state: PlanState, arguments: Sequence[Argument]) -> Scalar:  # noqa: ARG001
    """Zero, for functions that need no value: the vehicle knows it by itself."""
    return 0


def _geodetic(state: PlanState, argument: Argument) -> Geodetic:
    point = named_point(state, argument)
    return plan_frame(state.plan).to_geodetic((point.y, point.x, -point.z))


FUNCTION_VALUES: Final[Mapping[str, PlanFunction]] = {
    **ROUTINE_VALUES,
    "GpsFixValid": _without_arguments(lambda n: int(has_fix(n))),
    "GpsIsLost": _without_arguments(lambda n: int(not has_fix(n))),
    "RadioControlIsLost": _without_arguments(lambda n: int(n.inputs.radio_lost)),
    "NavKillThrottle": _without_arguments(lambda n: _motors(n, on=False)),
    "NavResurrect": _without_arguments(lambda n: _motors(n, on=True)),
    "autopilot_set_motors_on": lambda n, a: _motors(n, on=bool(number(a[0]))),
    "autopilot_set_kill_throttle": lambda n, a: _motors(n, on=not number(a[0])),
    "autopilot_throttle_killed": _without_arguments(lambda n: int(not n.inputs.armed)),
    "autopilot_set_in_flight": _nothing,
    "autopilot_get_motors_on": _without_arguments(lambda n: int(n.inputs.armed)),
    "autopilot_set_mode": _set_mode,
    "NavBlockTime": _without_arguments(lambda n: int(n.position.block_time)),
    "GetPosAlt": _without_arguments(lambda n: n.altitude),
    "GetPosHeight": _without_arguments(lambda n: n.height),
    "GetPosX": _without_arguments(lambda n: n.p.x),
    "GetPosY": _without_arguments(lambda n: n.p.y),
    "GetAltRef": _without_arguments(lambda n: n.plan.ground_alt + n.memory.ground_height + n.memory.altitude_shift),
    "nav_is_in_flight": _without_arguments(lambda n: int(not n.inputs.view.landed)),
    "autopilot_in_flight": _without_arguments(lambda n: int(not n.inputs.view.landed)),
    "NavStartDetectGround": _without_arguments(lambda n: _detect_ground(n, begin=True)),
    "NavDetectGround": _without_arguments(lambda n: _detect_ground(n, begin=False)),
    "NavSetGroundReferenceHere": _ground_reference,
    "NavSetAltitudeReferenceHere": _ground_reference,
    "ins_reset_altitude_ref": _ground_reference,
    "ins_reset_vertical_pos": _ground_reference,
    "nav_reset_alt": _ground_reference,
    "nav_reset_reference": _ground_reference,
    "ins_reset_local_origin": _nothing,
    "ins_reset_utm_zone_here": _nothing,
    "RCLost": _without_arguments(lambda n: int(n.inputs.radio_lost)),
    "waypoint_get_lat_deg": lambda n, a: _geodetic(n, a[0]).lat_deg,
    "waypoint_get_lon_deg": lambda n, a: _geodetic(n, a[0]).lon_deg,
    "NavCircleCount": _without_arguments(lambda n: abs(n.memory.circle.turned) / math.tau),
    "NavCircleCountNoRewind": _without_arguments(lambda n: abs(n.memory.circle.turned) / math.tau),
    "NavQdrCloseTo": lambda n, a: _close(math.degrees(n.memory.circle.qdr), number(a[0])),
    "NavCourseCloseTo": lambda n, a: _close(math.degrees(math.atan2(n.v.x, n.v.y)), number(a[0])),
    "nav_set_heading_current": _without_arguments(lambda n: _set_heading(n, -n.inputs.view.heading)),
    "nav_set_heading_deg": lambda n, a: _set_heading(n, math.radians(number(a[0]))),
    "nav_set_heading_rad": lambda n, a: _set_heading(n, number(a[0])),
    "nav_set_heading_towards": lambda n, a: _heading_to(n, number(a[0]), number(a[1])),
    "nav_set_heading_towards_waypoint": lambda n, a: _heading_to(n, *named_point(n, a[0])[:2]),
    "increase_nav_heading": _turn_heading,
    "guidance_h_SetMaxSpeed": _max_speed,
    "PowerVoltage": _without_arguments(battery_voltage),
    "stateGetPositionEnu_f": _without_arguments(lambda n: n.p._asdict()),
    "stateGetPositionNed_f": _without_arguments(lambda n: _ned(n.p)),
    "stateGetSpeedEnu_f": _without_arguments(lambda n: n.v._asdict()),
    "stateGetSpeedNed_f": _without_arguments(lambda n: _ned(n.v)),
    "stateGetNedToBodyEulers_f": _without_arguments(_euler),
    "stateGetHorizontalSpeedNorm_f": _without_arguments(lambda n: math.hypot(n.v.x, n.v.y)),
    "stateGetHorizontalSpeedDir_f": _without_arguments(lambda n: math.atan2(n.v.x, n.v.y)),
    "stateGetAirspeed_f": _without_arguments(lambda n: math.dist(n.inputs.view.v, n.inputs.view.wind)),
    "IndexOfBlock": _block_index,
    "Inside": _inside,
    "NavSetWaypointHere": _here,
    "NavSetWaypointPosAndAltHere": _here_and_high,
    "NavCopyWaypoint": _copy,
    "NavCopyWaypointPositionOnly": _copy_level,
    "WaypointX": lambda n, a: named_point(n, a[0]).x,
    "WaypointY": lambda n, a: named_point(n, a[0]).y,
    "WaypointAlt": lambda n, a: named_point(n, a[0]).z + n.plan.ground_alt,
    "waypoint_get_x": lambda n, a: named_point(n, a[0]).x,
    "waypoint_get_y": lambda n, a: named_point(n, a[0]).y,
    "waypoint_set_alt": _set_height,
    "waypoint_get_alt": lambda n, a: named_point(n, a[0]).z + n.plan.ground_alt,
    "GetDistanceToWaypoint": lambda n, a: away(n.p, named_point(n, a[0])),
    "NavApproaching": _approaching,
    "NavApproachingFrom": _approaching,
    "nav_compute_baseleg": _baseleg,
    "LessThan": _pure(lambda a, b: int(a < b)),
    "MoreThan": _pure(lambda a, b: int(a > b)),
    "And": _pure(lambda a, b: int(a != 0 and b != 0)),
    "Or": _pure(lambda a, b: int(a != 0 or b != 0)),
    "Not": _pure(lambda a: int(a == 0)),
    "Min": _pure(min),
    "Max": _pure(max),
    "fmin": _pure(lambda a, b: float(min(a, b))),
    "fmax": _pure(lambda a, b: float(max(a, b))),
    "CloseDegAngles": _pure(_close),
    "CloseRadAngles": _pure(lambda a, b: int(abs(math.remainder(a - b, math.tau)) < CLOSE_RADIANS)),
    "DegOfRad": _pure(math.degrees),
    "RadOfDeg": _pure(math.radians),
    "fabs": _pure(lambda a: float(abs(a))),
    "fabsf": _pure(lambda a: float(abs(a))),
    "abs": _pure(lambda a: abs(int(a))),
    "sin": _pure(math.sin),
    "sinf": _pure(math.sin),
    "cos": _pure(math.cos),
    "cosf": _pure(math.cos),
    "tan": _pure(math.tan),
    "tanf": _pure(math.tan),
    "atan2": _pure(math.atan2),
    "atan2f": _pure(math.atan2),
    "sqrt": _pure(_square_root),
    "sqrtf": _pure(_square_root),
    "floor": _pure(lambda a: float(math.floor(a))),
    "ceil": _pure(lambda a: float(math.ceil(a))),
}


# The table of names that a plan's expressions are evaluated against.


class NameValues(PlanState):
    """Names of one plan in flight."""

    def value(self, name: str) -> Scalar:
        """The value of a variable or constant; raises UnknownNameError."""
        return read_variable(self, name)

    def store(self, name: str, value: Scalar) -> None:
        """Set a variable of the plan, or one of the autopilot; raises UnknownNameError."""
        store_variable(self, name, value)

    def item(self, name: str, index: Scalar, member: str) -> Scalar:
        """A coordinate of a waypoint, as an item of the array of all of them; raises UnknownNameError."""
        coordinate = WAYPOINT_FIELDS.get(member) if name == WAYPOINTS else None
        point = self.waypoints.at(waypoint_name(self, index))
        if coordinate is None:
            raise UnknownNameError(f"{name}[].{member}: no such array")
        return {"x": point.x, "y": point.y, "z": point.z, "alt": point.z + self.plan.ground_alt}[coordinate]

    def move(self, index: Scalar, coordinate: str, value: Scalar) -> None:
        """Set one coordinate of a waypoint [m]; raises UnknownNameError.

        Args:
            index: Number of the waypoint.
            coordinate: ``x``, ``y``, ``z`` above the plan's ground, or ``alt`` above the sea.
            value: [m].
        """
        name = waypoint_name(self, index)
        if not math.isfinite(value) or abs(value) > MAX_COORDINATE:
            raise UnknownNameError(f"waypoint {name} stays: {value:g} is no coordinate")
        if coordinate == "alt":
            coordinate, value = "z", value - self.plan.ground_alt
        self.waypoints.move(name, self.waypoints.at(name)._replace(**{coordinate: float(value)}))

    def loop_value(self, name: str) -> Scalar:
        """The counter of a loop."""
        if name not in self.loops:
            raise UnknownNameError(f"${name}: no enclosing loop has this counter")
        return self.loops[name]

    def call(self, name: str, arguments: Sequence[Argument]) -> Scalar | Mapping[str, float]:
        """Value of a function call in the plan."""
        meaning = self.mapping.functions.get(name, name)
        if not isinstance(meaning, str):
            return meaning
        if meaning.startswith("Inside") and self.plan.sector(meaning.removeprefix("Inside")) is not None:
            return FUNCTION_VALUES["Inside"](self, [meaning.removeprefix("Inside"), *arguments])
        if meaning not in FUNCTION_VALUES or meaning == "Inside":
            raise UnknownNameError(f"{name}(): no such function of this autopilot")
        return FUNCTION_VALUES[meaning](self, arguments)
