"""The vehicle's MAVLink face: endpoint on one side, craft on the other. No socket, no clock.

Two clocks meet here. What is simulated runs on simulated time: flight, autopilot, telemetry rates. What waits
for a person's or a program's answer (heartbeats, transfers, retries) runs on the link's time, which the
caller passes as ``now``; so a vehicle at 100 times real time still gives its peers real seconds to answer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Any

from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.endpoint import VehicleEndpoint
from protocol.engines.command_server import UNKNOWN_PROGRESS
from protocol.engines.files import NoFiles
from protocol.engines.stream import OFF
from protocol.events import (
    CommandCancelRequested,
    CommandRefused,
    CommandRequested,
    CurrentItemRequested,
    LogEraseRequested,
    MessageReceived,
    MessageRequested,
    MissionCleared,
    MissionReceived,
    MissionRefused,
    OperatorChanged,
    OperatorRefused,
    OperatorRequested,
    ParameterChanged,
    ParameterRefused,
    SetpointReceived,
    SigningChanged,
)
from protocol.keyring import Keyring, KeyState
from protocol.modes import Mode
from protocol.plans.mission import MissionItem
from sitl.autopilot import commands
from sitl.autopilot.home import MESSAGES, MOVES, HomeKeeper, take_message
from sitl.autopilot.link_watch import Silence
from sitl.autopilot.manual import sticks_of
from sitl.autopilot.offboard import take_setpoint
from sitl.autopilot.outcome import Notice, Outcome
from sitl.autopilot.standard_modes import CHOOSES_MODE, LIST, available_modes, current_mode, take_mode
from sitl.craft import AUTOPILOT_PERIODS, Craft
from sitl.memory import Memory, MemoryFaultError
from sitl.simulation.flight import PERIOD
from sitl.wire import hybrid, telemetry, upkeep
from sitl.wire.blackbox import Blackbox
from sitl.wire.files import VehicleFiles
from sitl.wire.flight_record import FlightRecord
from sitl.wire.keys import RefusalReport
from sitl.wire.parameter_keeper import ParameterKeeper
from sitl.wire.plans import Plans
from sitl.wire.progress_report import ProgressReport
from sitl.wire.snapshot import Picture, Status, status_of, take_picture
from sitl.wire.talk import SAME_TEXT, TextLimiter

SYSTEM, COMPONENT = 1, 1
PERIOD_US = round(PERIOD * 1e6)
MIN_QUANTUM = 5  # control periods: whatever peers ask for, the link is looked at a hundred times a second at most
NAMED_VALUE_TICKS = 100  # control ticks between NAMED_VALUE_FLOATs, for tools that know no private dialect
COMPLAIN_AGAIN = 5.0  # [s]
CONTROL_BY_ARMING = 2  # DRK_ONE_GCS
WARNING, INFO = mavlink.MAV_SEVERITY_WARNING, mavlink.MAV_SEVERITY_INFO


class Node:
    """One vehicle on the wire: ``peers`` hear it from the start, whoever speaks to it from then on.

    Call ``receive`` for every datagram, ``advance`` to fly, then send all of ``datagrams``.
    """

    def __init__(
        self,
        craft: Craft,
        memory: Memory,
        peers: Sequence[Hashable] = (),
        keyring: Keyring | None = None,
        blackbox: Blackbox | None = None,
    ) -> None:
        self.craft, self.memory = craft, memory
        keyring = keyring or Keyring()
        keep_keys = keyring.keep
        keyring.keep = lambda record: self._keep(lambda: keep_keys(record))  # a full disk ends no flight
        self._refusals = RefusalReport(keyring, lambda text: self._say(WARNING, text))
        self.identity = mavlink.MAV_AUTOPILOT_PX4  # MAV_AUTOPILOT of HEARTBEAT
        self._intended: Mode | None = None  # asked for last by a peer
        self._flight = FlightRecord(landed=craft.vehicle.law is Law.LANDED)
        self._announced: tuple[Status, int] | None = None  # by HEARTBEAT
        self._mode_told = craft.autopilot.mode
        self._control_told = (0, True)  # by its first CONTROL_STATUS
        self._limiter = TextLimiter()
        self._progress = ProgressReport(self._acknowledge)
        self.leaving: upkeep.Leaving | None = None  # a peer wants it restarted or ended, and has its answer
        self._asked: float | None = None  # the link's time while a peer's datagram is looked at
        self._home = HomeKeeper(craft.autopilot, memory)  # first: plans are relative to it
        self._plans = plans = Plans(craft.autopilot, memory, self._say, self._keep)
        self._blackbox = blackbox
        logs = blackbox or NoFiles()
        self._endpoint = VehicleEndpoint(
            system=SYSTEM,
            component=COMPONENT,
            commands=frozenset({*commands.HANDLERS, *UPKEEP}),
            parameters=craft.bindings.wire_table(),
            mission=plans.mission,
            validate=plans.validate,
            plans=plans.others,
            streams={s.message_id: round(1e6 / s.rate) if s.rate else OFF for s in telemetry.STREAMS},
            on_request=(mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES,),
            numbered={mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES: len(LIST)},
            peers=peers,
            keyring=keyring,
            files=VehicleFiles(lambda: self._endpoint.parameters, self._held, logs),
            logs=logs,
        )
        self._parameters = ParameterKeeper(craft, memory, self._endpoint.set_parameter, self._say, self._keep)
        for notice in self._home.said:
            self._say(notice.severity, notice.text)
        for text in plans.flaws:
            self._say(WARNING, text)

    # The wire

    @property
    def peers(self) -> tuple[Hashable, ...]:
        """Who hears it."""
        return tuple(self._endpoint.statistics)

    def know(self, peers: Iterable[Hashable]) -> None:
        """Speak to peers as if they had spoken: those of before a restart."""
        for peer in peers:
            self._endpoint.know(peer)

    def receive(self, data: bytes, peer: Hashable, now: float) -> None:
        """Take one datagram from a peer."""
        self._endpoint.receive_datagram(data, peer, now)
        self._handle_events(now)

    def _handle_events(self, now: float) -> None:
        self._asked = now
        events = self._endpoint.events()
        self._plans.prepare_clearing({event.kind for event in events if isinstance(event, MissionCleared)})
        for event in events:
            handler = HANDLERS.get(type(event))
            if handler is not None:
                handler(self, event, now)
        self._asked = None

    def datagrams(self, now: float) -> list[tuple[Hashable, bytes]]:
        """What is to be sent, each to its peer."""
        autopilot = self.craft.autopilot
        autopilot.failsafes.silence = self._silence(now)
        self._endpoint.operator.only_one = bool(autopilot.settings.one_operator)
        if not autopilot.armed:
            self._endpoint.operator.disarmed()
        self._announce(now)
        if autopilot.mode is not self._mode_told:
            self._mode_told = autopilot.mode
            self._endpoint.publish(current_mode(autopilot.mode, self._intended))
        self._endpoint.handle_timer(now)
        self._handle_events(now)  # those of timers, and of what was decided since
        self._progress.tell(now)
        self._tell_control()
        self._refusals.handle_timer(now)
        if withheld := self._limiter.summary(now):
            self._say(WARNING, withheld)
        return self._endpoint.datagrams_to_send()

    def _announce(self, now: float) -> None:
        status = status_of(self.craft)
        if (status, self.identity) != self._announced:
            self._announced = (status, self.identity)
            self._endpoint.announce(telemetry.heartbeat(status, self.identity), now)

    def _tell_control(self) -> None:
        control = self._control()
        if control != self._control_told:
            self._control_told = control
            self._endpoint.publish(telemetry.control_status(self.picture()))

    def _silence(self, now: float) -> Silence:
        presence, missed = self._endpoint.presence, self._endpoint.operator.missed
        return Silence(
            ground=presence.ground(now),
            in_control=None if missed is None else presence.ground(now, missed),
            companion=presence.companion(now),
        )

    # Flying

    def quantum(self) -> int:
        """Control periods to fly before a look at the link: until the autopilot ticks or a message is due."""
        vehicle = self.craft.vehicle
        tick = AUTOPILOT_PERIODS - vehicle.periods % AUTOPILOT_PERIODS
        due = self._endpoint.next_stream_due() - vehicle.periods * PERIOD_US
        return max(math.ceil(min(tick * PERIOD_US, due) / PERIOD_US), MIN_QUANTUM)

    def advance(self, ticks: int) -> None:
        """Fly, and queue the telemetry that falls due on simulated time."""
        self.craft.advance(ticks)
        now = telemetry.Instant(self.picture)
        self._report(now)
        time_us = self.craft.vehicle.periods * PERIOD_US
        for message_id, audience in self._endpoint.streams_due(time_us).items():
            self._endpoint.publish(now.message(message_id), audience)
        if self.craft.vehicle.periods % NAMED_VALUE_TICKS < ticks:
            for message in hybrid.named_values(now.picture):
                self._endpoint.publish(message)

    def picture(self) -> Picture:
        """The vehicle as telemetry sees it now."""
        in_control, takeover = self._control()
        return take_picture(self.craft)._replace(
            in_control=in_control, takeover=takeover, intended=self._intended, flight=self._flight
        )

    def _control(self) -> tuple[int, bool]:
        """Which ground station is in control (0: none), and whether another one that asks for control gets it."""
        operator = self._endpoint.operator
        holder = operator.holder
        return (holder.system if holder else 0), operator.only_one and (holder is None or operator.takeover)

    def _report(self, now: telemetry.Instant | None = None) -> list[Notice]:
        """Tell the peers what happened; what was said to the pilot."""
        autopilot, vehicle = self.craft.autopilot, self.craft.vehicle
        self._flight = self._flight.at(vehicle.time, armed=autopilot.armed, landed=vehicle.law is Law.LANDED)
        self._record(now or telemetry.Instant(self.picture))  # before the rest: a flight's log begins with its arming
        jumps = self.craft.new_jumps()
        for jump in jumps:
            self._tell(hybrid.jump(jump))
        if jumps:
            self._tell(telemetry.extended_state(self.picture()))
        for seq in autopilot.reached():
            self._tell(mavlink.MAVLink_mission_item_reached_message(seq))
            self._endpoint.publish(telemetry.mission_current(self.picture()))
        for seq, made in autopilot.decisions():
            self._tell(hybrid.decision(self.picture().ms, seq, made))
        notices = autopilot.notices()
        for notice in notices:
            self._say(notice.severity, notice.text)
        return notices

    def _say(self, severity: int, text: str, *, again: float = SAME_TEXT) -> None:
        """Tell everyone; what a peer makes the vehicle say is limited, what the flight makes it say is not."""
        if self._asked is not None and not self._limiter.admits(text, self._asked, again=again):
            return
        self._endpoint.status_text(severity, text)
        if self._blackbox is not None:
            self._blackbox.say(severity, text, self.craft.vehicle.time)

    def _tell(self, message: Any) -> None:  # noqa: ANN401 - generated messages are untyped
        """Send an event to everyone, and record it."""
        self._endpoint.publish(message)
        if self._blackbox is not None:
            self._blackbox.take(message, self.craft.vehicle.time)

    def _record(self, now: telemetry.Instant) -> None:
        if self._blackbox is None:
            return
        self._blackbox.follow(self.craft.vehicle.time, now.message, armed=self.craft.autopilot.armed)
        for text in self._blackbox.complaints():
            self._say(WARNING, text)

    # What peers ask for

    def _held(self, kind: int) -> tuple[MissionItem, ...]:
        return self._endpoint.plan(kind)

    def _on_command(self, event: CommandRequested, now: float) -> None:
        autopilot = self.craft.autopilot
        own = UPKEEP.get(event.command)
        outcome = commands.execute(autopilot, event) if own is None else own(self, event)
        takes_control = event.command == commands.ARM and autopilot.settings.one_operator == CONTROL_BY_ARMING
        if takes_control and outcome.accepted and autopilot.armed:
            self._endpoint.operator.armed(event.peer, now)
        if outcome.result == mavlink.MAV_RESULT_IN_PROGRESS and autopilot.under_way is not None:
            self._progress.follow(event.request, autopilot.under_way, now)
        else:
            self._acknowledge(event.request, outcome.result, now)
            self._progress.tell(now)  # it may have ended what was under way
        if outcome.accepted and event.command in MOVES:
            self._settle()
        if outcome.accepted and event.command in CHOOSES_MODE:
            self._intended = autopilot.mode
        said = {notice.text for notice in self._report()}
        if not outcome.accepted and outcome.text and outcome.text not in said:
            self._say(WARNING, outcome.text)

    def _store(self, event: CommandRequested) -> Outcome:
        return upkeep.store(self.craft.autopilot, event, self._parameters.reset)

    def _leave(self, event: CommandRequested) -> Outcome:
        outcome, leaving = upkeep.leave(self.craft.autopilot, event)
        self.leaving = leaving or self.leaving
        return outcome

    def _acknowledge(self, request: int, result: int, now: float, progress: int = UNKNOWN_PROGRESS) -> None:
        self._endpoint.acknowledge(request, result, now, progress=progress)

    def _on_cancel(self, event: CommandCancelRequested, now: float) -> None:  # noqa: ARG002 - one signature
        self.craft.autopilot.cancel_transition()  # the one command that takes time
        self._progress.tell(now)
        self._report()

    def _on_command_refused(self, event: CommandRefused, now: float) -> None:  # noqa: ARG002
        self._complain(commands.refusal(event.command, event.result))

    def _settle(self) -> None:
        """Keep where home and origin are now, and tell everyone, and what it means for the plans that are held."""
        self._keep(self._home.keep)
        self._tell(telemetry.global_origin(self.picture()))
        self._tell(telemetry.home_position(self.picture()))
        self._say(INFO, f"Home is {self._home.where}")
        self._plans.recheck()

    def _on_message_request(self, event: MessageRequested, now: float) -> None:  # noqa: ARG002 - one signature
        if event.message_id == mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES:
            for message in available_modes(int(event.index)):
                self._endpoint.send(message, event.peer)
        else:
            self._endpoint.send(telemetry.BUILDERS[event.message_id](self.picture()), event.peer)

    def _on_current_item(self, event: CurrentItemRequested, now: float) -> None:  # noqa: ARG002
        self.craft.autopilot.set_current_item(event.seq)
        self._endpoint.publish(telemetry.mission_current(self.picture()))

    def _on_signing(self, event: SigningChanged, now: float) -> None:  # noqa: ARG002
        if event.state is KeyState.REFUSED:
            self._complain(event.text)
        else:
            self._say(WARNING if event.state is KeyState.EXPIRED else INFO, event.text)

    def _on_setpoint(self, event: SetpointReceived, now: float) -> None:  # noqa: ARG002
        reason = take_setpoint(self.craft.autopilot, event.message)
        if reason is not None:
            self._complain(f"Set-point refused: {reason}")

    def _on_message(self, event: MessageReceived, now: float) -> None:  # noqa: ARG002
        if event.message.get_type() == "MANUAL_CONTROL" and event.message.target in {0, SYSTEM}:
            sticks = sticks_of(event.message)
            if sticks is None:
                self._complain("Sticks refused: an axis is out of its range")
            else:
                self.craft.autopilot.take_sticks(sticks)
        elif event.message.get_type() == "SET_MODE":
            self._on_mode(event.message)
        elif event.message.get_type() in MESSAGES:
            outcome = take_message(self.craft.autopilot, event.message)
            if outcome.accepted:
                self._settle()
            else:
                self._complain(outcome.text)

    def _on_mode(self, message: Message) -> None:
        outcome = take_mode(self.craft.autopilot, message)
        if outcome.accepted:
            self._intended = self.craft.autopilot.mode
        elif outcome.text not in {notice.text for notice in self._report()}:
            self._say(WARNING, outcome.text)

    def _on_log_erase(self, event: LogEraseRequested, now: float) -> None:  # noqa: ARG002
        if self._blackbox is not None:
            erased = self._blackbox.erase()
            self._say(INFO, f"{erased} log{'s' * (erased != 1)} erased")

    def _on_operator(self, event: OperatorChanged, now: float) -> None:  # noqa: ARG002
        who = f"Ground station {event.system} is in control" if event.system else "No ground station is in control"
        self._say(INFO, f"{who}: {event.why}")

    def _on_operator_refused(self, event: OperatorRefused, now: float) -> None:  # noqa: ARG002
        self._complain(f"Ground station {event.peer.system} refused: {event.holder} is in control")

    def _on_operator_requested(self, event: OperatorRequested, now: float) -> None:  # noqa: ARG002
        self._complain(f"Ground station {event.peer.system} asks {event.holder} for control")

    def _complain(self, text: str) -> None:
        """Say a thing about a stream once in a while, not as often as the stream repeats it."""
        self._say(WARNING, text, again=COMPLAIN_AGAIN)

    def _keep(self, write: Callable[[], None]) -> None:
        try:
            write()
        except MemoryFaultError as error:
            self._say(mavlink.MAV_SEVERITY_ERROR, str(error))


UPKEEP: dict[int, Callable[[Node, CommandRequested], Outcome]] = {
    mavlink.MAV_CMD_PREFLIGHT_STORAGE: lambda node, event: node._store(event),  # noqa: SLF001 - the table is part
    mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: lambda node, event: node._leave(event),  # noqa: SLF001 - of the class
}
HANDLERS: dict[type, Callable[[Node, Any, float], None]] = {
    CommandRequested: Node._on_command,  # noqa: SLF001 - the table is part of the class
    CommandCancelRequested: Node._on_cancel,  # noqa: SLF001
    CommandRefused: Node._on_command_refused,  # noqa: SLF001
    MessageRequested: Node._on_message_request,  # noqa: SLF001
    MissionReceived: lambda node, event, now: node._plans.received(event),  # noqa: ARG005, SLF001
    MissionRefused: lambda node, event, now: node._plans.refused(event),  # noqa: ARG005, SLF001
    MissionCleared: lambda node, event, now: node._plans.cleared(event),  # noqa: ARG005, SLF001
    CurrentItemRequested: Node._on_current_item,  # noqa: SLF001
    ParameterChanged: lambda node, event, now: node._parameters.changed(event),  # noqa: ARG005, SLF001
    ParameterRefused: lambda node, event, now: node._parameters.refused(event),  # noqa: ARG005, SLF001
    SigningChanged: Node._on_signing,  # noqa: SLF001
    LogEraseRequested: Node._on_log_erase,  # noqa: SLF001
    SetpointReceived: Node._on_setpoint,  # noqa: SLF001
    MessageReceived: Node._on_message,  # noqa: SLF001
    OperatorChanged: Node._on_operator,  # noqa: SLF001
    OperatorRefused: Node._on_operator_refused,  # noqa: SLF001
    OperatorRequested: Node._on_operator_requested,  # noqa: SLF001
}
