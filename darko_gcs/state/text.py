"""Text for numbers and commands of the wire, and text from the wire made safe to show."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LabelledEnum, Law, Reason
from protocol.names import FORCE_ARM_DISARM, as_member, calm_words, mode_from_parts, name_of
from protocol.ranges import MIN_AIRSPEED
from protocol.wire.message import Source

MINUTE, HOUR = 60.0, 3600.0  # [s]


def label_of(enum: type[LabelledEnum], number: int) -> str:
    """A number of the dialect in plain words; an unknown number keeps the name of its enum: "law 12"."""
    member = as_member(enum, number)
    if member is not None:
        return member.label
    enum_words = re.sub(r"(?<!^)(?=[A-Z])", " ", enum.__name__).lower()
    return f"{enum_words} {number}"


def jump_cause(source: int, target: int, reason: int) -> str:
    """The cause of a jump between two DARKO_LAWs in plain words: "wind below 3 m/s, V below threshold"."""
    names = name_of(Law, source), name_of(Law, target), name_of(Reason, reason)
    return calm_words(*names) + label_of(Reason, reason)


def command_name(command: int) -> str:
    """A MAV_CMD in lower case and without its prefixes: "nav takeoff"; an unknown one as "command 7"."""
    entry = mavlink.enums["MAV_CMD"].get(command)
    return command_words(entry.name) if entry else f"command {command}"


def command_words(name: str) -> str:
    """Operators' name for a command: "jump to block" of "MAV_CMD_DARKO_JUMP_TO_BLOCK"."""
    words = name.replace("_", " ").lower()
    for prefix in ("mav cmd ", "darko ", "component "):
        words = words.removeprefix(prefix)
    return words


def reason_text(reason: str) -> str:
    """A reason as it is shown: the name of a result in lower case, any other text unchanged."""
    return reason.lower().replace("_", " ") if reason.isupper() else reason


RESTARTED = "the vehicle restarted"


def vehicle_name(source: Source) -> str:
    """A vehicle by its system id; the component only if it is none that autopilots have."""
    system, component = source
    return f"vehicle {system}" if component == mavlink.MAV_COMP_ID_AUTOPILOT1 else f"vehicle {system}/{component}"


MIN_V_SHOWN = 1e-4  # smaller values of V are shown as "<0.0001"


def v_text(v: float) -> str:
    """V (a Lyapunov value) in at most four digits, as it stands on every screen: "0.83", "49", "2e6", "<0.0001"."""
    if not math.isfinite(v):
        return "--"
    if v < MIN_V_SHOWN:
        return f"<{MIN_V_SHOWN:g}"
    if v < 10.0:
        return f"{v:.2g}" if v >= 0.01 else f"{v:.0e}".replace("e-0", "e-")
    return f"{v:.0f}" if v < 1e5 else f"{v:.0e}".replace("e+0", "e")


def counted(number: int, what: str) -> str:
    """A number of things: "1 item", "2 items"."""
    return f"{number} {what}{'s' * (number != 1)}"


def format_time(seconds: float) -> str:
    """Minutes and seconds, with hours if there are any: "1:23.2", "1:00:01.0"."""
    minutes, rest = divmod(round(seconds, 1), 60.0)
    hours, minutes = divmod(int(minutes), 60)
    return f"{hours}:{minutes:02d}:{rest:04.1f}" if hours else f"{minutes}:{rest:04.1f}"


def format_age(seconds: float) -> str:
    """A time in one unit, rounded down: "5 s", "3 min", "2 h"."""
    if seconds < MINUTE:
        return f"{int(seconds)} s"
    return f"{int(seconds / MINUTE)} min" if seconds < HOUR else f"{int(seconds / HOUR)} h"


def printable(text: str) -> str:
    """The text with a question mark for every character that could control a terminal."""
    return "".join(character if character.isprintable() else "?" for character in text)


SENSOR_PREFIX = "MAV_SYS_STATUS_"


def sensor_names(bits: int) -> list[str]:
    """Names of the bits of MAV_SYS_STATUS_SENSOR: "3d gyro", "gps"."""
    entries = mavlink.enums["MAV_SYS_STATUS_SENSOR"]
    names = (entries[1 << k].name if 1 << k in entries else f"sensor {k}" for k in range(32) if bits >> k & 1)
    return [name.removeprefix(SENSOR_PREFIX).removeprefix("SENSOR_").replace("_", " ").lower() for name in names]


PILOT_WORDS = {
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM: "arm/disarm",
    mavlink.MAV_CMD_NAV_TAKEOFF: "take off",
    mavlink.MAV_CMD_NAV_LAND: "land",
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: "return home",
    mavlink.MAV_CMD_DO_SET_MODE: "flight mode",
    mavlink.MAV_CMD_DO_REPOSITION: "go to",
    mavlink.MAV_CMD_DO_VTOL_TRANSITION: "transition",
    mavlink.MAV_CMD_DO_CHANGE_SPEED: "speed",
    mavlink.MAV_CMD_DO_SET_HOME: "move home",
    mavlink.MAV_CMD_DO_ORBIT: "orbit",
    mavlink.MAV_CMD_DARKO_JUMP_TO_BLOCK: "enter a block",
    mavlink.MAV_CMD_MISSION_START: "fly the mission",
    mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL: "operator control",
    mavlink.MAV_CMD_INJECT_FAILURE: "failure injection",
    mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: "reboot or shutdown",
}
TRANSITIONS = {
    float(mavlink.MAV_VTOL_STATE_FW): "front transition",
    float(mavlink.MAV_VTOL_STATE_MC): "back transition",
}
Params = Sequence[float]  # param1 to param7


def pilot_words(command: int) -> str:
    """Pilots' name for a MAV_CMD: "go to"; one that pilots do not give has its own name: "do gripper"."""
    return PILOT_WORDS.get(command) or command_name(command)


def request_words(command: int, params: Params, *, is_ours: bool = False) -> str:
    """A command with what was asked: "take off to 5 m", "front transition"; a place is left to the caller.

    Args:
        command: MAV_CMD.
        params: Its seven numbers.
        is_ours: The vehicle is a DarkO, whose slow speeds are those of the hover.
    """
    if is_ours and command == mavlink.MAV_CMD_DO_CHANGE_SPEED and 0.0 < params[1] < MIN_AIRSPEED:
        return f"hover speed {params[1]:.1f} m/s"
    in_full = _IN_FULL.get(command)
    return (in_full(params) if in_full else "") or pilot_words(command)


def _arming(params: Params) -> str:
    force = " by force" if params[1] == FORCE_ARM_DISARM else ""
    return {1.0: f"arm{force}", 0.0: f"disarm{force}"}.get(params[0], "")


def _take_off(params: Params) -> str:
    return f"take off to {params[6]:.1f} m" if math.isfinite(params[6]) else ""


def _mode(params: Params) -> str:
    mode = mode_from_parts(params[1], params[2])
    return "" if mode is None else f"mode {mode.name}"


SPEED_NAMES = {
    float(mavlink.SPEED_TYPE_AIRSPEED): "airspeed",
    float(mavlink.SPEED_TYPE_GROUNDSPEED): "ground speed",
    float(mavlink.SPEED_TYPE_CLIMB_SPEED): "climb speed",
    float(mavlink.SPEED_TYPE_DESCENT_SPEED): "descent speed",
}


def _speed(params: Params) -> str:
    if not (math.isfinite(params[1]) and params[1] > 0.0):
        return ""
    return f"{SPEED_NAMES.get(params[0], 'speed')} {params[1]:.1f} m/s"


def _mission_start(params: Params) -> str:
    return f"fly the mission from item {params[0]:.0f}" if math.isfinite(params[0]) and params[0] > 0.0 else ""


def _message_rate(params: Params) -> str:
    number, interval = params[:2]
    known = mavlink.mavlink_map.get(int(number)) if math.isfinite(number) else None
    name = f"message {number:g}" if known is None else known.msgname
    return (
        f"{name} {f'at {1e6 / interval:.3g}/s' if interval > 0.0 else 'off' if interval < 0.0 else 'at its usual rate'}"
    )


_IN_FULL: dict[int, Callable[[Params], str]] = {
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM: _arming,
    mavlink.MAV_CMD_NAV_TAKEOFF: _take_off,
    mavlink.MAV_CMD_DO_SET_MODE: _mode,
    mavlink.MAV_CMD_DO_VTOL_TRANSITION: lambda params: TRANSITIONS.get(params[0], ""),
    mavlink.MAV_CMD_DO_CHANGE_SPEED: _speed,
    mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: _message_rate,
    mavlink.MAV_CMD_MISSION_START: _mission_start,
}
