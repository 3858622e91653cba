"""The parameters of commands (COMMAND_LONG and COMMAND_INT), as this project's vehicle takes them.

One row for each MAV_CMD. What is out of its range is DENIED with the parameter's number and name; a command without a
row may have any finite numbers. What else a command needs (a mode, a limit of the settings) its handler refuses.

https://mavlink.io/en/messages/common.html#mav_commands
"""

from __future__ import annotations

import math
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.limits import MAX_AIRSPEED, MAX_PLAN_ITEMS
from protocol.mav_frames import ABSOLUTE_ALTITUDE_FRAMES, RELATIVE_ALTITUDE_FRAMES, is_global_frame
from protocol.names.labels import FORCE_ARM_DISARM
from protocol.ranges.item_ranges import (
    ALSO_COMMANDS,
    ALTITUDE,
    COORDINATE,
    ITEM_RANGES,
    LATITUDE,
    LONGITUDE,
    MIN_SPEED,
    OPEN_ALTITUDE,
    RADIUS,
    YAW,
    Params,
    Place,
)
from protocol.ranges.value_range import ANY_NUMBER, ValueRange, finite, first_flaw, one_of, whole

__all__ = ["COMMAND_RANGES", "CommandRanges", "command_ranges", "refuse_command"]

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
