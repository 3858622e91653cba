"""Navigation routines: functions that a plan calls again and again, and that fly the vehicle meanwhile.

Each leaves what it wants in ``memory.wanted``, which the executor takes as the plan's aim, and gives whether it
goes on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from protocol.flight_plans.evaluation import Argument, Scalar, UnknownNameError
from protocol.flight_plans.flight_plan import EnuPoint, plan_frame
from protocol.frames import Geodetic
from sitl.autopilot.flight_plan.aims import Aim, AimKey, AimKind, qdr_point
from sitl.autopilot.flight_plan.patterns import (
    AF_HEIGHT,
    FLARE_HEIGHT,
    Descent,
    Move,
    Piece,
    PieceTracker,
    SkidLanding,
    TakeOff,
    guided_aim,
)
from sitl.autopilot.flight_plan.plan_state import MotorRequest, PlanState, named_point, number, waypoint_name
from sitl.autopilot.flight_plan.survey_patterns import Flower, PolygonSurvey, RectangleSurvey, line_pieces
from sitl.autopilot.flight_plan.variable_values import read_variable

Routine = Callable[[PlanState, Sequence[Argument]], Scalar]
RESTART = 1.0  # a take-off or landing that was not called for so long begins anew [s]
GUIDED = -2  # the part of a set-point
WE = 1  # lines east and west


def _fly(state: PlanState, piece: Piece, part: int, followers: tuple[EnuPoint, ...] = ()) -> Scalar:
    """Want a leg, an arc or, of a leg without length, a point."""
    routines = state.memory.routines
    if part != routines.part:
        routines.part = part
        routines.begun += 1
    key = AimKey(-1, routines.begun)
    if piece.radius:
        state.memory.circle.update(piece.end, state.p, piece.radius)
        aim = Aim(AimKind.ARC, key, end=piece.end, radius=piece.radius)
    elif piece.start == piece.end:
        aim = Aim(AimKind.POINT, key, end=piece.end)
    else:
        aim = Aim(AimKind.LEG, key, start=piece.start, end=piece.end, followers=followers)
    state.memory.wanted = aim
    return 1


def _begin(state: PlanState, routine: object) -> Scalar:
    """Have a routine that a later call flies."""
    state.memory.routines.pattern, state.memory.routines.part = routine, -1
    return 0


def _line_setup(state: PlanState, arguments: Sequence[Argument]) -> Scalar:  # noqa: ARG001
    return _begin(state, None)


def _line_run(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    routines = state.memory.routines
    tracker = routines.pattern if isinstance(routines.pattern, PieceTracker) else None
    pieces = line_pieces(
        named_point(state, arguments[0]), named_point(state, arguments[1]), float(number(arguments[2]))
    )
    if not pieces:
        raise UnknownNameError("a line without length, or turns without a radius")
    tracker = PieceTracker(pieces) if tracker is None else tracker
    tracker.pieces = pieces
    routines.pattern = tracker
    piece = tracker.at(state.p)
    return _fly(state, piece, tracker.index, () if piece.radius else tracker.followers())


def _flower_setup(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    centre, edge = waypoint_name(state, arguments[0]), waypoint_name(state, arguments[1])
    state.memory.routines.waypoints = (centre, edge)
    return _begin(state, Flower.begun(state.waypoints.at(centre), state.waypoints.at(edge), state.p))


def _flower_run(state: PlanState, arguments: Sequence[Argument]) -> Scalar:  # noqa: ARG001
    flower = state.memory.routines.pattern
    if not isinstance(flower, Flower):
        raise UnknownNameError("nav_flower_setup() was not called before")
    centre, edge = map(state.waypoints.at, state.memory.routines.waypoints)
    turn = float(read_variable(state, "nav.radius"))
    piece = flower.at(centre, edge, state.p, turn, state.inputs.settings.acceptance)
    return _fly(state, piece, flower.part)


def _rectangle_setup(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    north_south = number(arguments[3]) != WE
    grid = abs(float(number(arguments[2])))
    corners = named_point(state, arguments[0]), named_point(state, arguments[1])
    state.memory.heading = 0.0 if north_south else 0.5 * math.pi
    state.memory.extras["rectangle_survey_sweep_num"] = 0
    return _begin(state, RectangleSurvey.begun(*corners, max(grid, 0.1), state.p, north_south=north_south))


def _rectangle_run(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    survey = state.memory.routines.pattern
    if not isinstance(survey, RectangleSurvey):
        raise UnknownNameError("nav_survey_rectangle_rotorcraft_setup() was not called before")
    corners = named_point(state, arguments[0]), named_point(state, arguments[1])
    piece = survey.at(*corners, state.p, state.inputs.settings.acceptance)
    state.memory.extras["rectangle_survey_sweep_num"] = survey.sweeps
    return _fly(state, piece, survey.part)


def _osam_setup(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    first, size, spacing, orientation = arguments
    return _polygon_begin(state, _corners(state, first, size), spacing, math.radians(number(orientation)))


def _osam_towards(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    first, size, spacing, other = arguments
    corners = _corners(state, first, size)
    return _polygon_begin(state, corners, spacing, _direction(corners[0], named_point(state, other)))


def _hybrid_setup(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    first, orientation, size, spacing, _ = arguments
    return _polygon_begin(state, _corners(state, first, size), spacing, math.radians(number(orientation)))


def _hybrid_towards(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    first, other, size, spacing, _ = arguments
    corners = _corners(state, first, size)
    return _polygon_begin(state, corners, spacing, _direction(corners[0], named_point(state, other)))


def _bearing_setup(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    """Sweeps along a bearing [deg], at an altitude above the sea, once over the polygon."""
    first, size, bearing, spacing, _, _, altitude = arguments
    up = float(number(altitude)) - state.plan.ground_alt
    corners = [corner._replace(z=up) for corner in _corners(state, first, size)]
    return _polygon_begin(state, corners, spacing, math.radians(90.0 - number(bearing)))


def _corners(state: PlanState, first: Argument, size: Argument) -> list[EnuPoint]:
    """So many waypoints from a first one on."""
    begin, count = round(number(first)), round(number(size))
    if not 3 <= count <= len(state.waypoints.names):
        raise UnknownNameError(f"{count} corners are no polygon of this plan")
    return [named_point(state, begin + index) for index in range(count)]


def _direction(start: EnuPoint, end: EnuPoint) -> float:
    """Anticlockwise from east [rad]."""
    return math.atan2(end.y - start.y, end.x - start.x)


def _polygon_begin(state: PlanState, corners: Sequence[EnuPoint], spacing: Argument, orientation: float) -> Scalar:
    survey = PolygonSurvey.begun(corners, float(number(spacing)), orientation)
    if survey is None:
        raise UnknownNameError("the polygon has no area to sweep")
    _count_sweeps(state, survey)
    return _begin(state, survey)


def _polygon_run(state: PlanState, arguments: Sequence[Argument]) -> Scalar:  # noqa: ARG001
    survey = state.memory.routines.pattern
    if not isinstance(survey, PolygonSurvey):
        raise UnknownNameError("no survey of a polygon was set up before")
    piece = survey.at(state.p, state.inputs.settings.acceptance)
    _count_sweeps(state, survey)
    return _fly(state, piece, survey.part)


def _polygon_run_once(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    """As the others, but it ends at the polygon's end."""
    goes_on = _polygon_run(state, arguments)
    survey = state.memory.routines.pattern
    return goes_on if isinstance(survey, PolygonSurvey) and survey.returns == 0 else 0


def _count_sweeps(state: PlanState, survey: PolygonSurvey) -> None:
    state.memory.extras["PolySurveySweepNum"] = survey.sweeps
    state.memory.extras["PolySurveySweepBackNum"] = survey.returns


def _skid_setup(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    state.memory.routines.waypoints = (waypoint_name(state, arguments[0]), waypoint_name(state, arguments[1]))
    radius = float(number(arguments[2]))
    if radius == 0.0:
        raise UnknownNameError("a circle without a radius")
    return _begin(state, SkidLanding(radius))


def _skid_run(state: PlanState, arguments: Sequence[Argument]) -> Scalar:  # noqa: ARG001
    landing = state.memory.routines.pattern
    if not isinstance(landing, SkidLanding):
        raise UnknownNameError("nav_skid_landing_setup() was not called before")
    af, td = map(state.waypoints.at, state.memory.routines.waypoints)
    move = landing.at(af, td, state.p, state.memory.descent_speed, state.inputs.settings.acceptance)
    if move.climb is not None and state.inputs.view.landed:
        state.memory.motors.append(MotorRequest.STOP)
    return _make(state, move)


def _make(state: PlanState, move: Move) -> Scalar:
    _fly(state, move.piece, move.part)
    if state.memory.wanted is not None:
        state.memory.wanted = state.memory.wanted._replace(climb=move.climb)
    return 1


def _resumed(state: PlanState, kind: type[object]) -> object | None:
    """The take-off or landing that was flown up to now; None: another begins."""
    routines, now = state.memory.routines, state.inputs.view.time
    is_old = now - routines.called > RESTART
    routines.called = now
    return routines.pattern if isinstance(routines.pattern, kind) and not is_old else None


def _take_off(state: PlanState) -> Scalar:
    now, armed = state.inputs.view.time, state.inputs.armed
    ascent = _resumed(state, TakeOff)
    if not isinstance(ascent, TakeOff):
        ascent = TakeOff(state.p, now)
        _begin(state, ascent)
    if not armed:
        state.memory.motors.append(MotorRequest.START)
    move = ascent.at(state.p, now, state.memory.climb_speed, armed=armed)
    if move is None:
        _begin(state, None)
        return 0
    return _make(state, move)


def _take_off_from_waypoint(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    """The waypoint comes to where the vehicle rises; its altitude stays."""
    name, goes_on = waypoint_name(state, arguments[0]), _take_off(state)
    ascent = state.memory.routines.pattern
    if isinstance(ascent, TakeOff) and ascent.begun == state.inputs.view.time:
        state.waypoints.move(name, EnuPoint(state.p.x, state.p.y, state.waypoints.at(name).z))
    return goes_on


def _land(state: PlanState, td: EnuPoint, af: EnuPoint) -> Scalar:
    """Land at a point [m above the plan's ground], from above another."""
    descent = _resumed(state, Descent)
    if not isinstance(descent, Descent):
        high = td.z + FLARE_HEIGHT
        descent = Descent(td._replace(z=high), af._replace(z=high + AF_HEIGHT))
        _begin(state, descent)
    settings, landed = state.inputs.settings, state.inputs.view.landed
    move = descent.at(state.p, state.memory.descent_speed, settings.acceptance, landed=landed)
    if move is None:
        state.memory.motors.append(MotorRequest.STOP)
        _begin(state, None)
        return 0
    return _make(state, move)


def _land_at_waypoint(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    return _land(state, named_point(state, arguments[0]), named_point(state, arguments[1]))


def _land_here(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    here = state.p._replace(z=float(number(arguments[0])))
    return _land(state, here, here)


def _land_at_location(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    """At a latitude and longitude [deg], approached along a bearing [deg] from a distance [m]."""
    high, lat, lon, bearing, distance = (float(number(argument)) for argument in arguments[:5])
    if not (abs(lat) <= 90.0 and abs(lon) <= 180.0):
        raise UnknownNameError(f"{lat:g}, {lon:g} are not on the globe")
    north, east, _ = plan_frame(state.plan).to_ned(Geodetic(lat, lon, state.plan.ground_alt))
    td = EnuPoint(east, north, high)
    return _land(state, td, qdr_point(td, bearing, distance))


def _guided(state: PlanState, arguments: Sequence[Argument]) -> Scalar:
    flags, values = int(number(arguments[0])), [float(number(argument)) for argument in arguments[1:]]
    aim = guided_aim(state, flags, values)
    routines = state.memory.routines
    if (routines.pattern, routines.part) != (aim.kind, GUIDED):  # else the same set-point, a little later
        routines.pattern, routines.part, routines.begun = aim.kind, GUIDED, routines.begun + 1
    state.memory.wanted = aim._replace(key=AimKey(-1, routines.begun))
    return 0


ROUTINE_VALUES: Final[Mapping[str, Routine]] = {
    "nav_line_setup": _line_setup,
    "nav_line_init": _line_setup,
    "nav_line_run": _line_run,
    "nav_line": _line_run,
    "nav_flower_setup": _flower_setup,
    "nav_flower_start": _flower_setup,
    "nav_flower_run": _flower_run,
    "nav_survey_rectangle_rotorcraft_setup": _rectangle_setup,
    "nav_survey_rectangle_rotorcraft_run": _rectangle_run,
    "nav_survey_poly_osam_setup": _osam_setup,
    "nav_survey_poly_osam_start": _osam_setup,
    "nav_survey_poly_osam_setup_towards": _osam_towards,
    "nav_survey_poly_osam_run": _polygon_run,
    "nav_survey_hybrid_setup_orientation": _hybrid_setup,
    "nav_survey_hybrid_setup_towards": _hybrid_towards,
    "nav_survey_hybrid_run": _polygon_run,
    "nav_survey_polygon_setup": _bearing_setup,
    "nav_survey_polygon_run": _polygon_run_once,
    "nav_skid_landing_setup": _skid_setup,
    "nav_skid_landing_run": _skid_run,
    "nav_takeoff_from_wp": _take_off_from_waypoint,
    "nav_takeoff_from_here": lambda state, _: _take_off(state),
    "nav_takeoff_from_loc": lambda state, _: _take_off(state),
    "nav_land_at_wp": _land_at_waypoint,
    "nav_land_here": _land_here,
    "nav_land_at_loc": _land_at_location,
    "autopilot_guided_update": _guided,
}
