"""Commands over the link: the autopilot's, long ones, maintenance, and injected failures."""

from __future__ import annotations

import math
from collections.abc import Iterable
from enum import Enum, auto

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.events import CommandCancelRequested, CommandRefused, CommandRequested
from protocol.wire.message import Message
from sitl.autopilot.answers import ACCEPTED, DENIED, REJECTED, Answer
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.guided import Transition
from sitl.mavlink import commands
from sitl.mavlink.broadcast import Broadcast, FlightReporter
from sitl.mavlink.commands import HOME_COMMANDS
from sitl.mavlink.handlers import handlers_of, on_command, on_event, on_message
from sitl.mavlink.services.home_service import HomeService
from sitl.mavlink.services.operator_service import OperatorService, ParameterService
from sitl.mavlink.standard_modes import MODE_COMMANDS, take_mode
from sitl.mavlink.telemetry.telemetry_service import TelemetryService
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.injected_failures import ALL, FAILURE_TYPES, FLICKER_TIME

# Commands of peers: carried out, answered, and explained if they are refused.
#
# https://mavlink.io/en/services/command.html

# Progress of a long running command: IN_PROGRESS again and again, then the result.
#
# https://mavlink.io/en/services/command.html#long_running_commands


FLIGHT_WORDS = {  # commands that move the vehicle, stop it or change where it returns to
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM: "arm",
    mavlink.MAV_CMD_NAV_TAKEOFF: "take off",
    mavlink.MAV_CMD_NAV_VTOL_TAKEOFF: "take off",
    mavlink.MAV_CMD_NAV_LAND: "land",
    mavlink.MAV_CMD_NAV_VTOL_LAND: "land",
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: "return home",
    mavlink.MAV_CMD_DO_REPOSITION: "go to a place",
    mavlink.MAV_CMD_DO_SET_MODE: "change the mode",
    mavlink.MAV_CMD_DO_SET_STANDARD_MODE: "change the mode",
    mavlink.MAV_CMD_DO_PAUSE_CONTINUE: "pause or go on",
    mavlink.MAV_CMD_MISSION_START: "fly the mission",
    mavlink.MAV_CMD_DO_SET_MISSION_CURRENT: "go on at another item",
    mavlink.MAV_CMD_DO_VTOL_TRANSITION: "transition",
    mavlink.MAV_CMD_DO_CHANGE_SPEED: "change the speed",
    mavlink.MAV_CMD_DO_FLIGHTTERMINATION: "end the flight",
    mavlink.MAV_CMD_DO_SET_HOME: "move home",
}
INTERVAL = 0.4  # QGroundControl gives up after 1.2 s of silence, MAVSDK after 3 s [s of the link's time]


class CommandProgressReporter:
    """Reports the progress of the one long running command. Call ``report`` whenever something may be sent.

    Args:
        endpoint: Sends the answers.
    """

    def __init__(self, endpoint: VehicleEndpoint) -> None:
        self._endpoint = endpoint
        self._request = 0
        self._transition: Transition | None = None
        self._due = math.inf

    def follow(self, request: int, transition: Transition, now: float) -> None:
        """A command has begun: send its first answer.

        Args:
            request: Number of the request.
            transition: What it began.
            now: The link's time [s].
        """
        self._request, self._transition, self._due = request, transition, now
        self.report(now)

    def report(self, now: float) -> None:
        """Send an answer if one is due or the command has ended."""
        transition = self._transition
        if transition is None:
            return
        if transition.end is not None:
            self._transition, self._due = None, math.inf
            self._endpoint.acknowledge(self._request, transition.end.result, now, progress=0)
        elif now >= self._due:
            self._due = now + INTERVAL
            self._endpoint.acknowledge(self._request, mavlink.MAV_RESULT_IN_PROGRESS, now, progress=transition.percent)


# Commands about the vehicle itself: stored parameters (MAV_CMD_PREFLIGHT_STORAGE), reboot and shutdown.
#
# https://mavlink.io/en/messages/common.html#MAV_CMD_PREFLIGHT_STORAGE and #MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN. What is
# acknowledged is on the disk already, so that reading and writing it all have nothing left to do.


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


# Injected failures over the link (MAV_CMD_INJECT_FAILURE), and the link's own.
#
# https://mavlink.io/en/messages/common.html#MAV_CMD_INJECT_FAILURE. A link that is off can hear no command that heals
# it: it comes back by itself after SIM_LINK_OFF_T.


_HEALTHY, _INTERMITTENT = mavlink.FAILURE_TYPE_OK, mavlink.FAILURE_TYPE_INTERMITTENT


class FailureService:
    """Carries the command out, and says whether the link works.

    Args:
        aircraft: What fails.
    """

    def __init__(self, aircraft: Aircraft) -> None:
        self._aircraft = aircraft
        self._failed_at: float | None = None  # when the link began to fail, on the link's time [s]

    @on_command(mavlink.MAV_CMD_INJECT_FAILURE)
    def inject(self, request: CommandRequested) -> Answer:
        """param1 FAILURE_UNIT, param2 FAILURE_TYPE, param3 instance; 0 or NaN: all."""
        if not self._aircraft.configuration.settings.failure_injection:
            return Answer(DENIED, "Failure denied: set SYS_FAILURE_EN to 1 first")
        unit, failure, instance = map(int, (request.params[0], request.params[1], request.param(3, ALL)))
        if failure not in FAILURE_TYPES:
            return Answer(DENIED, f"Failure denied: {failure} is not a FAILURE_TYPE")
        answer = self._aircraft.failures.inject(unit, failure, instance)
        if answer.accepted:
            self._aircraft.autopilot.say(mavlink.MAV_SEVERITY_WARNING, answer.text)
        return answer

    def carries(self, now: float) -> bool:
        """Whether datagrams come and go.

        Args:
            now: The link's time [s].
        """
        failure = self._aircraft.failures.link
        if failure == _HEALTHY or self._failed_at is None:
            return True
        elapsed = now - self._failed_at
        if failure == _INTERMITTENT:
            return int(elapsed / FLICKER_TIME) % 2 == 1
        if elapsed >= self._aircraft.configuration.world.link_off_time:
            self._aircraft.failures.link, self._failed_at = _HEALTHY, None
            self._aircraft.autopilot.say(mavlink.MAV_SEVERITY_INFO, "Link is back")
            return True
        return False

    def sent(self, now: float) -> None:
        """Everything was sent up to a link's time [s], the answer to the command as well: a failure begins."""
        is_failing = self._aircraft.failures.link != _HEALTHY
        self._failed_at = (now if self._failed_at is None else self._failed_at) if is_failing else None


class CommandService:
    """Carries commands out, and sees to what follows from them.

    Args:
        autopilot: Carries out most of them.
        own: Carry out those about the vehicle itself.
        endpoint: Sends the answers.
        broadcast: Tells everyone a text.
        telemetry: Reports the mode that a peer wants.
        reporter: Reports what a command has caused.
        operators: Arming may put a station in control.
        home: Follows moves of home and origin.
    """

    def __init__(
        self,
        *,
        autopilot: Autopilot,
        own: Iterable[object],
        endpoint: VehicleEndpoint,
        broadcast: Broadcast,
        telemetry: TelemetryService,
        reporter: FlightReporter,
        operators: OperatorService,
        home: HomeService,
    ) -> None:
        self._autopilot, self._endpoint, self._broadcast = autopilot, endpoint, broadcast
        self._telemetry, self._reporter, self._operators, self._home = telemetry, reporter, operators, home
        self._own = handlers_of(own, int)
        self._progress = CommandProgressReporter(endpoint)

    def handle_timer(self, now: float) -> None:
        """Report the progress of a long running command.

        Args:
            now: The link's time [s].
        """
        self._progress.report(now)

    @on_event(CommandRequested)
    def execute(self, event: CommandRequested, now: float) -> None:
        """A peer wants a command carried out."""
        own = self._own.get(event.command)
        answer = commands.execute(self._autopilot, event) if own is None else own(event)
        if event.command == commands.ARM and answer.accepted and self._autopilot.armed:
            self._operators.armed_by(event.peer, now)
        self._tell_others(event, answer)
        reported = self._reporter.report()  # what the answer says has been told when it arrives
        self._answer(event, answer, now)
        if answer.accepted and event.command == mavlink.MAV_CMD_DO_SET_MISSION_CURRENT:
            self._telemetry.publish_now(mavlink.MAVLINK_MSG_ID_MISSION_CURRENT)
        if answer.accepted and event.command in HOME_COMMANDS:
            self._home.follow_move()
        if answer.accepted and event.command in MODE_COMMANDS:
            self._telemetry.intended_mode = self._autopilot.mode
        self._explain(answer, reported)

    @on_event(CommandCancelRequested)
    def cancel(self, _event: CommandCancelRequested, now: float) -> None:
        """A peer cancels the one command that takes time."""
        self._autopilot.transitions.cancel()
        self._progress.report(now)
        self._reporter.report()

    @on_event(CommandRefused)
    def explain_refusal(self, event: CommandRefused, _now: float) -> None:
        """The endpoint has refused a command."""
        if event.reason:
            self._broadcast.warn(event.reason)
        else:
            self._broadcast.complain(commands.refusal(event.command, event.result))

    @on_message("SET_MODE")
    def set_mode(self, message: Message) -> None:
        """An old form of MAV_CMD_DO_SET_MODE, whose only answer is the mode in HEARTBEAT."""
        answer = take_mode(self._autopilot, message)
        if answer.accepted:
            self._telemetry.intended_mode = self._autopilot.mode
        else:
            self._explain(answer, self._reporter.report())

    def _answer(self, event: CommandRequested, answer: Answer, now: float) -> None:
        transition = self._autopilot.transitions.under_way
        if answer.result == mavlink.MAV_RESULT_IN_PROGRESS and transition is not None:
            self._progress.follow(event.request, transition, now)
        else:
            self._endpoint.acknowledge(event.request, answer.result, now)
            self._progress.report(now)  # the command may have ended what was under way

    def _tell_others(self, event: CommandRequested, answer: Answer) -> None:
        """Another pilot sees why the vehicle moves: by its texts a ground station cannot tell whose command it was."""
        words = FLIGHT_WORDS.get(event.command)
        if words and answer.result in {ACCEPTED, mavlink.MAV_RESULT_IN_PROGRESS}:
            words = "disarm" if event.command == commands.ARM and not event.params[0] else words
            self._broadcast.others(event.peer, f"Ground station {event.peer.system} commanded: {words}")

    def _explain(self, answer: Answer, reported: set[str]) -> None:
        """Tell why a request was refused, unless the autopilot has reported it."""
        if not answer.accepted and answer.text and answer.text not in reported:
            self._broadcast.warn(answer.text)
