"""Ranges of the numbers that peers send, as this project's vehicle takes them, and limits that both ends keep.

One row for each MAV_CMD: its ``params`` 1 to 4, and its ``place``, which is parameters 5 to 7. To add an item, add a
row; :func:`item_flaw` then refuses what is out of range, with the parameter's number and name. A command without a row
may have any finite numbers.

https://mavlink.io/en/messages/common.html#mav_commands

One row for each MAV_CMD. What is out of its range is DENIED with the parameter's number and name; a command without a
row may have any finite numbers. What else a command needs (a mode, a limit of the settings) its handler refuses.

https://mavlink.io/en/messages/common.html#mav_commands

Fields that the type mask of a set-point leaves out may have any value. What else cannot be flown (a place outside the
arena, a speed between hover and forward flight) the autopilot refuses.

https://mavlink.io/en/messages/common.html#SET_POSITION_TARGET_LOCAL_NED
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.names import (
    ABSOLUTE_ALTITUDE_FRAMES,
    DEFAULT_SPEED,
    FORCE_ARM_DISARM,
    NO_CHANGE,
    RELATIVE_ALTITUDE_FRAMES,
    is_global_frame,
)

MIN_FORWARD_HEIGHT = 3.0
"""Least height of forward flight, and of a front transition [m]."""

MIN_AIRSPEED = 7.0
"""Least airspeed of the cruise: slower speeds are those of the hover [m/s]."""

MAX_AIRSPEED = 22.0
"""Greatest airspeed of the cruise [m/s]."""

LEGS_AHEAD = 8
"""Legs without a stop between them that the vehicle looks ahead, and the most it is asked about."""

MAX_PLAN_ITEMS = 1000
"""Items of a mission, a fence or a set of rally points."""

MAX_PLAN_FILE = 1_000_000
"""Bytes of a file of a flight plan, on the wire and on the disk."""

MIN_CORNERS = 3
"""Corners of a polygon: of a fence, or of a flight plan's sector."""


LOG_DATA_SIZE = 90  # bytes of a log in one LOG_DATA

# A server sends so many messages in every interval: slow enough for the receive buffers of its peers.
SEND_INTERVAL = 0.01  # [s]
MESSAGES_PER_INTERVAL = 10  # files and logs
PARAMETERS_PER_INTERVAL = 5  # of each parameter list


MAX_FLOAT32 = 3.4028235e38
"""The greatest finite number of the wire, as the shortest decimal that stands for it."""


class ValueRange(NamedTuple):
    """Values that a number may have; a limit that is no float32 holds for the nearest one as well."""

    name: str  # of the number, for people
    minimum: float = -MAX_FLOAT32
    maximum: float = MAX_FLOAT32
    unit: str = ""
    also: tuple[float, ...] = ()  # further values, each with a meaning of its own
    default: bool = True  # NaN is allowed: it leaves the value to the vehicle
    is_whole: bool = False

    def allows(self, value: float) -> bool:
        """Whether the number may have a value."""
        if math.isnan(value):
            return self.default
        if value in self.also:
            return True
        if not abs(value) <= MAX_FLOAT32 or (self.is_whole and not _is_whole(value)):
            return False
        least, most = _float32(self.minimum), _float32(self.maximum)
        return min(self.minimum, least) <= value <= max(self.maximum, most)

    @property
    def words(self) -> str:
        """The allowed values in words, after "not"."""
        parts = [f"{value:g}" for value in self.also]
        if self.maximum == -self.minimum == MAX_FLOAT32:
            parts.append("a number that is finite")
        elif self.minimum <= self.maximum:
            kind = "a whole number" if self.is_whole else "a number"
            parts.append(f"{kind} from {self.minimum:g} to {self.maximum:g}{' ' * bool(self.unit)}{self.unit}")
        return " or ".join(filter(None, [", ".join(parts[:-1]), parts[-1]]))

    @property
    def span(self) -> str:
        """The allowed values, as a table has them."""
        parts = [f"{value:g}" for value in self.also]
        if self.maximum == -self.minimum == MAX_FLOAT32:
            parts.append("finite")
        elif self.minimum <= self.maximum:
            parts.append(f"{self.minimum:g}..{self.maximum:g}{' ' * bool(self.unit)}{self.unit}")
        return ", ".join(parts) + ", whole" * self.is_whole


class Flaw(NamedTuple):
    """A number that is out of its range."""

    number: int  # of the parameter, from 1
    text: str


ANY_NUMBER = ValueRange("not used")
"""Of a number without a meaning here: finite, so that it can be stored, or NaN."""


def finite(
    name: str, minimum: float, maximum: float, unit: str = "", *, also: tuple[float, ...] = (), default: bool = True
) -> ValueRange:
    """A real number within limits."""
    return ValueRange(name, minimum, maximum, unit, also, default)


def whole(
    name: str, minimum: float, maximum: float, *, also: tuple[float, ...] = (), default: bool = False
) -> ValueRange:
    """A whole number within limits."""
    return ValueRange(name, minimum, maximum, "", also, default, is_whole=True)


def one_of(name: str, *values: float, default: bool = False) -> ValueRange:
    """One of a few values."""
    return ValueRange(name, math.inf, -math.inf, "", values, default)


def first_flaw(ranges: tuple[ValueRange, ...], values: tuple[float, ...]) -> Flaw | None:
    """The first parameter that is out of its range, or None."""
    for number, (allowed, value) in enumerate(zip(ranges, values, strict=True), start=1):
        if not allowed.allows(value):
            return Flaw(number, f"param{number} is {value:g}, not {allowed.words} ({allowed.name})")
    return None


def _is_whole(value: float) -> bool:
    """Whether a whole number says all of a value: -0 would be stored as 0."""
    return value == int(value) and (value != 0.0 or math.copysign(1.0, value) > 0.0)


def _float32(value: float) -> float:
    """The nearest number of the wire; a limit that is infinite stays so."""
    if math.isinf(value):
        return value
    (carried,) = struct.unpack("<f", struct.pack("<f", value))
    return float(carried)


KNOWN_FRAMES = frozenset(
    number for number, entry in mavlink.enums["MAV_FRAME"].items() if not entry.name.endswith("_ENUM_END")
)
MAX_DISTANCE = 1e5  # of a radius [m]
MAX_ITEM_ALTITUDE = 2e4  # above or below the sea, home or the origin [m]
MAX_WAIT = 1e6  # [s]
SPEED_TYPES = tuple(
    sorted(kind for kind, entry in mavlink.enums["SPEED_TYPE"].items() if not entry.name.endswith("_ENUM_END"))
)
MIN_SPEED = 0.1  # slower is standing still [m/s]

LATITUDE = finite("latitude", -90.0, 90.0, "deg")
LONGITUDE = finite("longitude", -180.0, 180.0, "deg")
ALTITUDE = finite("altitude", -MAX_ITEM_ALTITUDE, MAX_ITEM_ALTITUDE, "m", default=False)
OPEN_ALTITUDE = finite("altitude", -MAX_ITEM_ALTITUDE, MAX_ITEM_ALTITUDE, "m")
COORDINATE = ValueRange("coordinate")  # in a local frame [m]
YAW = finite("yaw", -360.0, 360.0, "deg")
PITCH = finite("pitch", -180.0, 180.0, "deg")
HEADING_REQUIRED = one_of("heading required", 0, 1, default=True)
DISTANCE = finite("distance", 0.0, MAX_DISTANCE, "m", default=False)
TRIGGER_DISTANCE = finite("distance", 0.1, MAX_DISTANCE, "m", also=(0.0,), default=False)
MOUNT_MODE = one_of("MAV_MOUNT_MODE", 0, 1, 2, default=True)
CAMERA_ID = one_of("camera", 0, 1, default=True)  # all, or the one there is
HOLD_TIME = finite("hold time", 0.0, MAX_WAIT, "s")
RADIUS = finite("radius", -MAX_DISTANCE, MAX_DISTANCE, "m")  # negative: counter-clockwise
# One that is smaller could never be met; 0 leaves it to the vehicle.
ACCEPTANCE = finite("acceptance radius", 0.05, MAX_DISTANCE, "m", also=(0.0,))
CORNERS = whole("number of corners", MIN_CORNERS, MAX_PLAN_ITEMS)
ZONE_RADIUS = finite("radius", 0.01, MAX_DISTANCE, "m", default=False)

Params = tuple[ValueRange, ValueRange, ValueRange, ValueRange]
Place = tuple[ValueRange, ValueRange, ValueRange]

_ = ANY_NUMBER
PLACE: Place = (LATITUDE, LONGITUDE, ALTITUDE)
GROUND_PLACE: Place = (LATITUDE, LONGITUDE, _)  # without a height
OPEN_PLACE: Place = (LATITUDE, LONGITUDE, OPEN_ALTITUDE)
NO_PLACE: Place = (_, _, _)


class ItemRanges(NamedTuple):
    """The ranges of an item's seven parameters."""

    params: Params = (_, _, _, _)
    place: Place = NO_PLACE


ITEM_RANGES: dict[int, ItemRanges] = {
    mavlink.MAV_CMD_NAV_WAYPOINT: ItemRanges((HOLD_TIME, ACCEPTANCE, _, YAW), PLACE),
    mavlink.MAV_CMD_NAV_LOITER_UNLIM: ItemRanges((_, _, RADIUS, YAW), PLACE),
    mavlink.MAV_CMD_NAV_LOITER_TURNS: ItemRanges((finite("number of turns", 0.0, 1e6), _, RADIUS, YAW), PLACE),
    mavlink.MAV_CMD_NAV_LOITER_TIME: ItemRanges((HOLD_TIME, _, RADIUS, YAW), PLACE),
    mavlink.MAV_CMD_NAV_LOITER_TO_ALT: ItemRanges(
        (one_of("heading required", 0, 1, default=True), RADIUS, _, _), PLACE
    ),
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: ItemRanges(),
    mavlink.MAV_CMD_NAV_LAND: ItemRanges((_, _, _, YAW), PLACE),
    mavlink.MAV_CMD_NAV_TAKEOFF: ItemRanges((_, _, _, YAW), PLACE),
    mavlink.MAV_CMD_NAV_VTOL_TAKEOFF: ItemRanges((_, _, _, YAW), PLACE),
    mavlink.MAV_CMD_NAV_VTOL_LAND: ItemRanges((_, _, _, YAW), PLACE),
    mavlink.MAV_CMD_NAV_DELAY: ItemRanges((finite("delay", 0.0, MAX_WAIT, "s", default=False), _, _, _)),
    mavlink.MAV_CMD_DO_JUMP: ItemRanges(
        (whole("jump target", 0, MAX_PLAN_ITEMS - 1), whole("repeat count", 0, 65535, also=(-1.0,)), _, _)
    ),
    mavlink.MAV_CMD_DO_CHANGE_SPEED: ItemRanges(
        (
            one_of("speed type", *SPEED_TYPES, default=True),
            finite("speed", MIN_SPEED, MAX_AIRSPEED, "m/s", also=(NO_CHANGE, DEFAULT_SPEED), default=False),
            one_of("throttle", 0.0, NO_CHANGE, DEFAULT_SPEED, default=True),
            _,
        )
    ),
    mavlink.MAV_CMD_DO_VTOL_TRANSITION: ItemRanges((one_of("VTOL state", 0, 3, 4), _, _, _)),
    mavlink.MAV_CMD_DO_LAND_START: ItemRanges(),
    mavlink.MAV_CMD_CONDITION_DELAY: ItemRanges((finite("delay", 0.0, MAX_WAIT, "s", default=False), _, _, _)),
    mavlink.MAV_CMD_CONDITION_DISTANCE: ItemRanges(
        (finite("distance", 0.0, MAX_DISTANCE, "m", default=False), _, _, _)
    ),
    mavlink.MAV_CMD_CONDITION_YAW: ItemRanges(
        (
            finite("angle", -360.0, 360.0, "deg", default=False),
            finite("rate", 0.0, 360.0, "deg/s"),
            one_of("direction", -1, 0, 1, default=True),
            one_of("relative", 0, 1, default=True),
        )
    ),
    mavlink.MAV_CMD_DO_SET_HOME: ItemRanges((one_of("here", 0, 1, default=True), _, _, _), OPEN_PLACE),
    mavlink.MAV_CMD_DO_FENCE_ENABLE: ItemRanges((one_of("enable", 0, 1), _, _, _)),
    mavlink.MAV_CMD_DO_SET_ROI_LOCATION: ItemRanges((_, _, _, _), OPEN_PLACE),
    mavlink.MAV_CMD_DO_SET_ROI: ItemRanges(
        (
            one_of("MAV_ROI", mavlink.MAV_ROI_NONE, mavlink.MAV_ROI_WPNEXT, mavlink.MAV_ROI_LOCATION, default=True),
            _,
            _,
            _,
        ),
        OPEN_PLACE,
    ),
    mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET: ItemRanges(place=(PITCH, _, YAW)),
    mavlink.MAV_CMD_DO_SET_ROI_NONE: ItemRanges(),
    mavlink.MAV_CMD_DO_MOUNT_CONFIGURE: ItemRanges(),
    mavlink.MAV_CMD_DO_MOUNT_CONTROL: ItemRanges(
        (PITCH, _, YAW, _), (_, _, one_of("MAV_MOUNT_MODE", 0, 1, 2, default=True))
    ),
    mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: ItemRanges(
        (PITCH, YAW, _, _), (whole("GIMBAL_MANAGER_FLAGS", 0, 1023, default=True), _, _)
    ),
    mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: ItemRanges(),
    mavlink.MAV_CMD_DO_DIGICAM_CONTROL: ItemRanges(),
    mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST: ItemRanges(
        (
            finite("distance", 0.1, MAX_DISTANCE, "m", also=(0.0,), default=False),
            _,
            one_of("at once", 0, 1, default=True),
            _,
        )
    ),
    mavlink.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL: ItemRanges(
        (finite("cycle time", 100.0, MAX_WAIT, "ms", also=(0.0, -1.0), default=False), _, _, _)
    ),
    mavlink.MAV_CMD_SET_CAMERA_MODE: ItemRanges((CAMERA_ID, one_of("CAMERA_MODE", 0, 1, 2), _, _)),
    mavlink.MAV_CMD_IMAGE_START_CAPTURE: ItemRanges(
        (CAMERA_ID, finite("interval", 0.1, MAX_WAIT, "s", also=(0.0,)), whole("images", 0, 1e6, default=True), _)
    ),
    mavlink.MAV_CMD_IMAGE_STOP_CAPTURE: ItemRanges((CAMERA_ID, _, _, _)),
    mavlink.MAV_CMD_VIDEO_START_CAPTURE: ItemRanges((_, finite("status frequency", 0.0, 100.0, "Hz"), CAMERA_ID, _)),
    mavlink.MAV_CMD_VIDEO_STOP_CAPTURE: ItemRanges(),
    mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT: ItemRanges(place=OPEN_PLACE),
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION: ItemRanges((CORNERS, _, _, _), GROUND_PLACE),
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION: ItemRanges((CORNERS, _, _, _), GROUND_PLACE),
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION: ItemRanges((ZONE_RADIUS, _, _, _), GROUND_PLACE),
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION: ItemRanges((ZONE_RADIUS, _, _, _), GROUND_PLACE),
    mavlink.MAV_CMD_NAV_RALLY_POINT: ItemRanges(place=PLACE),
}


ALSO_COMMANDS = frozenset(
    {
        mavlink.MAV_CMD_CONDITION_YAW,
        mavlink.MAV_CMD_DO_FENCE_ENABLE,
        mavlink.MAV_CMD_DO_SET_ROI_LOCATION,
        mavlink.MAV_CMD_DO_SET_ROI,
        mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET,
        mavlink.MAV_CMD_DO_SET_ROI_NONE,
        mavlink.MAV_CMD_DO_MOUNT_CONTROL,
        mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
        mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST,
        mavlink.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL,
        mavlink.MAV_CMD_SET_CAMERA_MODE,
        mavlink.MAV_CMD_IMAGE_START_CAPTURE,
        mavlink.MAV_CMD_IMAGE_STOP_CAPTURE,
        mavlink.MAV_CMD_VIDEO_START_CAPTURE,
    }
)
"""Items whose numbers are commands too, with the same parameters."""


def item_ranges(command: int, frame: int) -> tuple[ValueRange, ...]:
    """The ranges of an item's seven parameters in a MAV_FRAME.

    Latitude and longitude are such in every item with a global frame, also where the item does not use them.
    """
    row = ITEM_RANGES.get(command, ItemRanges())
    x, y, z = row.place
    if is_global_frame(frame):
        x, y = LATITUDE, LONGITUDE
    elif x is LATITUDE:
        x, y, z = NO_PLACE if frame == mavlink.MAV_FRAME_MISSION else (COORDINATE, COORDINATE, z)
    return (*row.params, x, y, z)


def item_flaw(command: int, frame: int, values: tuple[float, ...]) -> Flaw | None:
    """First flaw of an item's seven parameters, or None.

    Args:
        command: MAV_CMD.
        frame: MAV_FRAME.
        values: Parameters 1 to 7: positions in degrees or metres, NaN where they are left open.
    """
    return first_flaw(item_ranges(command, frame), values)


MAX_ORBIT_BEHAVIOUR = mavlink.ORBIT_YAW_BEHAVIOUR_ENUM_END - 1
POSITION_FRAMES = sorted(ABSOLUTE_ALTITUDE_FRAMES | RELATIVE_ALTITUDE_FRAMES)

_ = ANY_NUMBER
COMMAND_PLACE: Place = (LATITUDE, LONGITUDE, OPEN_ALTITUDE)
MESSAGE_ID = ValueRange("message id", also=(math.inf, -math.inf))  # one of no message is UNSUPPORTED
ASKED_BY = one_of("who gets it", 0, 1, 2, default=True)
SAID = one_of("1, or left out", 0, 1, default=True)
NUMBER, PLAN_KEY = whole("number", 0, 65535), finite("plan", 0, 1 << 24)


class CommandRanges(NamedTuple):
    """The ranges of a command's seven parameters."""

    name: str = ""  # by which a refusal calls it; empty: the MAV_CMD's
    params: Params = (_, _, _, _)
    place: Place = (_, _, _)


COMMAND_RANGES: dict[int, CommandRanges] = {
    mavlink.MAV_CMD_NAV_TAKEOFF: CommandRanges("Take-off", (_, _, _, _), COMMAND_PLACE),
    mavlink.MAV_CMD_NAV_VTOL_TAKEOFF: CommandRanges("Take-off", (_, _, _, _), COMMAND_PLACE),
    mavlink.MAV_CMD_NAV_LOITER_UNLIM: CommandRanges("Hold"),
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: CommandRanges("Return"),
    mavlink.MAV_CMD_NAV_LAND: CommandRanges("Landing"),
    mavlink.MAV_CMD_NAV_VTOL_LAND: CommandRanges("Landing"),
    mavlink.MAV_CMD_DO_ORBIT: CommandRanges(
        "Orbit",
        (
            RADIUS,
            finite("speed", -MAX_AIRSPEED, MAX_AIRSPEED, "m/s"),
            whole("ORBIT_YAW_BEHAVIOUR", 0, MAX_ORBIT_BEHAVIOUR, default=True),
            finite("number of turns", 0, 1e6),
        ),
        COMMAND_PLACE,
    ),
    mavlink.MAV_CMD_DO_SET_MODE: CommandRanges(
        "Mode", (whole("base mode", 0, 255), whole("main mode", 0, 255), whole("sub mode", 0, 255, default=True), _)
    ),
    mavlink.MAV_CMD_DO_CHANGE_SPEED: CommandRanges("Speed", ITEM_RANGES[mavlink.MAV_CMD_DO_CHANGE_SPEED].params),
    mavlink.MAV_CMD_DO_SET_HOME: CommandRanges("Home", (one_of("here", 0, 1, default=True), _, _, _), COMMAND_PLACE),
    mavlink.MAV_CMD_DO_SET_GLOBAL_ORIGIN: CommandRanges("Origin", (_, _, _, _), (LATITUDE, LONGITUDE, ALTITUDE)),
    mavlink.MAV_CMD_DO_CHANGE_ALTITUDE: CommandRanges("Height", (ALTITUDE, one_of("frame", *POSITION_FRAMES), _, _)),
    mavlink.MAV_CMD_DO_REPOSITION: CommandRanges(
        "Go-to",
        (finite("speed", MIN_SPEED, MAX_AIRSPEED, "m/s", also=(-1.0, 0.0)), _, _, YAW._replace(unit="")),
        COMMAND_PLACE,
    ),
    mavlink.MAV_CMD_DO_PAUSE_CONTINUE: CommandRanges("Pause or continue", (one_of("continue", 0, 1), _, _, _)),
    mavlink.MAV_CMD_DO_SET_MISSION_CURRENT: CommandRanges(
        "Mission item", (whole("item", -1, MAX_PLAN_ITEMS - 1), one_of("reset", 0, 1, default=True), _, _)
    ),
    mavlink.MAV_CMD_PREFLIGHT_STORAGE: CommandRanges(
        "Storage",
        (
            one_of("parameters", -1, 0, 1, 2, default=True),
            whole("plans", -1, 2, default=True),
            finite("log rate", 0, 1000, "Hz", also=(-1.0,)),
            _,
        ),
    ),
    mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: CommandRanges("Reboot", (one_of("autopilot", 0, 1, 2), _, _, _)),
    mavlink.MAV_CMD_DO_SET_STANDARD_MODE: CommandRanges("Standard mode", (ValueRange("mode"), _, _, _)),
    mavlink.MAV_CMD_MISSION_START: CommandRanges(
        "Mission",
        (
            whole("first item", 0, MAX_PLAN_ITEMS - 1, default=True),
            whole("last item", -1, MAX_PLAN_ITEMS - 1, default=True),
            _,
            _,
        ),
    ),
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM: CommandRanges(
        "Arm or disarm", (one_of("arm", 0, 1), one_of("force", 0, FORCE_ARM_DISARM, default=True), _, _)
    ),
    mavlink.MAV_CMD_INJECT_FAILURE: CommandRanges(
        "Failure",
        (
            whole("FAILURE_UNIT", 0, 65535),
            whole("FAILURE_TYPE", 0, 255),
            whole("instance", -32768, 32767, default=True),
            _,
        ),
    ),
    mavlink.MAV_CMD_DO_VTOL_TRANSITION: CommandRanges(
        "Transition", (one_of("VTOL state", 3, 4), one_of("immediate", 0, 1, default=True), _, _)
    ),
    mavlink.MAV_CMD_GET_MESSAGE_INTERVAL: CommandRanges(params=(MESSAGE_ID, _, _, _)),
    mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: CommandRanges(
        params=(MESSAGE_ID, finite("interval", 0, 1 << 32, "us", also=(-1.0,)), _, _), place=(_, _, ASKED_BY)
    ),
    mavlink.MAV_CMD_REQUEST_MESSAGE: CommandRanges(params=(MESSAGE_ID, _, _, _), place=(_, _, ASKED_BY)),
    mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION: CommandRanges(params=(SAID, _, _, _)),
    mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: CommandRanges(params=(SAID, _, _, _)),
    **{number: CommandRanges("", *ITEM_RANGES[number]) for number in ALSO_COMMANDS},
    mavlink.MAV_CMD_DARKO_JUMP_TO_BLOCK: CommandRanges("Block", (NUMBER, PLAN_KEY, _, _)),
    mavlink.MAV_CMD_DARKO_MOVE_WAYPOINT: CommandRanges("Waypoint", (NUMBER, PLAN_KEY, _, _), COMMAND_PLACE),
    mavlink.MAV_CMD_DARKO_SET_VARIABLE: CommandRanges("Variable", (NUMBER, PLAN_KEY, _._replace(name="value"), _)),
}


def command_ranges(command: int, frame: int | None) -> tuple[ValueRange, ...]:
    """The ranges of a command's seven parameters in a MAV_FRAME; None: a COMMAND_LONG, which names none."""
    row = COMMAND_RANGES.get(command, CommandRanges())
    x, y, z = row.place
    if x is LATITUDE and frame is not None and not is_global_frame(frame):
        x = y = COORDINATE
    return (*row.params, x, y, z)


def refuse_command(command: int, frame: int | None, params: tuple[float, ...]) -> str:
    """Reason why a command cannot have its seven parameters; empty if it can.

    Args:
        command: MAV_CMD.
        frame: MAV_FRAME of a COMMAND_INT.
        params: Positions in degrees or metres, NaN where they are left open.
    """
    flaw = first_flaw(command_ranges(command, frame), params)
    if flaw is None:
        return ""
    entry = mavlink.enums["MAV_CMD"].get(command)
    name = f"Command {command}" if entry is None else str(entry.name).removeprefix("MAV_CMD_")
    return f"{COMMAND_RANGES.get(command, CommandRanges()).name or name} denied: {flaw.text}"


STICK_SCALE = 1000  # value of an axis of MANUAL_CONTROL at its end
UNUSED_AXIS = 0x7FFF  # value of an axis that the sender does not have

_AXIS = whole("", -STICK_SCALE, STICK_SCALE, also=(UNUSED_AXIS,))


def _given(name: str, limit: float, unit: str) -> ValueRange:
    return finite(name, -limit, limit, unit, default=False)


_POSITION = {name: _given(name, 1e7, "m") for name in ("x", "y", "z")}
_GLOBAL_POSITION = {
    "lat_int": _given("lat_int", 90e7, "degE7"),
    "lon_int": _given("lon_int", 180e7, "degE7"),
    "alt": ALTITUDE._replace(name="alt"),
}
_MOTION = {
    **{name: ValueRange(name, default=False) for name in ("vx", "vy", "vz", "afx", "afy", "afz")},
    **{name: ValueRange(name) for name in ("yaw", "yaw_rate")},
}

MESSAGE_RANGES: dict[str, dict[str, ValueRange]] = {
    "SET_POSITION_TARGET_LOCAL_NED": _POSITION | _MOTION,
    "SET_POSITION_TARGET_GLOBAL_INT": _GLOBAL_POSITION | _MOTION,
    "SET_ATTITUDE_TARGET": {
        **{f"q[{k}]": _given(f"q[{k}]", 2.0, "") for k in range(4)},
        **{f"body_{axis}_rate": _given(f"body_{axis}_rate", 1e3, "rad/s") for axis in ("roll", "pitch", "yaw")},
        "thrust": finite("thrust", 0.0, 1.0, default=False),
    },
    "MANUAL_CONTROL": {
        **{axis: _AXIS._replace(name=axis) for axis in ("x", "y", "r")},
        "z": _AXIS._replace(name="z", minimum=0),
    },
}


def message_flaw(message: str, values: Mapping[str, float]) -> str:
    """Reason why a message cannot have the values of these fields; empty if it can."""
    for field, value in values.items():
        allowed = MESSAGE_RANGES[message][field]
        if not allowed.allows(value):
            return f"{allowed.name} is {value:g}, not {allowed.words}"
    return ""
