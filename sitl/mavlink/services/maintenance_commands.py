"""Commands about the vehicle itself: stored parameters (MAV_CMD_PREFLIGHT_STORAGE), reboot and shutdown.

https://mavlink.io/en/messages/common.html#MAV_CMD_PREFLIGHT_STORAGE and #MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN. What is
acknowledged is on the disk already, so that reading and writing it all have nothing left to do.
"""

from __future__ import annotations

import math
from enum import Enum, auto

from protocol.dialect import mavlink
from protocol.events import CommandRequested
from sitl.autopilot.answers import ACCEPTED, DENIED, REJECTED, Answer
from sitl.autopilot.autopilot import Autopilot
from sitl.mavlink.handlers import on_command
from sitl.mavlink.services.parameter_service import ParameterService

READ, WRITE, RESET = 0.0, 1.0, 2.0  # PREFLIGHT_STORAGE_PARAMETER_ACTION, and PREFLIGHT_STORAGE_MISSION_ACTION
UNTOUCHED = -1.0  # ground stations send it for what they leave alone
NOTHING, REBOOT, SHUTDOWN = 0.0, 1.0, 2.0  # REBOOT_SHUTDOWN_ACTION


class ExitRequest(Enum):
    """A peer's request to end or restart the process."""

    REBOOT = auto()
    SHUTDOWN = auto()


class MaintenanceCommands:
    """Carries them out; ``exit_request`` is set once a reboot or a shutdown is accepted.

    Args:
        autopilot: Reset, reboot and shutdown depend on whether it is armed.
        parameters: Resets the parameters.
        exit_refusal: Why no peer may reboot or shut down this vehicle; empty if they may.
    """

    def __init__(self, autopilot: Autopilot, parameters: ParameterService, exit_refusal: str = "") -> None:
        self._autopilot, self._parameters, self._exit_refusal = autopilot, parameters, exit_refusal
        self.exit_request: ExitRequest | None = None

    @on_command(mavlink.MAV_CMD_PREFLIGHT_STORAGE)
    def store(self, request: CommandRequested) -> Answer:
        """MAV_CMD_PREFLIGHT_STORAGE: read and write are done already, 2 returns every parameter to its default."""
        parameters, missions, log_rate = (0.0 if math.isnan(value) else value for value in request.params[:3])
        if missions not in {READ, WRITE, UNTOUCHED}:
            return _storage_denied(f"param2 is {missions:g}, not 0 or 1: MISSION_CLEAR_ALL clears plans")
        if log_rate not in {0.0, UNTOUCHED}:
            return _storage_denied(f"param3 is {log_rate:g}: the log has one rate")
        if parameters == RESET:
            if self._autopilot.armed:
                return Answer(REJECTED, "Reset refused: disarm first, a flight keeps its parameters")
            self._parameters.reset()
            self._autopilot.say(mavlink.MAV_SEVERITY_NOTICE, "All parameters are at their defaults")
        return Answer(ACCEPTED)

    @on_command(mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN)
    def exit(self, request: CommandRequested) -> Answer:
        """MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN of the autopilot: 1 reboots, 2 shuts down; only disarmed on the ground.

        The parameters for companion computers, cameras and gimbals are ignored: there are none.
        """
        if self._exit_refusal:
            return Answer(DENIED, self._exit_refusal)
        action = request.params[0]
        if action == NOTHING:
            return Answer(ACCEPTED)
        name, doing = ("Reboot", "Rebooting") if action == REBOOT else ("Shutdown", "Shutting down")
        if self._autopilot.armed or not self._autopilot.view.landed:
            why = "disarm first" if self._autopilot.armed else "not on the ground"
            return Answer(REJECTED, f"{name} refused: {why}")
        self._autopilot.say(mavlink.MAV_SEVERITY_NOTICE, doing)
        self.exit_request = ExitRequest.REBOOT if action == REBOOT else ExitRequest.SHUTDOWN
        return Answer(ACCEPTED)


def _storage_denied(why: str) -> Answer:
    return Answer(DENIED, f"Storage denied: {why}")
