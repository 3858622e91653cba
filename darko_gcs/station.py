"""The ground station without a socket, a clock or a screen: endpoint, store and recorder as one."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from darko_gcs.meanings import MeaningsClient
from darko_gcs.plans import FENCE, MISSION, RALLY, PlanDesk, with_part
from darko_gcs.signing import SigningDesk
from darko_gcs.snapshot import EMPTY, Snapshot
from darko_gcs.store import note, reduce, reduce_event
from protocol import units
from protocol.codec import Message, Source, SourceStatistics, source_of
from protocol.dialect import mavlink
from protocol.endpoint import GROUND_SYSTEM, GroundEndpoint
from protocol.errors import FileError, LocalProtocolError
from protocol.events import Event, MissionUploaded, VehicleRestarted
from protocol.frames import LocalFrame
from protocol.keyring import KeyRecord, Keyring
from protocol.modes import Mode, custom_mode
from protocol.plans.mission import MissionItem
from protocol.signing import is_secret
from protocol.tlog import TlogWriter

NAN = math.nan
RELATIVE = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
CUSTOM_MODE = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
ERROR = mavlink.MAV_SEVERITY_ERROR
RATE_WINDOW = 2.0  # [s]
ANSWER_TIME = 10.0  # that another station has to answer a request for control [s]
MOST_OTHERS = 4  # vehicles beside the selected one that are told of


class Station:
    """One operator's side of one vehicle.

    The owner moves bytes and time: ``receive`` each datagram, ``tick`` often, send what ``outgoing`` gives. What
    is asked of the vehicle is answered in the snapshot's log and in ``events``.

    One vehicle is selected, for good: the first that is heard, or the one asked for. What others say is recorded, and
    shown nowhere.

    Args:
        recorder: Keeps what is believed and what is sent; a disk that fails ends the recording, not the flight.
        keyring: Signs, and says who is believed.
        give_key: Whether a vehicle without a key is given ours.
        vehicle: Its system id; None takes the first that is heard.
    """

    def __init__(
        self,
        recorder: TlogWriter | None = None,
        keyring: Keyring | None = None,
        *,
        give_key: bool = False,
        vehicle: int | None = None,
    ) -> None:
        self._forgetful = False  # it was said that the signing time is not kept
        if keyring is not None:
            keyring.keep = self._kept(keyring.keep)
        self.endpoint = GroundEndpoint(keyring=keyring, vehicle=vehicle)
        self.signing = SigningDesk(self.endpoint, give=give_key)
        self.snapshot: Snapshot = EMPTY
        self.recording_fault = ""  # why nothing is recorded any more
        self._recorder = recorder
        self._others: set[Source] = set()
        self._events: list[Event] = []
        self.plans = PlanDesk(self.endpoint)
        self.meanings = MeaningsClient(self.endpoint)
        self._counted = (0.0, 0)  # time and messages at the last look at the rate

    # Bytes and time

    def receive(self, data: bytes, now: float, time_usec: int) -> bool:
        """Take one datagram; true if the vehicle spoke in it, so that answers belong where it came from.

        Where there is no vehicle to believe, one that does not sign as it should will do: it may be given a key, and
        one whose clock is behind catches up with the times that it hears.

        Args:
            data: Its bytes.
            now: On the caller's steady clock [s].
            time_usec: Since 1970, for the log [us].
        """
        spoke, restarts = False, self.snapshot.restarts
        for message in self.endpoint.receive_datagram(data, now):
            self._record(bytes(message.get_msgbuf()), time_usec, now)
            if self._is_ours(message, now):
                self.snapshot = reduce(self.snapshot, message, now)
                self.meanings.receive(message, now)
            self.signing.receive(message)
            spoke = spoke or source_of(message) == self.endpoint.vehicle
        if self.snapshot.restarts != restarts:
            self._begin_anew(now)
        self._collect(now)
        return spoke or (self.endpoint.heard_unbelieved and not self.endpoint.is_present)

    def tick(self, now: float) -> None:
        """Let time pass: resends, loss of the vehicle, link statistics."""
        self.endpoint.handle_timer(now)
        self._watch_signing(now)
        self._collect(now)
        self._watch_link(now)

    def outgoing(self, now: float, time_usec: int) -> list[bytes]:
        """Datagrams to send now; they are recorded as sent."""
        datagrams = self.endpoint.datagrams_to_send()
        for data in datagrams:
            self._record(data, time_usec, now)
        return datagrams

    def events(self) -> list[Event]:
        """What happened since the last call."""
        events, self._events = self._events, []
        return events

    def go_unrecorded(self, reason: str, now: float) -> None:
        """Go on without a log, and let the operator see that."""
        self.recording_fault = reason
        self.snapshot = replace(self.snapshot, unrecorded=True)
        self.say(now, f"NOT RECORDING: {reason}", ERROR)

    def close(self) -> None:
        """Close the recording; ``recording_fault`` says if that failed."""
        if self._recorder is None:
            return
        try:
            self._recorder.close()
        except FileError as error:
            self.recording_fault = str(error)

    # What the operator asks for. Each says in the log what came of it.

    def arm(self, now: float) -> None:
        """Start the motors at idle."""
        self._command(now, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0, 0.0)

    def disarm(self, now: float, *, force: bool = False) -> None:
        """Stop the motors; by force also in the air."""
        self._command(now, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, 21196.0 if force else 0.0)

    def take_off(self, height: float, now: float) -> None:
        """Climb to a height above home [m]."""
        here = self.snapshot.geodetic
        place = (units.UNKNOWN_INT32,) * 2 if here is None else (units.to_e7(here.lat_deg), units.to_e7(here.lon_deg))
        self._command_int(now, mavlink.MAV_CMD_NAV_TAKEOFF, (NAN, NAN, NAN, NAN), (*place, height))

    def land(self, now: float) -> None:
        """Land on the spot."""
        self._command(now, mavlink.MAV_CMD_NAV_LAND)

    def return_home(self, now: float) -> None:
        """Fly home and land."""
        self._command(now, mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH)

    def set_home(self, now: float) -> None:
        """Move home to where the vehicle is."""
        self._command(now, mavlink.MAV_CMD_DO_SET_HOME, 1.0)

    def hold(self, now: float) -> None:
        """Stop and hover."""
        self.set_mode(Mode.HOLD, now)

    def start_mission(self, now: float) -> None:
        """Fly the mission, from its current item."""
        self._command(now, mavlink.MAV_CMD_MISSION_START, NAN, NAN)

    def set_mode(self, mode: Mode, now: float) -> None:
        """Change the flight mode."""
        word = custom_mode(mode)
        self._command(now, mavlink.MAV_CMD_DO_SET_MODE, CUSTOM_MODE, float(word >> 16 & 0xFF), float(word >> 24))

    def go_to(self, north: float, east: float, height: float, now: float) -> None:
        """Fly to a point about home [m] and hover there."""
        home = self.snapshot.home
        if home is None:
            self.say(now, "Go-to: home is not known yet")
            return
        point = LocalFrame(home).to_geodetic((north, east, 0.0))
        place = (units.to_e7(point.lat_deg), units.to_e7(point.lon_deg), height)
        self._command_int(now, mavlink.MAV_CMD_DO_REPOSITION, (NAN, 1.0, NAN, NAN), place)

    def transition(self, now: float, *, forward: bool) -> None:
        """Tip over into forward flight, or come back to hover; one that is under way is cancelled first."""
        working = self.snapshot.in_progress
        if working is not None and working.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION:
            self.cancel(now)
        state = mavlink.MAV_VTOL_STATE_FW if forward else mavlink.MAV_VTOL_STATE_MC
        self._command(now, mavlink.MAV_CMD_DO_VTOL_TRANSITION, float(state), 0.0)

    def cancel(self, now: float) -> None:
        """Have the vehicle stop the command that it is working on."""
        working = self.snapshot.in_progress
        if working is None:
            self.say(now, "Nothing is in progress")
            return
        self._try(now, lambda: self.endpoint.cancel_command(working.request, now))

    def take_control(self, now: float) -> None:
        """Have the vehicle obey this ground station alone, until control is given back."""
        self._command(now, mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, 1.0, 0.0, ANSWER_TIME, GROUND_SYSTEM)

    def share_control(self, now: float) -> None:
        """Keep control until another ground station asks for it."""
        self._command(now, mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, 1.0, 1.0, ANSWER_TIME, GROUND_SYSTEM)

    def give_control_back(self, now: float) -> None:
        """Let every ground station steer again."""
        self._command(now, mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, 0.0, 0.0, 0.0, GROUND_SYSTEM)

    def change_speed(self, speed: float, now: float, *, over_ground: bool = False) -> None:
        """Fly at a speed in the air or over ground [m/s]; whether it can is for the vehicle to say."""
        kind = mavlink.SPEED_TYPE_GROUNDSPEED if over_ground else mavlink.SPEED_TYPE_AIRSPEED
        self._command(now, mavlink.MAV_CMD_DO_CHANGE_SPEED, float(kind), speed, -1.0)

    def upload(
        self,
        items: Sequence[MissionItem],
        now: float,
        *,
        fence: Sequence[MissionItem] = (),
        rally: Sequence[MissionItem] = (),
    ) -> None:
        """Replace the vehicle's mission, and its fence and rally points if there are new ones."""
        limits = {kind: part for kind, part in ((FENCE, fence), (RALLY, rally)) if part}
        self._try(now, lambda: self.plans.upload({MISSION: items, **limits}, now))

    def download(self, now: float) -> None:
        """Fetch the vehicle's mission, fence and rally points."""
        self._try(now, lambda: self.plans.download(now))

    def fetch_parameters(self, now: float) -> None:
        """Have the vehicle tell its parameters."""
        self._try(now, lambda: self.endpoint.request_parameters(now))

    def set_parameter(self, name: str, value: float, now: float) -> None:
        """Change a parameter of the vehicle."""
        self._try(now, lambda: self.endpoint.set_parameter(name, value, now))

    def fetch_meanings(self, now: float) -> None:
        """Have the vehicle tell what its parameters mean, once."""
        self._try(now, lambda: self.meanings.request(now))

    def clear_plan(self, kind: int, now: float) -> None:
        """Delete the vehicle's plan of a MAV_MISSION_TYPE, 255: mission, fence and rally points."""
        self._try(now, lambda: self.plans.clear(kind, now))

    def set_current(self, seq: int, now: float) -> None:
        """Let the mission go on, or begin, at one of its items."""
        self._try(now, lambda: self.plans.set_current(seq, now))

    def say(self, now: float, text: str, severity: int = mavlink.MAV_SEVERITY_WARNING) -> None:
        """Add a line to the operator's log."""
        self.snapshot = note(self.snapshot, now, severity, text)

    # Inside

    def _command(self, now: float, command: int, *params: float) -> None:
        self._try(now, lambda: self.endpoint.command(command, *params, now=now))

    def _command_int(
        self, now: float, command: int, params: tuple[float, float, float, float], place: tuple[int, int, float]
    ) -> None:
        self._try(now, lambda: self.endpoint.command_int(command, RELATIVE, *params, *place, now=now))

    def _try(self, now: float, request: Callable[[], object]) -> None:
        try:
            request()
        except LocalProtocolError as error:
            self.say(now, str(error))
        self._collect(now)

    def _collect(self, now: float) -> None:
        for event in self.endpoint.events():
            self.snapshot = reduce_event(self.snapshot, event, now)
            if isinstance(event, MissionUploaded):
                self.snapshot = with_part(self.snapshot, event.kind, self.plans.sent.get(event.kind, ()))
            self._events.append(event)
            self.plans.follow(event, now)
            if text := self.meanings.follow(event, now):
                self.say(now, text)
        if self.meanings.known is not self.snapshot.meanings and self.meanings.known:
            self.snapshot = replace(self.snapshot, meanings=self.meanings.known)

    def _watch_link(self, now: float) -> None:
        since, count = self._counted
        if now - since < RATE_WINDOW or self.endpoint.vehicle is None:
            return
        # Of what other components say, only a part is passed on by the vehicle: their gaps are no loss of this link.
        heard = self.endpoint.codec.statistics.sources.get(self.endpoint.vehicle, SourceStatistics())
        rate = (heard.received - count) / (now - since) if since else NAN
        loss = heard.lost / (heard.received + heard.lost) if heard.received else 0.0
        self.snapshot = replace(self.snapshot, received=heard.received, rate=rate, loss=loss)
        self._counted = (now, heard.received)

    def _watch_signing(self, now: float) -> None:
        text = self.signing.handle_timer(now)
        if text:
            self.say(now, text)
        seen = (self.signing.state, self.endpoint.keyring.refused)
        if seen != (self.snapshot.signing, self.snapshot.refused):
            self.snapshot = replace(self.snapshot, signing=seen[0], refused=seen[1])

    def _is_ours(self, message: Message, now: float) -> bool:
        """Whether the selected vehicle said it; another one is told of once."""
        source, vehicle = source_of(message), self.endpoint.vehicle
        if vehicle is not None and source[0] == vehicle[0]:
            return True
        is_vehicle = message.get_type() == "HEARTBEAT" and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID
        if is_vehicle and source not in self._others and len(self._others) < MOST_OTHERS:
            self._others.add(source)
            self.say(now, f"Another vehicle, {source[0]}/{source[1]}, is on the link: it is not shown")
        return False

    def _begin_anew(self, now: float) -> None:
        """The vehicle has forgotten what it was asked; what it keeps over a restart is for it to tell."""
        self.snapshot = replace(self.snapshot, mission=(), fence=(), rally=(), parameters={}, meanings={})
        self.plans.forget()
        self.meanings.forget()
        self.endpoint.give_up_requests("the vehicle restarted")
        self._events.append(VehicleRestarted())
        self._collect(now)

    def _kept(self, keep: Callable[[KeyRecord], None]) -> Callable[[KeyRecord], None]:
        """Keep the signing time if that can be done: a full disk ends no flight."""

        def try_to(record: KeyRecord) -> None:
            try:
                keep(record)
            except FileError as error:
                if not self._forgetful:
                    self.say(self._counted[0], f"Signing time not kept: {error}", ERROR)
                self._forgetful = True

        return try_to

    def _record(self, frame: bytes, time_usec: int, now: float) -> None:
        if self._recorder is None or is_secret(frame):  # a log is copied and sent around: no key belongs in it
            return
        try:
            self._recorder.write(time_usec, frame)
        except FileError as error:
            self.go_unrecorded(str(error), now)
