"""The commands and messages that move home and the origin of the local frame.

https://mavlink.io/en/messages/common.html#MAV_CMD_DO_SET_HOME, #MAV_CMD_DO_SET_GLOBAL_ORIGIN (which supersedes
#SET_GPS_GLOBAL_ORIGIN) and #SET_HOME_POSITION, which old clients send.
"""

from __future__ import annotations

from protocol import units
from protocol.dialect import mavlink
from protocol.events import CommandRequested
from protocol.frames import Geodetic
from protocol.mav_frames import ABSOLUTE_ALTITUDE_FRAMES, RELATIVE_ALTITUDE_FRAMES
from protocol.wire.message import Message
from sitl.autopilot.answers import Answer
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.orders import move_home, move_home_to, move_origin
from sitl.autopilot.world import POSITION_FRAMES

UNSUPPORTED_FRAME = mavlink.MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME
HOME_COMMANDS = frozenset({mavlink.MAV_CMD_DO_SET_HOME, mavlink.MAV_CMD_DO_SET_GLOBAL_ORIGIN})
HOME_MESSAGES = frozenset({"SET_HOME_POSITION", "SET_GPS_GLOBAL_ORIGIN"})


def set_home(autopilot: Autopilot, request: CommandRequested) -> Answer:
    """MAV_CMD_DO_SET_HOME: here (param1 1) or at a position; an altitude that is left open (NaN) stays as it is.

    Roll, pitch and yaw of the ground are not used: it is level, and no return turns to a heading.
    """
    if request.params[0] == 1.0:
        return move_home(autopilot, autopilot.view.p)
    if request.frame is not None and request.frame not in POSITION_FRAMES:
        return Answer(UNSUPPORTED_FRAME, f"Home denied: frame {request.frame} is not supported")
    return move_home_to(autopilot, *request.params[4:7], relative=request.frame in RELATIVE_ALTITUDE_FRAMES)


def set_origin(autopilot: Autopilot, request: CommandRequested) -> Answer:
    """MAV_CMD_DO_SET_GLOBAL_ORIGIN: refused while armed."""
    if request.frame is not None and request.frame not in ABSOLUTE_ALTITUDE_FRAMES:
        return Answer(UNSUPPORTED_FRAME, f"Origin denied: frame {request.frame} is not supported")
    return move_origin(autopilot, Geodetic(*request.params[4:7]))


def take_home_message(autopilot: Autopilot, message: Message) -> Answer:
    """SET_HOME_POSITION or SET_GPS_GLOBAL_ORIGIN: do what the commands do that replaced them."""
    lat, lon, alt = units.from_e7(message.latitude), units.from_e7(message.longitude), message.altitude
    if message.get_type() == "SET_GPS_GLOBAL_ORIGIN":
        return move_origin(autopilot, Geodetic(lat, lon, units.from_millimetres(alt)))
    return move_home_to(autopilot, lat, lon, units.from_millimetres(alt), relative=False)
