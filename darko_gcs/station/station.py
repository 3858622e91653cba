"""The ground station without a socket, a clock or a screen: endpoint, snapshot and recording in one object."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from darko_gcs.state.alerts import MAX_ALERTS, AlertWatch, acknowledged
from darko_gcs.state.arrivals import arrived, asked_point
from darko_gcs.state.field_history import FieldHistory
from darko_gcs.state.message_log import add_line
from darko_gcs.state.number_ranges import fault_words
from darko_gcs.state.parts import ParameterTable
from darko_gcs.state.reduce import reduce
from darko_gcs.state.reduce_events import reduce_event
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.state.speed_in_force import asked_speed
from darko_gcs.state.sticks import Sticks
from darko_gcs.state.text import RESTARTED, request_words
from darko_gcs.state.traffic import LiveTraffic
from darko_gcs.state.values import Alert, LegChain
from darko_gcs.station.armed_take_off import ArmedTakeOff
from darko_gcs.station.family_requests import FamilyRequests
from darko_gcs.station.keyring_setup import SigningClient
from darko_gcs.station.leg_prediction_client import LegPredictionClient
from darko_gcs.station.parameter_requests import ParameterChanges, ParameterMetadataClient
from darko_gcs.station.plan_requests import FlightPlanRequests, PlanRequests
from protocol import units
from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.errors import FileError, LocalProtocolError
from protocol.events import Event, VehicleRestarted
from protocol.frames import LocalFrame
from protocol.names import FORCE_ARM_DISARM, Mode, custom_mode
from protocol.tlog import TlogWriter
from protocol.tools.option_values import GROUND_SYSTEM
from protocol.wire.codec import SourceStatistics
from protocol.wire.message import Message, Source, source_of
from protocol.wire.message_frames import make_frame
from protocol.wire.other_dialects import OtherDialect
from protocol.wire.signing import KeyRecord, Keyring, is_secret

MAX_OTHER_VEHICLES = 4  # beside the selected one that are reported


class OtherVehicles(Protocol):
    """Takes messages of other vehicles, and may have something to send to them."""

    def take(self, message: Message, now: float) -> None:
        """Take a message of another vehicle."""

    def tick(self, now: float) -> None:
        """Let time pass [s]."""

    def commands(self, system: int) -> bool:
        """Whether a vehicle is commanded from here, so that what is sent has to reach it."""

    def outgoing(self) -> list[bytes]:
        """Datagrams to send now."""


class UnshownVehicles:
    """Reports each other vehicle once.

    Args:
        report: Takes a time [s] and a text for the operator.
    """

    def __init__(self, report: Callable[[float, str], None]) -> None:
        self._report = report
        self._reported: set[Source] = set()

    def take(self, message: Message, now: float) -> None:
        """Report the sender if it is a vehicle that was not reported yet."""
        source = source_of(message)
        is_new = is_vehicle_heartbeat(message) and source not in self._reported
        if is_new and len(self._reported) < MAX_OTHER_VEHICLES:
            self._reported.add(source)
            self._report(now, f"Another vehicle, {source[0]}/{source[1]}, is on the link: it is not shown")

    def tick(self, now: float) -> None:
        """Nothing waits."""

    def commands(self, system: int) -> bool:  # noqa: ARG002 - of the protocol
        """None is."""
        return False

    def outgoing(self) -> list[bytes]:
        """Nothing is sent to them."""
        return []


def is_vehicle_heartbeat(message: Message) -> bool:
    """True for the HEARTBEAT of an autopilot."""
    return bool(message.get_type() == "HEARTBEAT" and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID)


RATE_WINDOW = 2.0  # between updates of message rate and loss [s]
CONTROL_TIMEOUT = 10.0  # for another station to answer a request for control [s]
_NAN = math.nan


class Station:
    """One operator's side of one vehicle.

    The owner moves bytes and time: ``receive`` each datagram, ``tick`` often, send what ``outgoing`` returns. The
    vehicle's answers to requests are in the snapshot's message log and in ``events``.

    One vehicle is selected for good: the first that is heard, or the one asked for. Messages of other vehicles are
    recorded, and left to ``others``.

    Args:
        recorder: Records accepted and sent frames. A disk that fails ends the recording, not the flight.
        keyring: Signs, and decides which frames are accepted.
        give_key: Give our key to a vehicle that has none.
        vehicle: System id of the vehicle; None selects the first that is heard.
        beside: The endpoint that has the link, if this station is for another vehicle on it; see ``Fleet``.
        other: Decodes messages that our dialect has not.
        system: Own system id, if not ``beside`` another one.

    Attributes:
        plans: Requests about mission, fence and rally points.
        flight_plan: Requests about the flight plan.
        snapshot: What is known of the vehicle.
        traffic: Every message of the link.
        history: What the vehicle that is charted said.
    """

    def __init__(
        self,
        recorder: TlogWriter | None = None,
        keyring: Keyring | None = None,
        *,
        give_key: bool = False,
        vehicle: int | None = None,
        beside: GroundEndpoint | None = None,
        other: OtherDialect | None = None,
        system: int = GROUND_SYSTEM,
    ) -> None:
        self._save_failed = False  # of the signing time: reported once
        if keyring is not None:
            keyring.keep = self._keep_safely(keyring.keep)
        self.endpoint = GroundEndpoint(system=system, keyring=keyring, vehicle=vehicle, beside=beside, other=other)
        self.traffic, self.history = LiveTraffic(self.endpoint.codec), FieldHistory()
        self.others: OtherVehicles = UnshownVehicles(self.add_line)
        self.heard_beside = False  # whether the last datagram was of a vehicle that is commanded beside this one
        self.signing = SigningClient(self.endpoint, give_key=give_key)
        self.leg_predictions = LegPredictionClient(self.endpoint)
        self.parameter_metadata = ParameterMetadataClient(self.endpoint)
        self._parameter_changes, self._alerts = ParameterChanges(self.endpoint), AlertWatch()
        self._families = FamilyRequests(self.endpoint)
        self._own: Source = (self.endpoint.codec.system, self.endpoint.codec.component)
        self._has_twin = False  # another station with our ids was heard: told once
        session = EMPTY_SNAPSHOT.session._replace(own_system=self._own[0])
        self.snapshot: Snapshot = EMPTY_SNAPSHOT._replace(session=session)
        self.recording_fault = ""  # why the recording ended
        self._recorder = recorder
        self._armed_take_off = ArmedTakeOff(self)
        self.plans = PlanRequests(self)
        self.flight_plan = FlightPlanRequests(self)
        self._events: list[Event] = []
        self._last_rate = (0.0, 0)  # time [s] and message count of the last update of the rate

    # Bytes and time

    def receive(self, data: bytes, now: float, time_usec: int) -> bool:
        """Take one datagram. Returns True if the vehicle sent it: answers go to its address.

        While no accepted vehicle is present, a vehicle that does not sign correctly counts as well: it may be given a
        key, and a vehicle whose clock is behind catches up with the timestamps that it hears.

        Args:
            data: Its bytes.
            now: On the caller's monotonic clock [s].
            time_usec: Since 1970, for the log [us].
        """
        for message in (messages := self.endpoint.receive_datagram(data, now)):
            self._record(bytes(message.get_msgbuf()), time_usec, now)
        self.traffic.take(messages, now)
        self.history.take(messages, now)
        return self.take(messages, now) or (self.endpoint.heard_refused and not self.endpoint.is_present)

    def take(self, messages: Sequence[Message], now: float) -> bool:
        """Take messages that the endpoint has taken. Returns True if the vehicle sent one."""
        from_vehicle, restarts = False, self.snapshot.link.restarts
        self.heard_beside = any(self.others.commands(source_of(message)[0]) for message in messages)
        for message in messages:
            if self._is_selected(message, now):
                self.snapshot = reduce(self.snapshot, message, now)
                self.parameter_metadata.receive(message, now)
                self.leg_predictions.receive(message, now)
                self._families.receive(message, now)
            if source_of(message) == self._own and message.get_type() == "HEARTBEAT":
                self._tell_twin(now)
            self.signing.receive(message)
            from_vehicle = from_vehicle or source_of(message) == self.endpoint.vehicle
        if self.snapshot.link.restarts != restarts:
            self._handle_restart(now)
        self._collect(now)
        return from_vehicle

    def tick(self, now: float) -> None:
        """Let time pass: resends, loss of the vehicle, link statistics."""
        self.endpoint.handle_timer(now)
        self._families.handle_timer(now)
        self.leg_predictions.handle_timer(now)
        self._update_signing(now)
        self._collect(now)
        self.snapshot = self._parameter_changes.handle_timer(self.snapshot, now)
        self._update_rate(now)
        self.snapshot = arrived(self._alerts.look(self.snapshot, now), now)
        self.others.tick(now)

    def outgoing(self, now: float, time_usec: int) -> list[bytes]:
        """Datagrams to send now; they are recorded as sent."""
        datagrams = self.endpoint.datagrams_to_send() + self.others.outgoing()
        for data in datagrams:
            self._record(data, time_usec, now)
        return datagrams

    def events(self) -> list[Event]:
        """Events since the last call."""
        events, self._events = self._events, []
        return events

    def report_recording_fault(self, reason: str, now: float) -> None:
        """Show the operator that the flight is not recorded."""
        self.recording_fault = reason
        self.snapshot = self.snapshot._replace(session=self.snapshot.session._replace(unrecorded=True))
        self.add_line(now, f"NOT RECORDING: {reason}", mavlink.MAV_SEVERITY_ERROR)

    def close(self) -> None:
        """Close the recording; ``recording_fault`` is set if that fails."""
        if self._recorder is None:
            return
        try:
            self._recorder.close()
        except FileError as error:
            self.recording_fault = str(error)

    # Requests of the operator; the message log shows the result of each.

    def arm(self, now: float) -> None:
        """Start the motors at idle."""
        self._command(now, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0, 0.0)

    def disarm(self, now: float, *, force: bool = False) -> None:
        """Stop the motors; with ``force`` also in flight."""
        self._command(now, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, float(FORCE_ARM_DISARM) if force else 0.0)

    def take_off(self, height: float, now: float, *, arm: bool = False) -> None:
        """Climb to a height above home [m]; with ``arm`` start the motors first, and stop them if it is refused."""
        here = self.snapshot.position.geodetic
        place = (units.UNKNOWN_INT32,) * 2 if here is None else (units.to_e7(here.lat_deg), units.to_e7(here.lon_deg))
        self.snapshot = self.snapshot._replace(operator=self.snapshot.operator._replace(take_off_height=height))
        params = (_NAN, _NAN, _NAN, _NAN)

        def send() -> None:
            self.attempt(now, lambda: self._send_int(now, mavlink.MAV_CMD_NAV_TAKEOFF, params, (*place, height)))

        self.arm_for(mavlink.MAV_CMD_NAV_TAKEOFF, send, now) if arm else send()

    def arm_for(self, command: int, send: Callable[[], None], now: float) -> None:
        """Start the motors for a MAV_CMD, and send it; if that is refused, they do not turn, or are stopped again."""
        self._armed_take_off.begin(command, send, now, waits_for_arming=self.snapshot.is_darko)

    def land(self, now: float) -> None:
        """Land here."""
        self._command(now, mavlink.MAV_CMD_NAV_LAND)

    def reboot(self, now: float) -> None:
        """Have the vehicle's autopilot start anew: it stands where it was put down."""
        self._command(now, mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1.0)

    def inject_failure(self, now: float, unit: int, failure: int, instance: int) -> None:
        """Have something fail on the vehicle: FAILURE_UNIT, FAILURE_TYPE, and which of several; 0: all."""
        self._command(now, mavlink.MAV_CMD_INJECT_FAILURE, float(unit), float(failure), float(instance))

    def return_home(self, now: float) -> None:
        """Fly home and land."""
        self._command(now, mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH)

    def set_home(self, now: float) -> None:
        """Move home to the vehicle's position."""
        self._command(now, mavlink.MAV_CMD_DO_SET_HOME, 1.0)

    def hold(self, now: float) -> None:
        """Stop and hover."""
        self.set_mode(Mode.HOLD, now)

    def set_mode(self, mode: Mode, now: float) -> None:
        """Change the flight mode."""
        custom, number = float(mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED), custom_mode(mode)
        self._command(now, mavlink.MAV_CMD_DO_SET_MODE, custom, float(number >> 16 & 0xFF), float(number >> 24))

    def steer(self, sticks: Sticks, now: float) -> None:
        """Send stick positions once; whoever stops calling this lets go of the sticks."""
        self.attempt(now, lambda: self.endpoint.send_to_vehicle(sticks.message))

    def check_arming(self, now: float) -> None:
        """Have the vehicle say what hinders arming."""
        self._command(now, mavlink.MAV_CMD_RUN_PREARM_CHECKS)

    def go_to(self, north: float, east: float, height: float, now: float) -> None:
        """Fly to a point relative to home [m] and hover there."""
        home = self.snapshot.position.home
        if home is None:
            self.add_line(now, "Go-to: home is not known yet")
            return
        point = LocalFrame(home).to_geodetic((north, east, 0.0))

        def send() -> None:
            place = (units.to_e7(point.lat_deg), units.to_e7(point.lon_deg), height)
            self._send_int(now, mavlink.MAV_CMD_DO_REPOSITION, (_NAN, 1.0, _NAN, _NAN), place)
            self.snapshot = asked_point(self.snapshot, (north, east, -height))

        self.attempt(now, send)

    def transition(self, now: float, *, forward: bool) -> None:
        """Begin a front or a back transition; one under way is cancelled first."""
        current = self.snapshot.operator.in_progress
        if current is not None and current.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION:
            self.cancel(now)
        state = mavlink.MAV_VTOL_STATE_FW if forward else mavlink.MAV_VTOL_STATE_MC
        self._command(now, mavlink.MAV_CMD_DO_VTOL_TRANSITION, float(state), 0.0)

    def cancel(self, now: float) -> None:
        """Cancel the command that the vehicle is executing."""
        current = self.snapshot.operator.in_progress
        if current is None:
            self.add_line(now, "No command is in progress")
            return
        self.attempt(now, lambda: self.endpoint.cancel_command(current.request, now))

    def take_control(self, now: float) -> None:
        """Let the vehicle obey this ground station only, until control is given back."""
        self._request_control(now, take=True, takeover_allowed=False)

    def share_control(self, now: float) -> None:
        """Keep control until another ground station asks for it."""
        self._request_control(now, take=True, takeover_allowed=True)

    def give_control_back(self, now: float) -> None:
        """Let every ground station command the vehicle again."""
        self._request_control(now, take=False, takeover_allowed=False)

    def change_speed(self, speed: float, now: float, *, over_ground: bool = False) -> None:
        """Fly at an airspeed or a ground speed [m/s]; the vehicle refuses a speed that it cannot fly."""
        kind = mavlink.SPEED_TYPE_GROUNDSPEED if over_ground else mavlink.SPEED_TYPE_AIRSPEED
        self.snapshot = asked_speed(self.snapshot, float(kind), speed)
        self._command(now, mavlink.MAV_CMD_DO_CHANGE_SPEED, float(kind), speed, -1.0)

    def set_message_rate(self, number: int, rate: float, now: float) -> None:
        """Have the vehicle send a message, by its id, so many times a second; 0: never, below 0: as often as usual."""
        interval = -1.0 if rate == 0.0 else 0.0 if rate < 0.0 else 1e6 / rate
        self._command(now, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, float(number), interval)

    def fetch_parameters(self, now: float) -> None:
        """Fetch all parameters of the vehicle."""
        self.attempt(now, lambda: self.endpoint.request_parameters(now))

    def fetch_parameter(self, name: str, now: float) -> None:
        """Ask for one parameter of the vehicle once; its value comes to the snapshot if the vehicle has it."""
        raw = name.encode("ascii")
        self.attempt(
            now,
            lambda: self.endpoint.send_to_vehicle(
                lambda vehicle: mavlink.MAVLink_param_request_read_message(*vehicle, raw, -1)
            ),
        )

    def set_parameter(self, name: str, value: float, now: float) -> None:
        """Change a parameter of the vehicle."""
        self.set_parameters({name: value}, now)

    def set_parameters(self, wanted: Mapping[str, float], now: float) -> None:
        """Change several parameters; the snapshot's ``parameter_changes`` tell what became of each."""
        self.snapshot = self._parameter_changes.request(self.snapshot, wanted, now)
        self._collect(now)

    def want_truth(self, now: float, *, wanted: bool) -> None:
        """Have a simulation tell the truth, or stop telling it."""
        self._families.truth.want(now, wanted=wanted)

    def fetch_parameter_metadata(self, now: float) -> None:
        """Fetch the descriptions of the vehicle's parameters, once."""
        self.attempt(now, lambda: self.parameter_metadata.request(now))

    def predict_legs(self, chains: Sequence[LegChain], now: float) -> None:
        """Have the vehicle say what these legs would take; ``leg_predictions`` of the snapshot has the answers."""
        self.attempt(now, lambda: self.leg_predictions.want(chains, now))

    def record_note(self, text: str, now: float, time_usec: int) -> None:
        """Put a text of this ground station into the recording; nothing is sent."""
        line = mavlink.MAVLink_statustext_message(mavlink.MAV_SEVERITY_NOTICE, text.encode()[:50])
        self._record(make_frame(line, self._own[0], self.endpoint.codec.component, 0), time_usec, now)

    def acknowledge(self) -> None:
        """The operator has seen the alerts."""
        self.snapshot = acknowledged(self.snapshot)

    def add_line(self, now: float, text: str, severity: int = mavlink.MAV_SEVERITY_WARNING) -> None:
        """Add a line to the operator's message log."""
        self.snapshot = add_line(self.snapshot, now, severity, text)

    def attempt(self, now: float, request: Callable[[], object]) -> None:
        """Send a request, and log why if it cannot be sent; ``now`` in seconds."""
        try:
            request()
        except LocalProtocolError as error:
            self.add_line(now, fault_words(error))
        self._collect(now)

    # Inside

    def _command(self, now: float, command: int, *params: float) -> None:
        def send() -> None:
            request = self.endpoint.command(command, *params, now=now)
            is_ours = self.snapshot.is_darko
            words = request_words(command, (*params, *(_NAN,) * (7 - len(params))), is_ours=is_ours)
            self.snapshot = self.snapshot._replace(
                operator=self.snapshot.operator._replace(asked={**self.snapshot.operator.asked, request: words})
            )

        self.attempt(now, send)

    def _send_int(
        self, now: float, command: int, params: tuple[float, float, float, float], place: tuple[int, int, float]
    ) -> None:
        frame = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
        self.endpoint.command_int(command, frame, *params, *place, now=now)

    def _request_control(self, now: float, *, take: bool, takeover_allowed: bool) -> None:
        timeout = CONTROL_TIMEOUT if take else 0.0
        request = (float(take), float(takeover_allowed), timeout, float(self._own[0]))
        self._command(now, mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, *request)

    def _collect(self, now: float) -> None:
        for event in self.endpoint.events():
            if self._families.follow(event, now):
                continue
            if not self._parameter_changes.take(event, now):
                after = reduce_event(self.snapshot, event, now)
                is_told_later = self.plans.is_told_later(event)
                self.snapshot = after._replace(log=self.snapshot.log) if is_told_later else after
            self._events.append(event)
            self.plans.follow(event, now)
            self._armed_take_off.follow(event, now)
            if text := self.parameter_metadata.follow(event, now):
                self.add_line(now, text)
        metadata = self.parameter_metadata.known
        if metadata and metadata is not self.snapshot.parameters.metadata:
            self.snapshot = self.snapshot._replace(parameters=self.snapshot.parameters._replace(metadata=metadata))
        if self.leg_predictions.known is not self.snapshot.mission.leg_predictions:
            self.snapshot = self.snapshot._replace(
                mission=self.snapshot.mission._replace(leg_predictions=self.leg_predictions.known)
            )

    def _update_rate(self, now: float) -> None:
        since, count = self._last_rate
        if now - since < RATE_WINDOW or self.endpoint.vehicle is None:
            return
        # The vehicle forwards only some messages of its other components: their gaps are no loss of this link.
        heard = self.endpoint.codec.statistics.sources.get(self.endpoint.vehicle, SourceStatistics())
        rate = (heard.received - count) / (now - since) if since else _NAN
        loss = heard.lost / (heard.received + heard.lost) if heard.received else 0.0
        self.snapshot = self.snapshot._replace(
            link=self.snapshot.link._replace(received=heard.received, rate=rate, loss=loss)
        )
        self._last_rate = (now, heard.received)

    def _update_signing(self, now: float) -> None:
        text = self.signing.handle_timer(now)
        if text:
            self.add_line(now, text)
        state, refused = self.signing.state, self.endpoint.keyring.refused
        if (state, refused) != (self.snapshot.link.signing, self.snapshot.link.refused):
            self.snapshot = self.snapshot._replace(link=self.snapshot.link._replace(signing=state, refused=refused))

    def _is_selected(self, message: Message, now: float) -> bool:
        """True if the selected vehicle sent the message."""
        vehicle = self.endpoint.vehicle
        if vehicle is not None and source_of(message)[0] == vehicle[0]:
            return True
        self.others.take(message, now)
        return False

    def _tell_twin(self, now: float) -> None:
        """Alert the operator once: the vehicle cannot tell the other station's commands from ours."""
        if self._has_twin:
            return
        self._has_twin = True
        text = f"another ground station has our id {self._own[0]}: the vehicle takes its commands for ours (--id)"
        self.add_line(now, f"Alert: {text}", mavlink.MAV_SEVERITY_ALERT)
        session = self.snapshot.session
        alerts = (*session.alerts, Alert("station", text, now))[-MAX_ALERTS:]
        self.snapshot = self.snapshot._replace(session=session._replace(alerts=alerts))

    def _handle_restart(self, now: float) -> None:
        """The vehicle has forgotten all requests; its plans and parameters must be fetched again."""
        self.snapshot = self.snapshot._replace(
            plans=self.snapshot.plans._replace(mission=(), fence=(), rally=()),
            parameters=ParameterTable(total=self.snapshot.parameters.total),
        )
        self._parameter_changes = ParameterChanges(self.endpoint)
        self.plans.cancel()
        self.parameter_metadata.forget()
        self.leg_predictions.forget()
        self.endpoint.give_up_requests(RESTARTED)
        restarted = VehicleRestarted()
        self._families.follow(restarted, now)
        self._events.append(restarted)
        self._collect(now)

    def _keep_safely(self, keep: Callable[[KeyRecord], None]) -> Callable[[KeyRecord], None]:
        """Save the signing time if possible: a full disk does not end a flight."""

        def keep_safely(record: KeyRecord) -> None:
            try:
                keep(record)
            except FileError as error:
                if not self._save_failed:
                    text = f"Signing time not saved: {error}"
                    self.add_line(self._last_rate[0], text, mavlink.MAV_SEVERITY_ERROR)
                self._save_failed = True

        return keep_safely

    def _record(self, frame: bytes, time_usec: int, now: float) -> None:
        if self._recorder is None or is_secret(frame):  # logs are copied and shared: they must hold no key
            return
        try:
            self._recorder.write(time_usec, frame)
        except FileError as error:
            self.report_recording_fault(str(error), now)
