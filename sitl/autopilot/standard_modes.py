"""Modes by name, for ground stations that ask (https://mavlink.io/en/services/standard_modes.html).

The list holds what can be selected, then the control laws: no command selects a law, the supervisor does, so they
are marked as not selectable. Their ``custom_mode`` is in a main mode of their own and never in HEARTBEAT.
"""

from __future__ import annotations

from typing import NamedTuple

from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.events import CommandRequested
from protocol.modes import Mode, custom_mode, mode_from_custom
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.outcome import DENIED, Outcome

NON_STANDARD = mavlink.MAV_STANDARD_MODE_NON_STANDARD
ADVANCED = mavlink.MAV_MODE_PROPERTY_ADVANCED
LISTED_ONLY = ADVANCED | mavlink.MAV_MODE_PROPERTY_NOT_USER_SELECTABLE
LAW_MAIN = 0x4C  # main mode of the laws; PX4 counts its own from 1 up

STANDARD: dict[Mode, int] = {
    Mode.POSCTL: mavlink.MAV_STANDARD_MODE_POSITION_HOLD,
    Mode.RTL: mavlink.MAV_STANDARD_MODE_SAFE_RECOVERY,
    Mode.MISSION: mavlink.MAV_STANDARD_MODE_MISSION,
    Mode.LAND: mavlink.MAV_STANDARD_MODE_LAND,
    Mode.TAKEOFF: mavlink.MAV_STANDARD_MODE_TAKEOFF,
}
# Commands after which the mode is the one the pilot wanted.
CHOOSES_MODE = frozenset(
    {
        mavlink.MAV_CMD_DO_SET_MODE,
        mavlink.MAV_CMD_DO_SET_STANDARD_MODE,
        mavlink.MAV_CMD_NAV_TAKEOFF,
        mavlink.MAV_CMD_NAV_VTOL_TAKEOFF,
        mavlink.MAV_CMD_NAV_LAND,
        mavlink.MAV_CMD_NAV_VTOL_LAND,
        mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH,
        mavlink.MAV_CMD_NAV_LOITER_UNLIM,
        mavlink.MAV_CMD_MISSION_START,
        mavlink.MAV_CMD_DO_REPOSITION,
        mavlink.MAV_CMD_DO_PAUSE_CONTINUE,
        mavlink.MAV_CMD_DO_ORBIT,
    }
)


class Listed(NamedTuple):
    """One entry of the list."""

    name: str  # empty for standard modes, which ground stations name themselves
    standard: int  # MAV_STANDARD_MODE
    custom: int
    properties: int = 0  # MAV_MODE_PROPERTY


LIST: tuple[Listed, ...] = (
    *(Listed("", standard, custom_mode(mode)) for mode, standard in STANDARD.items()),
    Listed("Hold", NON_STANDARD, custom_mode(Mode.HOLD)),
    Listed("Offboard", NON_STANDARD, custom_mode(Mode.OFFBOARD), ADVANCED),
    *(
        Listed(f"Law: {law.name.lower().replace('_', ' ')}", NON_STANDARD, LAW_MAIN << 16 | law << 24, LISTED_ONLY)
        for law in Law
    ),
)


def available_modes(index: int) -> list[Message]:
    """AVAILABLE_MODES, one entry by its number from 1 to ``len(LIST)``; 0 is all."""
    chosen = (index,) if index else range(1, len(LIST) + 1)
    return [_message(n, LIST[n - 1]) for n in chosen]


def available_modes_monitor() -> Message:
    """AVAILABLE_MODES_MONITOR: the list never changes, so its count of changes does not."""
    return mavlink.MAVLink_available_modes_monitor_message(0)


def current_mode(mode: Mode, intended: Mode | None) -> Message:
    """CURRENT_MODE; ``intended`` is the mode last asked for, None before anything was."""
    wanted = 0 if intended is None else custom_mode(intended)
    return mavlink.MAVLink_current_mode_message(STANDARD.get(mode, NON_STANDARD), custom_mode(mode), wanted)


def set_standard_mode(autopilot: Autopilot, request: CommandRequested) -> Outcome:
    """MAV_CMD_DO_SET_STANDARD_MODE; one that is not in the list fails, as the command's definition wants."""
    wanted = request.params[0]
    mode = next((mode for mode, standard in STANDARD.items() if standard == wanted), None)
    if mode is None:
        return Outcome(mavlink.MAV_RESULT_FAILED, f"Standard mode {wanted:g} is not available on this vehicle")
    return autopilot.set_mode(mode)


def take_mode(autopilot: Autopilot, message: Message) -> Outcome:
    """SET_MODE, which has no answer but the mode in HEARTBEAT: how QGroundControl switches the modes of a PX4."""
    mode = mode_from_custom(message.custom_mode)
    if mode is None or not message.base_mode & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
        return Outcome(DENIED, f"Mode {message.custom_mode} is unknown")
    return autopilot.set_mode(mode)


def _message(number: int, entry: Listed) -> Message:
    return mavlink.MAVLink_available_modes_message(
        len(LIST), number, entry.standard, entry.custom, entry.properties, entry.name.encode("ascii")
    )
