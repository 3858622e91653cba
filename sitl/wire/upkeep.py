"""Upkeep by command: what the vehicle keeps (MAV_CMD_PREFLIGHT_STORAGE), and its restart.

https://mavlink.io/en/messages/common.html#MAV_CMD_PREFLIGHT_STORAGE and #MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN. What is
acknowledged is kept already, so that reading and writing it all have nothing left to do.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import Enum, auto

from protocol.dialect import mavlink
from protocol.events import CommandRequested
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.outcome import ACCEPTED, DENIED, REJECTED, Outcome

READ, WRITE, RESET = 0.0, 1.0, 2.0  # PREFLIGHT_STORAGE_PARAMETER_ACTION, and likewise of missions
UNTOUCHED = -1.0  # ground stations say so of what they do not mean
NOTHING, REBOOT, SHUTDOWN = 0.0, 1.0, 2.0  # REBOOT_SHUTDOWN_ACTION


class Leaving(Enum):
    """Why a vehicle stops running."""

    REBOOT = auto()
    SHUTDOWN = auto()


def store(autopilot: Autopilot, request: CommandRequested, reset: Callable[[], None]) -> Outcome:
    """MAV_CMD_PREFLIGHT_STORAGE: read and write are done already, 2 returns every parameter to its default.

    Args:
        autopilot: Its arming state decides.
        request: The command.
        reset: Returns the parameters to their defaults.
    """
    parameters, missions, log_rate = (0.0 if math.isnan(value) else value for value in request.params[:3])
    if parameters not in {READ, WRITE, RESET, UNTOUCHED}:
        return _denied(f"param1 is {parameters:g}, not 0 (read), 1 (write) or 2 (reset the parameters)")
    if missions not in {READ, WRITE, UNTOUCHED}:
        return _denied(f"param2 is {missions:g}, not 0 or 1: plans are cleared by MISSION_CLEAR_ALL")
    if log_rate not in {0.0, UNTOUCHED}:
        return _denied(f"param3 is {log_rate:g}: the log has one rate")
    if parameters == RESET:
        if autopilot.armed:
            return Outcome(REJECTED, "Reset refused: disarm first, a flight keeps its parameters")
        reset()
        autopilot.say(mavlink.MAV_SEVERITY_NOTICE, "All parameters are at their defaults")
    return Outcome(ACCEPTED)


def _denied(why: str) -> Outcome:
    return Outcome(DENIED, f"Storage denied: {why}")


def leave(autopilot: Autopilot, request: CommandRequested) -> tuple[Outcome, Leaving | None]:
    """MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN of the autopilot: 1 restarts it, 2 ends it; on the ground and disarmed only.

    The parameters for companion computers, cameras and gimbals are not looked at: there are none. Gives the answer,
    and what is to be done once it is sent.
    """
    action = request.params[0]
    if action == NOTHING:
        return Outcome(ACCEPTED), None
    if action not in {REBOOT, SHUTDOWN}:
        return Outcome(DENIED, f"Reboot or shutdown? param1 is {action:g}, not 1 or 2"), None
    what, doing = ("Reboot", "Rebooting") if action == REBOOT else ("Shutdown", "Shutting down")
    if autopilot.armed or not autopilot.view.landed:
        why = "disarm first" if autopilot.armed else "not on the ground"
        return Outcome(REJECTED, f"{what} refused: {why}"), None
    autopilot.say(mavlink.MAV_SEVERITY_NOTICE, doing)
    return Outcome(ACCEPTED), Leaving.REBOOT if action == REBOOT else Leaving.SHUTDOWN
