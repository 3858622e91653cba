"""MAV_CMD requests as calls of the autopilot: one table, one function per command.

Parameters are those of https://mavlink.io/en/messages/common.html#mav_commands; NaN and, where the command
has no other meaning for it, 0 both mean "default", as stock clients send either.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Way
from protocol.engines import stream
from protocol.events import CommandRequested
from protocol.modes import FOREIGN, mode_from_parts
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.guidance import MAX_AIRSPEED, MIN_AIRSPEED
from sitl.autopilot.home import UNSUPPORTED_FRAME, set_home, set_origin
from sitl.autopilot.mission_items import WAYS
from sitl.autopilot.outcome import ACCEPTED, DENIED, REJECTED, UNSUPPORTED, Outcome
from sitl.autopilot.standard_modes import set_standard_mode
from sitl.control.reference import Point

ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
FORCE = 21196  # the number that makes MAV_CMD_COMPONENT_ARM_DISARM skip its checks
HERE = 20.0  # a place no farther away is where the vehicle is, to a client with an older position of it [m]
NO_CHANGE, DEFAULT = -1.0, -2.0  # special values of MAV_CMD_DO_CHANGE_SPEED
AIRSPEED, GROUND_SPEED = mavlink.SPEED_TYPE_AIRSPEED, mavlink.SPEED_TYPE_GROUNDSPEED
YAW_BEHAVIOURS = frozenset(mavlink.enums["ORBIT_YAW_BEHAVIOUR"]) - {mavlink.ORBIT_YAW_BEHAVIOUR_ENUM_END}
CUSTOM_MODE = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
RELATIVE = frozenset({mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT})
GLOBAL = frozenset({mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT})

Handler = Callable[[Autopilot, CommandRequested], Outcome]


def execute(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    """Carry a command out, or say exactly why not. Never raises on what came over the wire."""
    handler = HANDLERS.get(request.command)
    if handler is None:
        return Outcome(UNSUPPORTED, refusal(request.command, UNSUPPORTED))
    return handler(autopilot, request)


def refusal(command: int, result: int) -> str:
    """What is said of a command that was answered with ``result`` before it was looked at."""
    entry = mavlink.enums["MAV_CMD"].get(command)
    name = f"Command {command}" if entry is None else str(entry.name).removeprefix("MAV_CMD_")
    if result == UNSUPPORTED:
        return f"{name} is not supported"
    if command in stream.COMMANDS:
        return f"{name} refused: more messages than this vehicle sends to one link, or to all together"
    return f"{name} refused: one is under way, cancel it or hold first"


def _arm(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    wanted, force = request.params[0], request.params[1] == FORCE
    if not force and not _is_default(request.params[1]):
        return Outcome(DENIED, f"Arm or disarm? param2 is {request.params[1]:g}, not 0 or {FORCE} (by force)")
    if wanted == 1.0:
        return autopilot.arm(force=force)
    if wanted == 0.0:
        return autopilot.disarm(force=force)
    return Outcome(DENIED, f"Arm or disarm? param1 is {wanted:g}, not 1 or 0")


def _is_default(value: float) -> bool:
    return math.isnan(value) or value == 0.0


def _run_prearm_checks(autopilot: Autopilot, request: CommandRequested) -> Outcome:  # noqa: ARG001 - carries nothing
    if autopilot.armed:
        return Outcome(REJECTED, "Pre-arm checks refused: armed already")
    for reason in autopilot.pre_arm():
        autopilot.say(mavlink.MAV_SEVERITY_WARNING, f"Pre-arm: {reason}")
    if not autopilot.pre_arm():
        autopilot.say(mavlink.MAV_SEVERITY_INFO, "Pre-arm: ready")
    return Outcome(ACCEPTED)


def _take_off(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    refused = _refuse_frame(request) or _refuse_elsewhere(autopilot, request)
    return refused or autopilot.take_off(_height(autopilot, request))


def _refuse_elsewhere(autopilot: Autopilot, request: CommandRequested) -> Outcome | None:
    """A take-off over another place: it climbs where it stands."""
    latitude, longitude = request.params[4:6]
    if _is_default(latitude) and _is_default(longitude):
        return None
    if not _is_on_the_globe(latitude, longitude):
        return Outcome(DENIED, "Take-off denied: the position is not a place")
    away = math.dist(autopilot.world.local(latitude, longitude, 0.0)[:2], autopilot.view.p[:2])
    return None if away < HERE else Outcome(DENIED, f"Take-off denied: it climbs where it stands, {away:.0f} m away")


def _refuse_frame(request: CommandRequested) -> Outcome | None:
    """Refuse frames that are not global; a COMMAND_LONG names no frame."""
    if request.frame is None or request.frame in GLOBAL | RELATIVE:
        return None
    return Outcome(UNSUPPORTED_FRAME, f"Frame {request.frame} is not supported")


def _hold(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    if not all(_is_default(value) for value in request.params[4:6]):
        return Outcome(DENIED, "Hold denied: it is here, DO_REPOSITION goes to a place")
    return autopilot.hold()


def _height(autopilot: Autopilot, request: CommandRequested) -> float | None:
    """Height above home that param7 asks for; None where it leaves that to the vehicle."""
    z = request.param(7)
    if math.isnan(z):
        return None
    home = autopilot.world.home_alt
    # A COMMAND_LONG names no frame. Clients send the altitude above the sea or above home; one below home
    # can only be meant as the latter.
    above_sea = request.frame in GLOBAL or (request.frame is None and z > home)
    return z - home if above_sea else z


def _set_mode(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    base, main, sub = request.params[:3]
    mode = mode_from_parts(main, sub)
    if mode is None or not (math.isfinite(base) and int(base) & CUSTOM_MODE):
        name = next((name for parts, name in FOREIGN.items() if parts == (main, sub)), f"{main:g}/{sub:g}")
        return Outcome(DENIED, f"Mode {name} is unknown to this vehicle")
    return autopilot.set_mode(mode)


def _start_mission(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    first, last = request.param(1), request.param(2)
    end = len(autopilot.mission.items) - 1 if autopilot.mission is not None else 0
    if not math.isnan(last) and last != end:
        return Outcome(DENIED, f"Mission denied: it ends with its last item, not with item {last:g}")
    if math.isnan(first):
        return autopilot.start_mission()
    if math.isinf(first) or first != int(first):
        return Outcome(DENIED, f"Mission item {first:g} is not a number of an item")
    return autopilot.start_mission(int(first))


def _set_current(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    seq = request.params[0]
    if not (math.isfinite(seq) and seq == int(seq)):
        return Outcome(DENIED, f"Mission item {seq:g} is not a number of an item")
    return autopilot.set_current_item(int(seq))


def _reposition(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    """To a place, or to another height or heading where it is; with none of them it is a hold.

    QGroundControl's pause, its height and its heading are this as a COMMAND_LONG, with NaN for what is to stay.
    """
    if all(map(math.isnan, request.params[3:7])):
        return autopilot.hold()
    if request.frame is None and not all(map(math.isnan, request.params[4:6])):
        return Outcome(mavlink.MAV_RESULT_COMMAND_INT_ONLY, "DO_REPOSITION to a place needs COMMAND_INT")
    if refused := _refuse_frame(request):
        return refused
    point = _point(autopilot, request)
    if point is None:
        return Outcome(DENIED, "Go-to denied: the position is not a number")
    yaw, speed = request.params[3], request.param(1, NO_CHANGE)
    if math.isinf(yaw):
        return Outcome(DENIED, "Go-to denied: the heading is not a number")
    most = autopilot.settings.hover_speed
    if speed != NO_CHANGE and not 0.0 < speed <= most:
        return Outcome(DENIED, f"Go-to denied: {speed:g} m/s is not a hovering speed, up to {most:g} m/s")
    return autopilot.go_to(
        point,
        heading=-yaw if math.isfinite(yaw) else None,
        speed=speed if speed != NO_CHANGE else None,
    )


def _point(autopilot: Autopilot, request: CommandRequested) -> Point | None:
    """Where a go-to is to end, None if that is no place; NaN leaves the height, or the place over ground, as it is."""
    latitude, longitude, z = request.params[4:7]
    if math.isinf(z):
        return None
    x, y, up = autopilot.reference.position
    world, height = autopilot.world, _height(autopilot, request)
    if height is not None:
        up = world.up(height, above_sea=False)
    if math.isnan(latitude) and math.isnan(longitude):
        return (x, y, up)
    return world.local(latitude, longitude, up) if _is_on_the_globe(latitude, longitude) else None


def _is_on_the_globe(latitude: float, longitude: float) -> bool:
    return abs(latitude) <= 90.0 and abs(longitude) <= 180.0  # neither holds of NaN


def _change_speed(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    kind, speed, throttle = request.params[:3]
    if not math.isnan(kind) and kind not in {AIRSPEED, GROUND_SPEED}:
        return Outcome(DENIED, f"Speed denied: param1 is {kind:g}, not 0 (airspeed) or 1 (ground speed)")
    if not _is_default(throttle) and throttle not in {NO_CHANGE, DEFAULT}:
        return Outcome(DENIED, f"Speed denied: throttle {throttle:g} %, which no law takes")
    if speed == NO_CHANGE:
        return Outcome(ACCEPTED)
    if speed == DEFAULT:
        return autopilot.change_speed(None)
    most = autopilot.settings.hover_speed
    if not (math.isfinite(speed) and (0.0 < speed <= most or MIN_AIRSPEED <= speed <= MAX_AIRSPEED)):
        return Outcome(
            DENIED, f"Speed {speed:g} m/s: hover to {most:g} m/s, wing from {MIN_AIRSPEED:g} to {MAX_AIRSPEED:g} m/s"
        )
    return autopilot.change_speed(speed)


def _transition(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    wanted, immediate = request.params[:2]
    way = next((way for state, way in WAYS.items() if state == wanted), Way.NONE)
    if way is Way.NONE:
        return Outcome(DENIED, f"Transition to where? param1 is {wanted:g}, not 3 (hover) or 4 (wing)")
    if not _is_default(immediate) and immediate != 1.0:  # it is always immediate
        return Outcome(DENIED, f"Transition denied: param2 is {immediate:g}, not 0 or 1")
    return autopilot.transition(way)


def _change_altitude(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    altitude, frame = request.params[:2]
    if frame not in GLOBAL | RELATIVE:
        return Outcome(DENIED, f"Height denied: param2 is {frame:g}, not a frame of the globe")
    if not math.isfinite(altitude):
        return Outcome(DENIED, f"Height denied: param1 is {altitude:g}")
    x, y, _ = autopilot.reference.position
    return autopilot.go_to((x, y, autopilot.world.up(altitude, above_sea=frame in GLOBAL)))


def _pause(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    if request.params[0] == 0.0:
        return autopilot.hold()
    if request.params[0] == 1.0:
        return autopilot.start_mission()
    return Outcome(DENIED, f"Pause or continue? param1 is {request.params[0]:g}, not 0 or 1")


def _orbit(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    if refused := _refuse_frame(request):
        return refused
    radius = request.param(1, autopilot.settings.loiter_radius)
    speed, turns, yaw = request.param(2), request.param(4), request.param(3, 0.0)
    if yaw not in YAW_BEHAVIOURS:
        return Outcome(DENIED, f"Orbit denied: {yaw:g} is no ORBIT_YAW_BEHAVIOUR")
    centre = _centre(autopilot, request)
    if centre is None:
        return Outcome(DENIED, "Orbit denied: the centre is not a place")
    if not math.isfinite(radius) or math.isinf(speed):
        return Outcome(DENIED, f"Orbit denied: radius {radius:g} m at {speed:g} m/s")
    if not math.isnan(turns):
        return Outcome(DENIED, "Orbit denied: counted turns are for missions (LOITER_TURNS)")
    return autopilot.circle(centre, radius, None if math.isnan(speed) else speed)


def _centre(autopilot: Autopilot, request: CommandRequested) -> Point | None:
    """The centre that is asked for, None if it is no place; what is left open is where the vehicle is."""
    latitude, longitude, z = request.params[4:7]
    if math.isinf(z):
        return None
    here, world = autopilot.view.p, autopilot.world
    # Clients put an altitude above the sea into this command whatever frame they name: MAVSDK names a relative one.
    above_sea = z > world.home_alt or request.frame in GLOBAL
    height = world.up(z, above_sea=above_sea) if math.isfinite(z) else here[2]
    if math.isnan(latitude) and math.isnan(longitude):
        return (here[0], here[1], height)
    return world.local(latitude, longitude, height) if _is_on_the_globe(latitude, longitude) else None


def _unsupported(text: str) -> Handler:
    return lambda autopilot, request: Outcome(UNSUPPORTED, text)  # noqa: ARG005 - whatever is asked, it is not here


def _simple(call: Callable[[Autopilot], Outcome]) -> Handler:
    return lambda autopilot, request: call(autopilot)  # noqa: ARG005 - these commands carry nothing we use


HANDLERS: dict[int, Handler] = {
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM: _arm,
    mavlink.MAV_CMD_NAV_TAKEOFF: _take_off,
    mavlink.MAV_CMD_NAV_VTOL_TAKEOFF: _take_off,
    mavlink.MAV_CMD_NAV_LAND: _simple(Autopilot.land),
    mavlink.MAV_CMD_NAV_VTOL_LAND: _simple(Autopilot.land),
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: _simple(Autopilot.return_to_launch),
    mavlink.MAV_CMD_NAV_LOITER_UNLIM: _hold,
    mavlink.MAV_CMD_DO_SET_MODE: _set_mode,
    mavlink.MAV_CMD_MISSION_START: _start_mission,
    mavlink.MAV_CMD_DO_SET_MISSION_CURRENT: _set_current,
    mavlink.MAV_CMD_DO_REPOSITION: _reposition,
    mavlink.MAV_CMD_DO_CHANGE_SPEED: _change_speed,
    mavlink.MAV_CMD_DO_CHANGE_ALTITUDE: _change_altitude,
    mavlink.MAV_CMD_DO_PAUSE_CONTINUE: _pause,
    mavlink.MAV_CMD_DO_VTOL_TRANSITION: _transition,
    mavlink.MAV_CMD_DO_ORBIT: _orbit,
    mavlink.MAV_CMD_DO_SET_STANDARD_MODE: set_standard_mode,
    mavlink.MAV_CMD_DO_SET_HOME: set_home,
    mavlink.MAV_CMD_DO_SET_GLOBAL_ORIGIN: set_origin,
    mavlink.MAV_CMD_RUN_PREARM_CHECKS: _run_prearm_checks,
    mavlink.MAV_CMD_DO_FENCE_ENABLE: _unsupported("The parameter GF_ACTION switches the fence; 0 is off"),
    mavlink.MAV_CMD_DO_FLIGHTTERMINATION: _unsupported("No flight termination: a forced disarm stops the motors"),
}
