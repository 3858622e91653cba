"""Modes by name, for ground stations that ask (https://mavlink.io/en/services/standard_modes.html).

The list holds the modes that can be selected, then the control laws. No command selects a law, the supervisor does, so
they are marked as not selectable. Their ``custom_mode`` has a main mode of its own and is never in HEARTBEAT.
"""

from __future__ import annotations

from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.events import CommandRequested
from protocol.names import Mode, custom_mode, mode_from_custom
from protocol.wire.message import Message
from sitl.autopilot.answers import DENIED, Answer
from sitl.autopilot.autopilot import Autopilot

NON_STANDARD = mavlink.MAV_STANDARD_MODE_NON_STANDARD
ADVANCED = mavlink.MAV_MODE_PROPERTY_ADVANCED
NOT_SELECTABLE = ADVANCED | mavlink.MAV_MODE_PROPERTY_NOT_USER_SELECTABLE
LAW_MAIN_MODE = 0x4C  # main mode of the laws; PX4 counts its own from 1 up

STANDARD_MODES: dict[Mode, int] = {
    Mode.POSCTL: mavlink.MAV_STANDARD_MODE_POSITION_HOLD,
    Mode.RTL: mavlink.MAV_STANDARD_MODE_SAFE_RECOVERY,
    Mode.MISSION: mavlink.MAV_STANDARD_MODE_MISSION,
    Mode.LAND: mavlink.MAV_STANDARD_MODE_LAND,
    Mode.TAKEOFF: mavlink.MAV_STANDARD_MODE_TAKEOFF,
}
# Commands after which the mode is the one that the pilot wants.
MODE_COMMANDS = frozenset(
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


class AvailableMode(NamedTuple):
    """One entry of the list."""

    name: str  # empty for standard modes, which ground stations name themselves
    standard: int  # MAV_STANDARD_MODE
    custom: int
    properties: int = 0  # MAV_MODE_PROPERTY


AVAILABLE_MODES: tuple[AvailableMode, ...] = (
    *(AvailableMode("", standard, custom_mode(mode)) for mode, standard in STANDARD_MODES.items()),
    AvailableMode("Hold", NON_STANDARD, custom_mode(Mode.HOLD)),
    AvailableMode("Flight plan", NON_STANDARD, custom_mode(Mode.FLIGHT_PLAN)),
    AvailableMode("Offboard", NON_STANDARD, custom_mode(Mode.OFFBOARD), ADVANCED),
    *(
        AvailableMode(
            f"Law: {law.name.lower().replace('_', ' ')}", NON_STANDARD, LAW_MAIN_MODE << 16 | law << 24, NOT_SELECTABLE
        )
        for law in Law
    ),
)


def available_modes(index: int) -> list[Message]:
    """AVAILABLE_MODES messages: one entry by its number from 1, or all for 0."""
    chosen = (index,) if index else range(1, len(AVAILABLE_MODES) + 1)
    return [_message(n, AVAILABLE_MODES[n - 1]) for n in chosen]


def available_modes_monitor() -> Message:
    """AVAILABLE_MODES_MONITOR: the list never changes, so its sequence number stays 0."""
    return mavlink.MAVLink_available_modes_monitor_message(0)


def current_mode(mode: Mode, intended: Mode | None) -> Message:
    """CURRENT_MODE; ``intended`` is the mode that was last requested, None before the first request."""
    wanted = 0 if intended is None else custom_mode(intended)
    return mavlink.MAVLink_current_mode_message(STANDARD_MODES.get(mode, NON_STANDARD), custom_mode(mode), wanted)


def set_standard_mode(autopilot: Autopilot, request: CommandRequested) -> Answer:
    """MAV_CMD_DO_SET_STANDARD_MODE; a mode that is not in the list fails, as the definition demands."""
    wanted = request.params[0]
    mode = next((mode for mode, standard in STANDARD_MODES.items() if standard == wanted), None)
    if mode is None:
        return Answer(mavlink.MAV_RESULT_FAILED, f"Standard mode {wanted:g} is not available")
    return autopilot.set_mode(mode)


def take_mode(autopilot: Autopilot, message: Message) -> Answer:
    """SET_MODE, by which QGroundControl switches the modes of a PX4; its only answer is the mode in HEARTBEAT."""
    mode = mode_from_custom(message.custom_mode)
    if mode is None or not message.base_mode & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
        return Answer(DENIED, f"Mode {message.custom_mode} is not available")
    return autopilot.set_mode(mode)


def _message(number: int, entry: AvailableMode) -> Message:
    return mavlink.MAVLink_available_modes_message(
        number_modes=len(AVAILABLE_MODES),
        mode_index=number,
        standard_mode=entry.standard,
        custom_mode=entry.custom,
        properties=entry.properties,
        mode_name=entry.name.encode("ascii"),
    )
