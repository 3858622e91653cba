"""MAV_CMD requests as calls of the autopilot: one table, one function per command.

Parameters are those of https://mavlink.io/en/messages/common.html#mav_commands; NaN and, where the command
has no other meaning for it, 0 both mean "default", as stock clients send either.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from protocol.dialect import mavlink
from protocol.events import CommandRequested
from protocol.modes import mode_from_parts
from sitl.autopilot.autopilot import DENIED, UNSUPPORTED, Autopilot, Outcome
from sitl.autopilot.decision import Way
from sitl.autopilot.guidance import FASTEST, SLOWEST, Vector
from sitl.autopilot.home import UNSUPPORTED_FRAME, set_home, set_origin
from sitl.autopilot.mission_items import WAYS
from sitl.autopilot.standard_modes import set_standard_mode

ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
FORCE = 21196  # the number that makes MAV_CMD_COMPONENT_ARM_DISARM skip its checks
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
    return f"{name} refused: one is under way, cancel it or hold first"


def _arm(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    wanted, force = request.params[0], request.params[1] == FORCE
    if wanted == 1.0:
        return autopilot.arm(force=force)
    if wanted == 0.0:
        return autopilot.disarm(force=force)
    return Outcome(DENIED, f"Arm or disarm? param1 is {wanted:g}, not 1 or 0")


def _take_off(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    return autopilot.take_off(_height(autopilot, request))


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
        return Outcome(DENIED, f"Mode {main:g}/{sub:g} is unknown")
    return autopilot.set_mode(mode)


def _start_mission(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    first = request.param(1)
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
    if request.frame is None:
        return Outcome(mavlink.MAV_RESULT_COMMAND_INT_ONLY, "DO_REPOSITION needs COMMAND_INT")
    if request.frame not in GLOBAL | RELATIVE:
        return Outcome(UNSUPPORTED_FRAME, f"Frame {request.frame} is not supported")
    point = _point(autopilot, request)
    if point is None:
        return Outcome(DENIED, "Go-to denied: the position is not a number")
    yaw, speed = request.params[3], request.params[0]
    return autopilot.go_to(
        point,
        heading=-yaw if math.isfinite(yaw) else None,
        speed=speed if math.isfinite(speed) and 0.0 < speed < autopilot.settings.hover_speed else None,
    )


def _point(autopilot: Autopilot, request: CommandRequested) -> Vector | None:
    latitude, longitude, z = request.params[4:7]
    if not (math.isfinite(latitude) and math.isfinite(longitude)):
        return None
    world = autopilot.world
    up = world.up(z, above_sea=request.frame in GLOBAL) if math.isfinite(z) else autopilot.setpoint.p[2]
    return world.local(latitude, longitude, up)


def _change_speed(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    speed = request.params[1]
    most = autopilot.settings.hover_speed
    if not (math.isfinite(speed) and (0.0 < speed <= most or SLOWEST <= speed <= FASTEST)):
        return Outcome(DENIED, f"Speed {speed:g} m/s: hover to {most:g} m/s, wing from {SLOWEST:g} to {FASTEST:g} m/s")
    return autopilot.change_speed(speed)


def _transition(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    way = WAYS.get(int(request.params[0])) if math.isfinite(request.params[0]) else None
    if way is None or way is Way.NONE:
        return Outcome(DENIED, f"Transition to where? param1 is {request.params[0]:g}, not 3 (hover) or 4 (wing)")
    return autopilot.transition(way)


def _pause(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    if request.params[0] == 0.0:
        return autopilot.hold()
    if request.params[0] == 1.0:
        return autopilot.start_mission()
    return Outcome(DENIED, f"Pause or continue? param1 is {request.params[0]:g}, not 0 or 1")


def _orbit(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    if request.frame is not None and request.frame not in GLOBAL | RELATIVE:
        return Outcome(UNSUPPORTED_FRAME, f"Frame {request.frame} is not supported")
    radius = request.param(1, autopilot.settings.loiter_radius)
    speed, turns = request.param(2), request.param(4)
    if not math.isfinite(radius) or math.isinf(speed):
        return Outcome(DENIED, f"Orbit denied: radius {radius:g} m at {speed:g} m/s")
    if not math.isnan(turns):
        return Outcome(DENIED, "Orbit denied: counted turns are for missions (LOITER_TURNS)")
    return autopilot.circle(_centre(autopilot, request), radius, None if math.isnan(speed) else speed)


def _centre(autopilot: Autopilot, request: CommandRequested) -> Vector:
    """The centre that is asked for; what is left open is where the vehicle is."""
    latitude, longitude, z = request.params[4:7]
    here, world = autopilot.view.p, autopilot.world
    # Clients put an altitude above the sea into this command whatever frame they name: MAVSDK names a relative one.
    above_sea = z > world.home_alt or request.frame in GLOBAL
    height = world.up(z, above_sea=above_sea) if math.isfinite(z) else here[2]
    if not (math.isfinite(latitude) and math.isfinite(longitude)) or max(abs(latitude), abs(longitude)) > 180.0:
        return (here[0], here[1], height)
    return world.local(latitude, longitude, height)


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
    mavlink.MAV_CMD_NAV_LOITER_UNLIM: _simple(Autopilot.hold),
    mavlink.MAV_CMD_DO_SET_MODE: _set_mode,
    mavlink.MAV_CMD_MISSION_START: _start_mission,
    mavlink.MAV_CMD_DO_SET_MISSION_CURRENT: _set_current,
    mavlink.MAV_CMD_DO_REPOSITION: _reposition,
    mavlink.MAV_CMD_DO_CHANGE_SPEED: _change_speed,
    mavlink.MAV_CMD_DO_PAUSE_CONTINUE: _pause,
    mavlink.MAV_CMD_DO_VTOL_TRANSITION: _transition,
    mavlink.MAV_CMD_DO_ORBIT: _orbit,
    mavlink.MAV_CMD_DO_SET_STANDARD_MODE: set_standard_mode,
    mavlink.MAV_CMD_DO_SET_HOME: set_home,
    mavlink.MAV_CMD_DO_SET_GLOBAL_ORIGIN: set_origin,
    mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: _unsupported("A simulation is stopped and started from its terminal"),
    mavlink.MAV_CMD_DO_FLIGHTTERMINATION: _unsupported("No flight termination: a forced disarm stops the motors"),
}
