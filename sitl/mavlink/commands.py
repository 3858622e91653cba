"""MAV_CMD requests as calls of the autopilot: one function per command, registered by its decorator.

Parameters are those of https://mavlink.io/en/messages/common.html#mav_commands, within the ranges of
:mod:`protocol.ranges.command_ranges`. NaN and, where the command
has no other meaning for it, 0 both mean "default", as stock clients send either.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from protocol import units
from protocol.dialect import mavlink
from protocol.engines.server.stream_server import STREAM_COMMANDS
from protocol.events import CommandRequested
from protocol.frames import Geodetic
from protocol.names import (
    ABSOLUTE_ALTITUDE_FRAMES,
    DEFAULT_SPEED,
    FORCE_ARM_DISARM,
    NO_CHANGE,
    RELATIVE_ALTITUDE_FRAMES,
    UNSUPPORTED_PX4_MODES,
    mode_from_parts,
)
from protocol.ranges import MAX_AIRSPEED, MIN_AIRSPEED, refuse_command
from protocol.wire.message import Message
from sitl.autopilot.answers import ACCEPTED, DENIED, REJECTED, UNSUPPORTED, Answer
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.mission.items import ORDER_COMMANDS, PLACE_COMMANDS, WAY_OF_VTOL_STATE, Order
from sitl.autopilot.mission.speeds import MAX_VERTICAL_SPEEDS, VERTICAL_WORDS
from sitl.autopilot.orders import move_home, move_home_to, move_origin
from sitl.autopilot.world import POSITION_FRAMES
from sitl.control.reference import Point
from sitl.mavlink.standard_modes import set_standard_mode

# The commands and messages that move home and the origin of the local frame.
#
# https://mavlink.io/en/messages/common.html#MAV_CMD_DO_SET_HOME, #MAV_CMD_DO_SET_GLOBAL_ORIGIN (which supersedes
# #SET_GPS_GLOBAL_ORIGIN) and #SET_HOME_POSITION, which old clients send.


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


# Commands to camera, mount, region of interest and fence: what mission items of the same numbers do, at once.


ORDERS = ORDER_COMMANDS - {mavlink.MAV_CMD_DO_SET_HOME}  # home has a handler of its own
WAITING_COMMANDS = (mavlink.MAV_CMD_CONDITION_DELAY, mavlink.MAV_CMD_CONDITION_DISTANCE)


def carry_out(autopilot: Autopilot, request: CommandRequested) -> Answer:
    """Carry out what a mission item of the number does."""
    is_place = request.command in PLACE_COMMANDS
    if is_place and request.frame is not None and request.frame not in POSITION_FRAMES | {mavlink.MAV_FRAME_MISSION}:
        return Answer(UNSUPPORTED_FRAME, f"Frame {request.frame} is not supported")
    point = _place(autopilot, request) if is_place else None
    return autopilot.orders.carry_out(Order(request.command, request.params, point))


def turn(autopilot: Autopilot, request: CommandRequested) -> Answer:
    """MAV_CMD_CONDITION_YAW outside of missions: turn on the spot."""
    return autopilot.guided.turn(request.params[:4])


def refuse_waiting(_autopilot: Autopilot, request: CommandRequested) -> Answer:
    """The other conditions: outside of missions nothing waits for them."""
    name = str(mavlink.enums["MAV_CMD"][request.command].name).removeprefix("MAV_CMD_")
    return Answer(UNSUPPORTED, f"{name} is an item of missions alone")


def _place(autopilot: Autopilot, request: CommandRequested) -> Point | None:
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


ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
SAME_PLACE_RADIUS = 20.0  # a client with an older position of the vehicle may name a place this far from it [m]
CURRENT_ITEM = -1.0  # of MAV_CMD_DO_SET_MISSION_CURRENT
CUSTOM_MODE = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED

Handler = Callable[[Autopilot, CommandRequested], Answer]
HANDLERS: dict[int, Handler] = {
    mavlink.MAV_CMD_DO_SET_STANDARD_MODE: set_standard_mode,
    mavlink.MAV_CMD_DO_SET_HOME: set_home,
    mavlink.MAV_CMD_DO_SET_GLOBAL_ORIGIN: set_origin,
    **ORDER_HANDLERS,
}


def execute(autopilot: Autopilot, request: CommandRequested) -> Answer:
    """Carry a command out, or say exactly why not. Never raises on what came over the wire."""
    handler = HANDLERS.get(request.command)
    if handler is None:
        return Answer(UNSUPPORTED, refusal(request.command, UNSUPPORTED))
    if reason := refuse_command(request.command, request.frame, request.params):
        return Answer(DENIED, reason)
    return handler(autopilot, request)


def refusal(command: int, result: int) -> str:
    """The text for a command that the endpoint has answered with ``result`` by itself."""
    entry = mavlink.enums["MAV_CMD"].get(command)
    name = f"Command {command}" if entry is None else str(entry.name).removeprefix("MAV_CMD_")
    if result == UNSUPPORTED:
        return f"{name} is not supported"
    if command in STREAM_COMMANDS:
        return f"{name} refused: more messages than the link, or all links together, may carry"
    return f"{name} refused: a long command is under way, cancel it or hold first"


def _handles(*commands: int) -> Callable[[Handler], Handler]:
    def register(handler: Handler) -> Handler:
        HANDLERS.update(dict.fromkeys(commands, handler))
        return handler

    return register


@_handles(ARM)
def _arm(autopilot: Autopilot, request: CommandRequested) -> Answer:
    force = request.params[1] == FORCE_ARM_DISARM
    if request.params[0] == 1.0:
        return autopilot.arming.arm(force=force)
    return autopilot.arming.disarm(force=force)


def _is_default(value: float) -> bool:
    return math.isnan(value) or value == 0.0


@_handles(mavlink.MAV_CMD_RUN_PREARM_CHECKS)
def _run_prearm_checks(autopilot: Autopilot, _request: CommandRequested) -> Answer:
    if autopilot.armed:
        return Answer(REJECTED, "Pre-arm checks refused: already armed")
    reasons = autopilot.arming.failed_checks()
    for reason in reasons:
        autopilot.say(mavlink.MAV_SEVERITY_WARNING, f"Pre-arm: {reason}")
    if not reasons:
        autopilot.say(mavlink.MAV_SEVERITY_INFO, "Pre-arm: ready")
    if denied := autopilot.refuse_mission():
        autopilot.say(mavlink.MAV_SEVERITY_WARNING, f"Mission would be denied: {denied}")
    return Answer(ACCEPTED)


@_handles(mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_VTOL_TAKEOFF)
def _take_off(autopilot: Autopilot, request: CommandRequested) -> Answer:
    refused = _refuse_frame(request) or _refuse_elsewhere(autopilot, request)
    return refused or autopilot.guided.take_off(_height(autopilot, request))


def _refuse_elsewhere(autopilot: Autopilot, request: CommandRequested) -> Answer | None:
    """Refuse a take-off above another place: the vehicle climbs where it stands."""
    latitude, longitude = request.params[4:6]
    if _is_default(latitude) and _is_default(longitude):
        return None
    if not _is_on_the_globe(latitude, longitude):
        return Answer(DENIED, "Take-off denied: the position is not valid")
    away = math.dist(autopilot.world.local(latitude, longitude, 0.0)[:2], autopilot.view.p[:2])
    if away < SAME_PLACE_RADIUS:
        return None
    return Answer(DENIED, f"Take-off denied: the position is {away:.0f} m away")


def _refuse_frame(request: CommandRequested) -> Answer | None:
    """Refuse frames that are not global; a COMMAND_LONG names no frame."""
    if request.frame is None or request.frame in POSITION_FRAMES:
        return None
    return Answer(UNSUPPORTED_FRAME, f"Frame {request.frame} is not supported")


@_handles(mavlink.MAV_CMD_NAV_LOITER_UNLIM)
def _hold(autopilot: Autopilot, request: CommandRequested) -> Answer:
    if not all(_is_default(value) for value in request.params[4:6]):
        return Answer(DENIED, "Hold denied: use DO_REPOSITION for a position")
    return autopilot.guided.hold()


def _height(autopilot: Autopilot, request: CommandRequested) -> float | None:
    """Height above home that param7 asks for; None where it leaves that to the vehicle."""
    z = request.param(7)
    if math.isnan(z):
        return None
    home = autopilot.world.home_alt
    # A COMMAND_LONG names no frame. Clients send the altitude above the sea or above home; one below home
    # can only be meant as the latter.
    above_sea = request.frame in ABSOLUTE_ALTITUDE_FRAMES or (request.frame is None and z > home)
    return z - home if above_sea else z


@_handles(mavlink.MAV_CMD_DO_SET_MODE)
def _set_mode(autopilot: Autopilot, request: CommandRequested) -> Answer:
    base, main, sub = request.params[:3]
    mode = mode_from_parts(main, sub)
    if mode is None or not int(base) & CUSTOM_MODE:
        name = next(
            (name for parts, name in UNSUPPORTED_PX4_MODES.items() if parts == (main, sub)), f"{main:g}/{sub:g}"
        )
        return Answer(DENIED, f"Mode {name} is not available")
    return autopilot.set_mode(mode)


@_handles(mavlink.MAV_CMD_MISSION_START)
def _start_mission(autopilot: Autopilot, request: CommandRequested) -> Answer:
    """Fly the mission from an item on, or from the current one where none is named.

    Clients that leave parameters out as 0 name no item: with both 0 a mission under way goes on, and one that was
    broken off begins anew after a landing. With NaN or the last item as the second parameter, 0 is the first item.
    """
    first, last = request.params[:2]
    end = len(autopilot.mission.items) - 1 if autopilot.mission is not None else 0
    if not _is_default(last) and last != end:
        return Answer(DENIED, f"Mission denied: param2 is {last:g}, not the last item, {end}")
    left_out = first == 0.0 and last == 0.0
    if math.isnan(first) or (left_out and autopilot.flying):
        return autopilot.missions.start()
    return autopilot.missions.restart() if left_out else autopilot.missions.start(int(first))


@_handles(mavlink.MAV_CMD_DO_SET_MISSION_CURRENT)
def _set_current(autopilot: Autopilot, request: CommandRequested) -> Answer:
    seq, resets = request.params[:2]
    return autopilot.missions.set_current(None if seq == CURRENT_ITEM else int(seq), resets=resets == 1.0)


@_handles(mavlink.MAV_CMD_DO_REPOSITION)
def _reposition(autopilot: Autopilot, request: CommandRequested) -> Answer:
    """Go to a position, or to another height or heading where the vehicle is; without any of them, hold.

    QGroundControl sends pause, height and heading as a COMMAND_LONG, with NaN for what is to stay.
    """
    if all(map(math.isnan, request.params[3:7])):
        return autopilot.guided.hold()
    if request.frame is None and not all(map(math.isnan, request.params[4:6])):
        return Answer(mavlink.MAV_RESULT_COMMAND_INT_ONLY, "DO_REPOSITION to a position needs COMMAND_INT")
    if refused := _refuse_frame(request):
        return refused
    point = _point(autopilot, request)
    if point is None:
        return Answer(DENIED, "Go-to denied: the position is not valid")
    yaw, speed = request.params[3], request.param(1, NO_CHANGE)
    limit = autopilot.settings.hover_speed
    if speed != NO_CHANGE and not 0.0 < speed <= limit:
        return Answer(DENIED, f"Go-to denied: {speed:g} m/s is not within 0 and {limit:g} m/s")
    heading, wanted_speed = -yaw if math.isfinite(yaw) else None, speed if speed != NO_CHANGE else None
    if all(map(math.isnan, request.params[4:6])):
        return autopilot.guided.change_height(point[2], heading, wanted_speed)
    return autopilot.guided.go_to(point, heading, wanted_speed)


def _point(autopilot: Autopilot, request: CommandRequested) -> Point | None:
    """Target of a go-to, None if it is not valid; NaN leaves the height or the horizontal position as it is."""
    latitude, longitude = request.params[4:6]
    x, y, up = autopilot.reference.position
    world, height = autopilot.world, _height(autopilot, request)
    if height is not None:
        up = world.up(height, above_sea=False)
    if math.isnan(latitude) and math.isnan(longitude):
        return (x, y, up)
    return world.local(latitude, longitude, up) if _is_on_the_globe(latitude, longitude) else None


def _is_on_the_globe(latitude: float, longitude: float) -> bool:
    return abs(latitude) <= 90.0 and abs(longitude) <= 180.0  # neither holds of NaN


@_handles(mavlink.MAV_CMD_DO_CHANGE_SPEED)
def _change_speed(autopilot: Autopilot, request: CommandRequested) -> Answer:
    kind, speed = request.params[:2]
    if speed == NO_CHANGE:
        return Answer(ACCEPTED)
    if speed != DEFAULT_SPEED and (allowed := _refuse_speed(autopilot, kind, speed)):
        return Answer(DENIED, f"Speed denied: {speed:g} m/s; {allowed}")
    return autopilot.guided.change_speed(kind, speed)


def _refuse_speed(autopilot: Autopilot, kind: float, speed: float) -> str:
    """The speeds of a SPEED_TYPE that are possible, where this one [m/s] is not; else nothing."""
    if kind in MAX_VERTICAL_SPEEDS:
        limit = MAX_VERTICAL_SPEEDS[kind]
        return "" if speed <= limit else f"the hover {VERTICAL_WORDS[kind]} with up to {limit:g} m/s"
    limit = autopilot.settings.hover_speed
    if speed <= limit or speed >= MIN_AIRSPEED:
        return ""
    return f"up to {limit:g} m/s in the hover, {MIN_AIRSPEED:g} to {MAX_AIRSPEED:g} m/s forward"


@_handles(mavlink.MAV_CMD_DO_VTOL_TRANSITION)
def _transition(autopilot: Autopilot, request: CommandRequested) -> Answer:
    return autopilot.transitions.begin(WAY_OF_VTOL_STATE[int(request.params[0])])  # every one is immediate


@_handles(mavlink.MAV_CMD_DO_CHANGE_ALTITUDE)
def _change_altitude(autopilot: Autopilot, request: CommandRequested) -> Answer:
    altitude, frame = request.params[:2]
    return autopilot.guided.change_height(autopilot.world.up(altitude, above_sea=frame in ABSOLUTE_ALTITUDE_FRAMES))


@_handles(mavlink.MAV_CMD_DO_PAUSE_CONTINUE)
def _pause(autopilot: Autopilot, request: CommandRequested) -> Answer:
    if request.params[0] == 0.0:
        return autopilot.guided.hold()
    return autopilot.missions.start()


@_handles(mavlink.MAV_CMD_DO_ORBIT)
def _orbit(autopilot: Autopilot, request: CommandRequested) -> Answer:
    if refused := _refuse_frame(request):
        return refused
    radius = request.param(1, autopilot.settings.loiter_radius)
    speed, turns = request.param(2), request.param(4)
    centre = _centre(autopilot, request)
    if centre is None:
        return Answer(DENIED, "Orbit denied: the centre is not valid")
    if not math.isnan(turns):
        return Answer(DENIED, "Orbit denied: use LOITER_TURNS to count turns")
    return autopilot.guided.circle(centre, radius, None if math.isnan(speed) else speed)


def _centre(autopilot: Autopilot, request: CommandRequested) -> Point | None:
    """The requested centre, None if it is not valid; what is left open is that of the vehicle."""
    latitude, longitude, z = request.params[4:7]
    here, world = autopilot.view.p, autopilot.world
    # Clients send an altitude above the sea in this command whatever frame they name: MAVSDK names a relative one.
    above_sea = z > world.home_alt or request.frame in ABSOLUTE_ALTITUDE_FRAMES
    height = world.up(z, above_sea=above_sea) if math.isfinite(z) else here[2]
    if math.isnan(latitude) and math.isnan(longitude):
        return (here[0], here[1], height)
    return world.local(latitude, longitude, height) if _is_on_the_globe(latitude, longitude) else None


@_handles(mavlink.MAV_CMD_NAV_LAND, mavlink.MAV_CMD_NAV_VTOL_LAND)
def _land(autopilot: Autopilot, _request: CommandRequested) -> Answer:
    return autopilot.guided.land()


@_handles(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH)
def _return(autopilot: Autopilot, _request: CommandRequested) -> Answer:
    return autopilot.guided.return_to_launch()


@_handles(mavlink.MAV_CMD_DO_FLIGHTTERMINATION)
def _terminate(_autopilot: Autopilot, _request: CommandRequested) -> Answer:
    return Answer(UNSUPPORTED, "No flight termination: use a forced disarm")
