"""Commands to camera, mount, region of interest and fence: what mission items of the same numbers do, at once."""

from __future__ import annotations

import math

from protocol.dialect import mavlink
from protocol.events import CommandRequested
from protocol.mav_frames import ABSOLUTE_ALTITUDE_FRAMES
from sitl.autopilot.answers import UNSUPPORTED, Answer
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.mission.items import ORDER_COMMANDS, PLACE_COMMANDS, Order
from sitl.autopilot.world import POSITION_FRAMES
from sitl.control.reference import Point
from sitl.mavlink.home_requests import UNSUPPORTED_FRAME

ORDERS = ORDER_COMMANDS - {mavlink.MAV_CMD_DO_SET_HOME}  # home has a handler of its own
WAITING_COMMANDS = (mavlink.MAV_CMD_CONDITION_DELAY, mavlink.MAV_CMD_CONDITION_DISTANCE)


def carry_out(autopilot: Autopilot, request: CommandRequested) -> Answer:
    """Carry out what a mission item of the number does."""
    is_place = request.command in PLACE_COMMANDS
    if is_place and request.frame is not None and request.frame not in POSITION_FRAMES | {mavlink.MAV_FRAME_MISSION}:
        return Answer(UNSUPPORTED_FRAME, f"Frame {request.frame} is not supported")
    point = _point(autopilot, request) if is_place else None
    return autopilot.orders.carry_out(Order(request.command, request.params, point))


def turn(autopilot: Autopilot, request: CommandRequested) -> Answer:
    """MAV_CMD_CONDITION_YAW outside of missions: turn on the spot."""
    return autopilot.guided.turn(request.params[:4])


def refuse_waiting(_autopilot: Autopilot, request: CommandRequested) -> Answer:
    """The other conditions: outside of missions nothing waits for them."""
    name = str(mavlink.enums["MAV_CMD"][request.command].name).removeprefix("MAV_CMD_")
    return Answer(UNSUPPORTED, f"{name} is an item of missions alone")


def _point(autopilot: Autopilot, request: CommandRequested) -> Point | None:
    """The place in parameters 5 to 7, world NWU [m]; None if they are left open."""
    latitude, longitude, z = request.params[4:7]
    if math.isnan(latitude) or math.isnan(longitude) or (latitude == 0.0 and longitude == 0.0):
        return None
    # A COMMAND_LONG names no frame, and MAVLink has its altitude above the sea.
    above_sea = request.frame is None or request.frame in ABSOLUTE_ALTITUDE_FRAMES
    return autopilot.world.local(latitude, longitude, autopilot.world.up(z, above_sea=above_sea))


ORDER_HANDLERS = (
    dict.fromkeys(ORDERS, carry_out)
    | dict.fromkeys(WAITING_COMMANDS, refuse_waiting)
    | {mavlink.MAV_CMD_CONDITION_YAW: turn}
)
