"""Commands of peers: carried out, answered, and explained if they are refused.

https://mavlink.io/en/services/command.html
"""

from __future__ import annotations

from collections.abc import Iterable

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.events import CommandCancelRequested, CommandRefused, CommandRequested
from protocol.wire.message import Message
from sitl.autopilot.answers import Answer
from sitl.autopilot.autopilot import Autopilot
from sitl.mavlink import commands
from sitl.mavlink.broadcast import Broadcast
from sitl.mavlink.flight_report import FlightReporter
from sitl.mavlink.handlers import handlers_of, on_event, on_message
from sitl.mavlink.home_requests import HOME_COMMANDS
from sitl.mavlink.services.command_progress import CommandProgressReporter
from sitl.mavlink.services.home_service import HomeService
from sitl.mavlink.services.operator_service import OperatorService
from sitl.mavlink.standard_modes import MODE_COMMANDS, take_mode
from sitl.mavlink.telemetry.telemetry_service import TelemetryService


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

    def _explain(self, answer: Answer, reported: set[str]) -> None:
        """Tell why a request was refused, unless the autopilot has reported it."""
        if not answer.accepted and answer.text and answer.text not in reported:
            self._broadcast.warn(answer.text)
