"""Names that a plan uses: functions and variables of an autopilot, a user's meanings for more, and fixed values."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from protocol.flight_plans.evaluation import Argument, Scalar, UnknownNameError
from protocol.flight_plans.flight_plan import HOME_BLOCK, FlightPlan
from protocol.flight_plans.xml_elements import FlightPlanError, Place
from protocol.tools.files import decode_text


class FunctionShape(NamedTuple):
    """Signature of a function."""

    least: int
    most: int
    waypoints: tuple[int, ...] = ()  # which arguments are waypoints
    changes: tuple[int, ...] = ()  # which are variables to change


def _shapes(count: int, *names: str) -> dict[str, FunctionShape]:
    return {name: FunctionShape(count, count) for name in names}


FUNCTIONS: Final[Mapping[str, FunctionShape]] = {
    **_shapes(
        0,
        *("GpsFixValid", "GpsIsLost", "RadioControlIsLost", "NavKillThrottle", "NavResurrect", "NavBlockTime"),
        *("GetPosAlt", "GetPosHeight", "GetPosX", "GetPosY", "GetAltRef", "nav_is_in_flight", "autopilot_in_flight"),
        *("NavStartDetectGround", "NavDetectGround", "NavSetGroundReferenceHere", "NavSetAltitudeReferenceHere"),
        *("ins_reset_altitude_ref", "NavCircleCount", "NavCircleCountNoRewind", "nav_set_heading_current"),
        *("PowerVoltage", "autopilot_get_motors_on", "stateGetHorizontalSpeedNorm_f", "stateGetAirspeed_f"),
        *("stateGetHorizontalSpeedDir_f", "stateGetPositionEnu_f", "stateGetPositionNed_f", "stateGetSpeedEnu_f"),
        *("stateGetSpeedNed_f", "stateGetNedToBodyEulers_f", "ins_reset_local_origin", "ins_reset_vertical_pos"),
        *("ins_reset_utm_zone_here", "nav_reset_reference", "nav_reset_alt", "RCLost", "autopilot_throttle_killed"),
        *("nav_line_setup", "nav_line_init", "nav_flower_run", "nav_survey_poly_osam_run", "nav_skid_landing_run"),
        *("nav_survey_hybrid_run", "nav_survey_polygon_run"),
    ),
    **_shapes(
        1,
        *("IndexOfBlock", "NavQdrCloseTo", "NavCourseCloseTo", "DegOfRad", "RadOfDeg", "fabs", "fabsf", "abs", "Not"),
        *("sin", "sinf", "cos", "cosf", "tan", "tanf", "sqrt", "sqrtf", "floor", "ceil", "nav_set_heading_deg"),
        *("nav_set_heading_rad", "guidance_h_SetMaxSpeed", "autopilot_set_mode", "autopilot_set_motors_on"),
        *("autopilot_set_in_flight", "autopilot_set_kill_throttle"),
    ),
    **_shapes(
        2,
        *("LessThan", "MoreThan", "And", "Or", "Min", "Max", "fmin", "fmax", "atan2", "atan2f", "CloseDegAngles"),
        *("CloseRadAngles", "nav_set_heading_towards"),
    ),
    **{
        name: FunctionShape(1, 1, (0,))
        for name in (
            *("NavSetWaypointHere", "NavSetWaypointPosAndAltHere", "WaypointX", "WaypointY", "WaypointAlt"),
            *("nav_set_heading_towards_waypoint", "waypoint_get_x", "waypoint_get_y", "waypoint_get_alt"),
            *("GetDistanceToWaypoint", "waypoint_get_lat_deg", "waypoint_get_lon_deg"),
        )
    },
    "autopilot_guided_update": FunctionShape(5, 5),
    "waypoint_set_alt": FunctionShape(2, 2, (0,)),
    "nav_line_run": FunctionShape(3, 3, (0, 1)),
    "nav_line": FunctionShape(3, 3, (0, 1)),
    "nav_flower_setup": FunctionShape(2, 2, (0, 1)),
    "nav_flower_start": FunctionShape(2, 2, (0, 1)),
    "nav_survey_rectangle_rotorcraft_setup": FunctionShape(4, 4, (0, 1)),
    "nav_survey_rectangle_rotorcraft_run": FunctionShape(2, 2, (0, 1)),
    "nav_survey_poly_osam_setup": FunctionShape(4, 4, (0,)),
    "nav_survey_poly_osam_start": FunctionShape(4, 4, (0,)),
    "nav_survey_poly_osam_setup_towards": FunctionShape(4, 4, (0, 3)),
    "nav_survey_hybrid_setup_orientation": FunctionShape(5, 5, (0,)),
    "nav_survey_hybrid_setup_towards": FunctionShape(5, 5, (0, 1)),
    "nav_survey_polygon_setup": FunctionShape(7, 7, (0,)),
    "nav_skid_landing_setup": FunctionShape(3, 3, (0, 1)),
    "nav_takeoff_from_wp": FunctionShape(1, 2, (0,)),
    "nav_takeoff_from_here": FunctionShape(0, 1),
    "nav_takeoff_from_loc": FunctionShape(2, 3),
    "nav_land_at_wp": FunctionShape(3, 3, (0, 1)),
    "nav_land_here": FunctionShape(2, 2),
    "nav_land_at_loc": FunctionShape(6, 6),
    "NavCopyWaypoint": FunctionShape(2, 2, (0, 1)),
    "NavCopyWaypointPositionOnly": FunctionShape(2, 2, (0, 1)),
    "NavApproachingFrom": FunctionShape(3, 3, (0, 1)),
    "NavApproaching": FunctionShape(2, 2, (0,)),
    "nav_compute_baseleg": FunctionShape(4, 4, (0, 1, 2)),
    "increase_nav_heading": FunctionShape(2, 2, (), (0,)),
}

# Functions that are called again and again and fly the vehicle meanwhile.
NAVIGATION_ROUTINES: Final = frozenset(
    {
        *("nav_line_run", "nav_line", "nav_flower_run", "nav_survey_rectangle_rotorcraft_run"),
        *(
            "nav_survey_poly_osam_run",
            "nav_skid_landing_run",
            "nav_takeoff_from_wp",
            "nav_takeoff_from_here",
            "nav_takeoff_from_loc",
        ),
        *("nav_land_at_wp", "nav_land_here", "nav_land_at_loc", "autopilot_guided_update"),
        *("nav_survey_hybrid_run", "nav_survey_polygon_run"),
    }
)

# A waypoint's coordinates as C's lvalues: WaypointAlt(WP_A), waypoints[WP_A].enu_f.z
WAYPOINTS: Final = "waypoints"
COORDINATES: Final[Mapping[str, str]] = {"WaypointX": "x", "WaypointY": "y", "WaypointAlt": "alt"}
WAYPOINT_FIELDS: Final[Mapping[str, str]] = {
    "x": "x",
    "y": "y",
    "a": "alt",
    "enu_f.x": "x",
    "enu_f.y": "y",
    "enu_f.z": "z",
}

STRUCTURES: Final[Mapping[str, tuple[str, ...]]] = {
    "stateGetPositionEnu_f": ("x", "y", "z"),
    "stateGetPositionNed_f": ("x", "y", "z"),
    "stateGetSpeedEnu_f": ("x", "y", "z"),
    "stateGetSpeedNed_f": ("x", "y", "z"),
    "stateGetNedToBodyEulers_f": ("phi", "theta", "psi"),
}

CONSTANTS: Final[Mapping[str, int | float]] = {
    "TRUE": 1,
    "FALSE": 0,
    "true": 1,
    "false": 0,
    "M_PI": 3.141592653589793,
    "M_PI_2": 1.5707963267948966,
    "CARROT": 0,
    "AP_MODE_NAV": 13,
    "AP_MODE_AUTO2": 13,
    "RC_OK": 0,
    "RC_LOST": 1,
    "RC_REALLY_LOST": 2,
    "MAX_PPRZ": 9600,
    "DEFAULT_CIRCLE_RADIUS": 80.0,
    "NAV_DEFAULT_RADIUS": 80.0,
    "NS": 0,
    "WE": 1,
    "GUIDED_FLAG_XY_OFFSET": 1,
    "GUIDED_FLAG_XY_BODY": 2,
    "GUIDED_FLAG_Z_OFFSET": 4,
    "GUIDED_FLAG_YAW_OFFSET": 8,
    "GUIDED_FLAG_XY_VEL": 32,
    "GUIDED_FLAG_Z_VEL": 64,
    "GUIDED_FLAG_YAW_RATE": 128,
    "GPS_FIX_NONE": 0,
    "GPS_FIX_2D": 2,
    "GPS_FIX_3D": 3,
    "MODULES_IDLE": 0,
    "MODULES_RUN": 1,
    "MODULES_START": 2,
    "MODULES_STOP": 3,
}

SETTABLE: Final = frozenset(
    {
        *("autopilot.kill_throttle", "kill_throttle", "autopilot.launch", "launch"),
        *("autopilot.flight_time", "autopilot_flight_time", "estimator_flight_time"),
        *("nav.radius", "nav_radius", "nav.heading", "nav.climb_vspeed", "nav.descend_vspeed", "nav_climb_vspeed"),
        *("nav_descend_vspeed", "force_forward", "nav_max_speed", "nav.max_speed", "sweep", "nav_takeoff_direction"),
        *("nav_climb", "fp_pitch", "fp_throttle", "fp_climb"),
        *("rectangle_survey_sweep_num", "PolySurveySweepNum", "PolySurveySweepBackNum"),
    }
)

VARIABLES: Final = SETTABLE | frozenset(
    {
        *("datalink_time", "stage_time", "block_time", "nav_block", "nav_stage", "flight_time"),
        *("electrical.bat_low", "electrical.bat_critical", "electrical.vsupply", "autopilot.in_flight"),
        *("autopilot.motors_on", "autopilot.mode", "radio_control.status", "guidance_v.delta_t", "ground_alt"),
        *("GROUND_ALT", "SECURITY_HEIGHT", "SECURITY_ALT", "HOME_MODE_HEIGHT", "MAX_DIST_FROM_HOME"),
        *("LOW_BAT_LEVEL", "CRITIC_BAT_LEVEL", "CATASTROPHIC_BAT_LEVEL", "state.ned_initialized_i"),
        *("state.ned_initialized_f", "state.utm_initialized_f", "gps.fix", "gps_fix", "gps.num_sv", "gps.pacc"),
        *("nav.too_far_from_home", "nav.dist2_to_home", "dist2_to_home", "dist2_to_wp", "max_dist_from_home"),
        *("NAV_DEFAULT_ALT", "baseleg_out_qdr", "QFU"),
        # of versions before 2013
        *("estimator_x", "estimator_y", "estimator_z", "estimator_hspeed_mod", "estimator_hspeed_dir"),
    }
)


def shape_of(name: str, sectors: frozenset[str] | set[str]) -> FunctionShape | None:
    """Signature of a function, None if there is no such function; ``InsideNAME`` exists for every sector."""
    if name.startswith("Inside") and name.removeprefix("Inside") in sectors:
        return FunctionShape(2, 2)
    return FUNCTIONS.get(name)


MAX_MAPPING_SIZE = 100_000  # [bytes]
_NAME = re.compile(r"[A-Za-z_]\w*((\.|->)[A-Za-z_]\w*)*", re.ASCII)


@dataclass(frozen=True, slots=True)
class NameMapping:
    """Names of a build, each a number or a known name."""

    functions: Mapping[str, float | int | str] = field(default_factory=lambda: MappingProxyType({}))
    variables: Mapping[str, float | int | str] = field(default_factory=lambda: MappingProxyType({}))


def load_name_mapping(path: Path | str) -> NameMapping:
    """Read a mapping.

    Raises:
        FlightPlanError: It cannot be read, or a line of it is not valid.
    """
    path = Path(path)
    place = Place(str(path), 0, 0)
    try:
        with path.open("rb") as file:
            data = file.read(MAX_MAPPING_SIZE + 1)
    except OSError as error:
        raise FlightPlanError(place, f"cannot be read: {error.strerror}") from None
    if len(data) > MAX_MAPPING_SIZE:
        raise FlightPlanError(place, f"longer than {MAX_MAPPING_SIZE} bytes")
    try:
        return parse_name_mapping(decode_text(data), str(path))
    except UnicodeError as error:
        raise FlightPlanError(place, f"not a text in UTF-8: {error}") from None


def parse_name_mapping(text: str, name: str) -> NameMapping:
    """A mapping from the text of a file called ``name``; errors as of ``load_name_mapping``."""
    place = Place(name, 0, 0)
    try:
        tables = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise FlightPlanError(place, f"not TOML: {error}") from None
    for key in tables:
        if key not in {"functions", "variables"}:
            raise FlightPlanError(place, f"unknown table [{key}]: only [functions] and [variables]")
    functions = _table(tables.get("functions", {}), "functions", frozenset(FUNCTIONS), place)
    variables = _table(tables.get("variables", {}), "variables", VARIABLES | frozenset(CONSTANTS), place)
    return NameMapping(functions, variables)


def _table(table: object, title: str, known: frozenset[str], place: Place) -> Mapping[str, float | int | str]:
    if not isinstance(table, dict):
        raise FlightPlanError(place, f"[{title}] is not a table")
    meanings: dict[str, float | int | str] = {}
    for name, value in _flat(table):
        what = f"[{title}] {name}"
        if not _NAME.fullmatch(name):
            raise FlightPlanError(place, f"{what}: not a name")
        if name in known:
            raise FlightPlanError(place, f"{what}: is known already")
        if isinstance(value, str):
            if value not in known:
                raise FlightPlanError(place, f"{what}: {value!r} is not a known {title.removesuffix('s')}")
        elif not isinstance(value, int | float) or not math.isfinite(value):
            raise FlightPlanError(place, f"{what}: {value!r} is neither a number nor a known name")
        meanings[name.replace("->", ".")] = int(value) if isinstance(value, bool) else value
    return MappingProxyType(meanings)


def _flat(table: Mapping[str, Any], prefix: str = "") -> list[tuple[str, Any]]:
    """Names and values; TOML makes a table of a dotted name."""
    pairs: list[tuple[str, Any]] = []
    for key, value in table.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict) and value:
            pairs += _flat(value, f"{name}.")
        else:
            pairs.append((name, value))
    return pairs


NAV_CLIMB, NAV_DESCENT = 0.5, -0.8  # vertical speeds of take-offs and landings, unless a plan sets others [m/s]


def waypoint_constant(name: str) -> str:
    """The name of a waypoint in expressions."""
    return f"WP_{name}"


NO_WAYPOINT = waypoint_constant("dummy")


def waypoint_numbers(plan: FlightPlan) -> dict[str, int]:
    """Numbers of the waypoints by name, as expressions see them: 0 is none of them."""
    return {point.name: number for number, point in enumerate(plan.waypoints, 1)}


def block_number(plan: FlightPlan, name: str) -> int | None:
    """Number of a block; the one that is added behind the last is HOME, unless the plan has one of its own."""
    index = plan.block_index(name)
    return len(plan.blocks) if index is None and name == HOME_BLOCK else index


def plan_constants(plan: FlightPlan) -> dict[str, Scalar]:
    """Names with a value that stays."""
    home_height = plan.security_height if plan.home_mode_height is None else plan.home_mode_height
    return {
        **CONSTANTS,
        **{waypoint_constant(name): number for name, number in waypoint_numbers(plan).items()},
        NO_WAYPOINT: 0,
        "GROUND_ALT": plan.ground_alt,
        "SECURITY_HEIGHT": plan.security_height,
        "SECURITY_ALT": plan.ground_alt + plan.security_height,
        "HOME_MODE_HEIGHT": home_height,
        "MAX_DIST_FROM_HOME": plan.max_dist_from_home,
        "max_dist_from_home": plan.max_dist_from_home,
        "NAV_DEFAULT_ALT": plan.alt,
        "QFU": plan.qfu or 0.0,
    }


class PlanConstants:
    """A table of the names that never change, with the vertical speeds a plan begins with."""

    def __init__(self, plan: FlightPlan) -> None:
        self._values = plan_constants(plan) | {"nav.climb_vspeed": NAV_CLIMB, "nav.descend_vspeed": NAV_DESCENT}

    def value(self, name: str) -> Scalar:
        """A constant.

        Raises:
            UnknownNameError: It changes in flight.
        """
        if name not in self._values:
            raise UnknownNameError(f"{name} is not constant")
        return self._values[name]

    def item(self, name: str, index: Scalar, member: str) -> Scalar:  # noqa: ARG002
        """None is constant."""
        raise UnknownNameError(f"{name}[] is not constant")

    def loop_value(self, name: str) -> Scalar:
        """None is constant."""
        raise UnknownNameError(f"${name} is not constant")

    def call(self, name: str, arguments: Sequence[Argument]) -> Scalar | Mapping[str, float]:  # noqa: ARG002
        """None is constant."""
        raise UnknownNameError(f"{name}() is not constant")
