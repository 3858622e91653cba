"""The ground station's side of the parameter protocol (https://mavlink.io/en/services/parameter.html).

The table arrives as one stream. When that falls silent, missing parameters are requested by index, several at a time.
Integers are encoded as the vehicle's capabilities say, or as its autopilot does; if the autopilot is another one, its
AUTOPILOT_VERSION is requested first.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from protocol.dialect import mavlink
from protocol.engines.base import Engine, Mark, Remote, RequestWindow, Retransmission, TransitionTable, fire
from protocol.engines.table_values import ValueEncoding, decode_value, encode_value, value_encoding
from protocol.errors import LocalProtocolError, WireRangeError
from protocol.events import ParameterConfirmed, ParameterFailed, ParameterReceived, ParametersComplete
from protocol.names import MAX_NAME_LENGTH, enum_name
from protocol.wire.message import Message, Source, addressed_to, target_fields

MAX_OPEN_PARAMETER_REQUESTS = 10  # missing parameters requested at a time
MAX_CONTRADICTIONS = 4  # repetitions answered with another value, after which the setting has failed
_NO_INDEX = 0xFFFF  # some autopilots send it in their answers to PARAM_SET

PARAMETER_LIST_TRANSITIONS: TransitionTable = {
    ("idle", "request"): "listing",
    ("listing", "request"): "listing",
    ("listing", "silence"): "filling",
    ("listing", "complete"): "idle",
    ("listing", "give_up"): "idle",
    ("filling", "request"): "listing",
    ("filling", "changed"): "listing",
    ("filling", "complete"): "idle",
    ("filling", "give_up"): "idle",
}

# An unknown type is read first: it determines how the value is encoded.
PARAMETER_SET_TRANSITIONS: TransitionTable = {
    ("new", "type_unknown"): "reading",
    ("new", "type_known"): "setting",
    ("new", "fail"): "done",
    ("reading", "type_known"): "setting",
    ("reading", "fail"): "done",
    ("setting", "confirmed"): "done",
    ("setting", "fail"): "done",
}


@dataclass(slots=True, kw_only=True)
class _Setting:
    name: str
    value: float
    resend: Retransmission
    since: Mark  # frames sent before this are not answers
    state: str = "new"
    message: Message | None = None
    kept: float | None = None  # the value the vehicle reports instead
    is_contradicted: bool = False  # since the last repetition
    contradictions: int = 0


class ParameterClient(Engine[Message]):
    """Downloads all parameters, fills the gaps, and sets parameters until the vehicle confirms the value.

    Args:
        system: Own system id.
        component: Own component id.
        remote: The vehicle's timing, shared by all engines of this end.
    """

    def __init__(self, system: int, component: int, remote: Remote | None = None) -> None:
        super().__init__()
        self._system, self._component = system, component
        self._remote = remote or Remote()
        self._vehicle: Source = (0, 0)
        self._types: dict[str, int] = {}
        self._autopilot: int | None = None  # MAV_AUTOPILOT, None before its first HEARTBEAT
        self._capabilities = 0  # of its last AUTOPILOT_VERSION
        self._state, self._resend = "idle", Retransmission(self._remote)
        self._count: int | None = None  # size of the table, None before its first parameter came
        self._missing: set[int] = set()
        self._window: RequestWindow | None = None  # parameters requested by index
        self._settings: dict[str, _Setting] = {}

    @property
    def is_busy(self) -> bool:
        """True while a list is incomplete or a parameter is being set."""
        return self._state != "idle" or bool(self._settings)

    @property
    def encoding(self) -> ValueEncoding:
        """The vehicle's encoding of integers; bytewise until the vehicle tells another."""
        return self._told_encoding() or ValueEncoding.BYTEWISE

    def request_all(self, vehicle: Source, now: float) -> None:
        """Download the whole table; a download in progress starts anew."""
        self._vehicle = vehicle
        self._state = fire(PARAMETER_LIST_TRANSITIONS, self._state, "request")
        self._count, self._missing, self._window = None, set(), None
        self._resend.start(now)
        self._ask_for_encoding()
        self._out.append(mavlink.MAVLink_param_request_list_message(*vehicle))

    def set(self, vehicle: Source, name: str, value: float, now: float) -> None:
        """Set one parameter; a later call for the same name replaces an earlier one.

        Raises:
            LocalProtocolError: The name does not fit the wire.
        """
        if not (name.isascii() and 1 <= len(name) <= MAX_NAME_LENGTH):
            raise LocalProtocolError(f"parameter name {name!r} is not 1 to {MAX_NAME_LENGTH} ASCII characters")
        self._vehicle = vehicle
        setting = self._settings[name] = _Setting(
            name=name, value=value, resend=Retransmission(self._remote), since=self._remote.mark(now)
        )
        if name in self._types and not self._must_ask_for_encoding():
            self._transmit_value(setting, self._types[name], now)
            return
        self._ask_for_encoding()
        setting.state = fire(PARAMETER_SET_TRANSITIONS, setting.state, "type_unknown")
        raw = name.encode("ascii")
        setting.message = mavlink.MAVLink_param_request_read_message(*vehicle, raw, -1)
        self._transmit(setting, now)

    def cancel(self, reason: str) -> None:
        """End all requests, for example because the vehicle is lost."""
        if self._state != "idle":
            self._end_list("give_up", ParameterFailed("", reason))
        for setting in list(self._settings.values()):
            self._end(setting, "fail", ParameterFailed(setting.name, reason))

    def receive(self, message: Message, now: float) -> None:
        """Take a PARAM_VALUE or a PARAM_ERROR; HEARTBEAT and AUTOPILOT_VERSION tell the encoding."""
        if message.get_type() == "PARAM_VALUE":
            value = decode_value(message.param_value, message.param_type, self.encoding)
            self._receive_value(message, value, now)
        elif message.get_type() in {"HEARTBEAT", "AUTOPILOT_VERSION"}:
            self._take_encoding(message, now)
        elif message.get_type() == "PARAM_ERROR" and addressed_to(message, self._system, self._component):
            setting = self._settings.get(message.param_id)
            if setting is not None and not self._remote.was_sent_before(setting.since, message, now):
                self._end(setting, "fail", ParameterFailed(setting.name, enum_name("MAV_PARAM_ERROR", message.error)))

    def _told_encoding(self) -> ValueEncoding | None:
        return value_encoding(self._autopilot or 0, self._capabilities)

    def _must_ask_for_encoding(self) -> bool:
        return self._autopilot is not None and self._told_encoding() is None

    def _ask_for_encoding(self) -> None:
        if self._must_ask_for_encoding():
            self._out.append(
                mavlink.MAVLink_command_long_message(
                    **target_fields(self._vehicle), command=mavlink.MAV_CMD_REQUEST_MESSAGE, confirmation=0,
                    param1=mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION, param2=0, param3=0, param4=0, param5=0, param6=0,
                    param7=0,
                )
            )  # fmt: skip

    def _take_encoding(self, message: Message, now: float) -> None:
        before = self.encoding
        if message.get_type() == "HEARTBEAT":
            self._autopilot = message.autopilot
        else:
            self._capabilities = message.capabilities
        if self._count is not None and self.encoding is not before:
            self.request_all(self._vehicle, now)  # what has come so far was read in the other encoding

    def next_deadline(self) -> float:
        """Link time at which a request must be repeated [s]."""
        return min([self._list_deadline(), *(setting.resend.deadline for setting in self._settings.values())])

    def handle_timer(self, now: float) -> None:
        """Request missing parameters again and repeat unconfirmed settings."""
        if now >= self._list_deadline():
            self._retry_list(now)
        for setting in [s for s in self._settings.values() if now >= s.resend.deadline]:
            self._retry_setting(setting, now)

    def _list_deadline(self) -> float:
        return self._resend.deadline if self._window is None else self._window.deadline

    def _receive_value(self, message: Message, value: float, now: float) -> None:
        name, kind = message.param_id, message.param_type
        self._types[name] = kind
        event = ParameterReceived(
            name=name, value=value, type=kind, index=message.param_index, count=message.param_count
        )
        self._events.append(event)
        if self._state != "idle" and message.param_index != _NO_INDEX:
            self._take_into_list(event, now)
        setting = self._settings.get(name)
        if setting is None or self._remote.was_sent_before(setting.since, message, now):
            return
        if setting.state == "reading":
            setting.resend.answer(now)
            self._transmit_value(setting, kind, now)
        elif _same(message, setting.message):
            setting.resend.answer(now)
            self._end(setting, "confirmed", ParameterConfirmed(name, value))
        else:  # may be the answer to an earlier message: the repetitions decide
            setting.kept, setting.is_contradicted = value, True

    def _take_into_list(self, event: ParameterReceived, now: float) -> None:
        if self._count is None:
            self._resend.answer(now)
        if self._count != event.count:  # also if the table changed meanwhile: start anew
            self._count, self._missing = event.count, set(range(event.count))
            if self._window is not None:
                self._state, self._window = fire(PARAMETER_LIST_TRANSITIONS, self._state, "changed"), None
        if self._window is not None:
            self._window.take(event.index, now)
        elif event.index in self._missing:
            self._resend.wait(now)
        self._missing.discard(event.index)
        if not self._missing:
            self._end_list("complete", ParametersComplete(event.count))
        elif self._window is not None:
            self._ask(self._window, now)

    def _retry_list(self, now: float) -> None:
        is_over = self._window.is_over(now) if self._window is not None else not self._resend.retry(now)
        if is_over:
            self._end_list("give_up", ParameterFailed("", f"{len(self._missing) or 'all'} parameters missing"))
        elif self._count is None:
            self._out.append(mavlink.MAVLink_param_request_list_message(*self._vehicle))
        else:
            if self._window is None:
                self._state = fire(PARAMETER_LIST_TRANSITIONS, self._state, "silence")
                self._window = RequestWindow(self._remote, sorted(self._missing), MAX_OPEN_PARAMETER_REQUESTS, now)
            self._ask(self._window, now)

    def _ask(self, window: RequestWindow, now: float) -> None:
        for index in window.ask(now):
            self._out.append(mavlink.MAVLink_param_request_read_message(*self._vehicle, b"", index))

    def _retry_setting(self, setting: _Setting, now: float) -> None:
        setting.contradictions += setting.is_contradicted
        setting.is_contradicted = False
        if setting.contradictions < MAX_CONTRADICTIONS and setting.resend.retry(now):
            self._out.append(setting.message)
            return
        reason = "no answer" if setting.kept is None else f"the vehicle keeps {setting.kept:g}"
        self._end(setting, "fail", ParameterFailed(setting.name, reason))

    def _end_list(self, trigger: str, event: ParametersComplete | ParameterFailed) -> None:
        self._state = fire(PARAMETER_LIST_TRANSITIONS, self._state, trigger)
        self._resend.stop()
        self._window = None
        self._events.append(event)

    def _transmit_value(self, setting: _Setting, kind: int, now: float) -> None:
        try:
            carried = encode_value(setting.value, kind, self.encoding)
        except LocalProtocolError as error:
            reason = "the value is too large for it" if isinstance(error, WireRangeError) else str(error)
            self._end(setting, "fail", ParameterFailed(setting.name, reason))
            return
        setting.state = fire(PARAMETER_SET_TRANSITIONS, setting.state, "type_known")
        raw = setting.name.encode("ascii")
        setting.message = mavlink.MAVLink_param_set_message(
            **target_fields(self._vehicle), param_id=raw, param_value=carried, param_type=kind
        )
        self._transmit(setting, now)

    def _transmit(self, setting: _Setting, now: float) -> None:
        setting.resend.start(now)
        self._out.append(setting.message)

    def _end(self, setting: _Setting, trigger: str, event: ParameterConfirmed | ParameterFailed) -> None:
        setting.state = fire(PARAMETER_SET_TRANSITIONS, setting.state, trigger)
        del self._settings[setting.name]
        self._events.append(event)


def _same(received: Message, sent: Message) -> bool:
    """True if both carry the same type and the same 32 bits."""
    bits = [struct.pack("<f", message.param_value) for message in (received, sent)]
    return bool(received.param_type == sent.param_type and bits[0] == bits[1])
