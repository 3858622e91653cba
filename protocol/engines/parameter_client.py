"""The ground station's side of the parameter protocol (https://mavlink.io/en/services/parameter.html).

The table comes in one stream; when that falls silent, what is missing is asked for by index, several at a time.
"""

import struct
from dataclasses import dataclass

from protocol.codec import Message, Source
from protocol.dialect import mavlink
from protocol.engines.base import Engine, Table, addressed_to, fire
from protocol.engines.parameters import decode_value, encode_value
from protocol.engines.retransmission import Mark, Partner, Resend, Window
from protocol.errors import LocalProtocolError
from protocol.events import ParameterConfirmed, ParameterFailed, ParameterReceived, ParametersComplete

__all__ = ["LIST_TRANSITIONS", "SET_TRANSITIONS", "ParameterClient"]

ASKED_AT_ONCE = 10  # missing parameters
CONTRADICTIONS = 4  # repetitions answered with another value until the vehicle is believed to keep that one
_NO_INDEX = 0xFFFF  # some autopilots send it in answers to PARAM_SET

LIST_TRANSITIONS: Table = {
    ("idle", "request"): "listing",
    ("listing", "request"): "listing",
    ("listing", "silence"): "filling",
    ("listing", "complete"): "idle",
    ("listing", "give_up"): "idle",
    ("filling", "request"): "listing",
    ("filling", "grown"): "listing",
    ("filling", "complete"): "idle",
    ("filling", "give_up"): "idle",
}

# A type that is not known yet is read first: it decides how the value is encoded.
SET_TRANSITIONS: Table = {
    ("new", "type_unknown"): "reading",
    ("new", "type_known"): "setting",
    ("new", "fail"): "done",
    ("reading", "type_known"): "setting",
    ("reading", "fail"): "done",
    ("setting", "confirmed"): "done",
    ("setting", "fail"): "done",
}


@dataclass(slots=True)
class _Setting:
    name: str
    value: float
    resend: Resend
    since: Mark  # what the vehicle said before this is no answer to it
    state: str = "new"
    message: Message | None = None
    kept: float | None = None  # what the vehicle says instead
    is_contradicted: bool = False  # since the last repetition
    contradictions: int = 0


class ParameterClient(Engine[Message]):
    """Fetches all parameters, fills the gaps, and sets parameters until the vehicle confirms the value.

    Args:
        system: Own system id.
        component: Own component id.
        partner: The vehicle as all engines of this end know it.
    """

    def __init__(self, system: int, component: int, partner: Partner | None = None) -> None:
        super().__init__()
        self._system, self._component = system, component
        self._partner = partner or Partner()
        self._vehicle: Source = (0, 0)
        self._types: dict[str, int] = {}
        self._state, self._resend = "idle", Resend(self._partner)
        self._count: int | None = None  # of the table, None before the first of the list came
        self._missing: set[int] = set()
        self._window: Window | None = None  # what is asked for by index
        self._settings: dict[str, _Setting] = {}

    @property
    def is_busy(self) -> bool:
        """True while a list is incomplete or a parameter is being set."""
        return self._state != "idle" or bool(self._settings)

    def request_all(self, vehicle: Source, now: float) -> None:
        """Fetch the whole table, from the beginning if a fetch is under way."""
        self._vehicle = vehicle
        self._state = fire(LIST_TRANSITIONS, self._state, "request")
        self._count, self._missing, self._window = None, set(), None
        self._resend.start(now)
        self._out.append(mavlink.MAVLink_param_request_list_message(*vehicle))

    def set(self, vehicle: Source, name: str, value: float, now: float) -> None:
        """Set one parameter; a later call for the same name replaces an earlier one.

        Raises:
            LocalProtocolError: No parameter can have this name.
        """
        if not (name.isascii() and 1 <= len(name) <= 16):
            raise LocalProtocolError(f"parameter name {name!r} is not 1 to 16 ASCII characters")
        self._vehicle = vehicle
        setting = self._settings[name] = _Setting(name, value, Resend(self._partner), self._partner.mark(now))
        if name in self._types:
            self._transmit_value(setting, self._types[name], now)
            return
        setting.state = fire(SET_TRANSITIONS, setting.state, "type_unknown")
        raw = name.encode("ascii")
        setting.message = mavlink.MAVLink_param_request_read_message(*vehicle, raw, -1)
        self._transmit(setting, now)

    def cancel(self, reason: str) -> None:
        """Give up on everything, for example because the vehicle is lost."""
        if self._state != "idle":
            self._end_list("give_up", ParameterFailed("", reason))
        for setting in list(self._settings.values()):
            self._end(setting, "fail", ParameterFailed(setting.name, reason))

    def receive(self, message: Message, now: float) -> None:
        """Take a PARAM_VALUE or a PARAM_ERROR."""
        if message.get_type() == "PARAM_VALUE":
            value = decode_value(message.param_value, message.param_type)
            self._receive_value(message, value, now)
        elif message.get_type() == "PARAM_ERROR" and addressed_to(message, self._system, self._component):
            setting = self._settings.get(message.param_id)
            if setting is not None and not self._partner.said_before(setting.since, message, now):
                self._end(setting, "fail", ParameterFailed(setting.name, _error_name(message.error)))

    def next_deadline(self) -> float:
        """When something must be asked for again."""
        return min([self._list_deadline(), *(setting.resend.deadline for setting in self._settings.values())])

    def handle_timer(self, now: float) -> None:
        """Ask again for what is missing, set again what was not confirmed."""
        if now >= self._list_deadline():
            self._retry_list(now)
        for setting in [s for s in self._settings.values() if now >= s.resend.deadline]:
            self._retry_setting(setting, now)

    def _list_deadline(self) -> float:
        return self._resend.deadline if self._window is None else self._window.deadline

    def _receive_value(self, message: Message, value: float, now: float) -> None:
        name, kind = message.param_id, message.param_type
        self._types[name] = kind
        event = ParameterReceived(name, value, kind, message.param_index, message.param_count)
        self._events.append(event)
        if self._state != "idle" and message.param_index != _NO_INDEX:
            self._take_into_list(event, now)
        setting = self._settings.get(name)
        if setting is None or self._partner.said_before(setting.since, message, now):
            return
        if setting.state == "reading":
            setting.resend.answer(now)
            self._transmit_value(setting, kind, now)
        elif _same(message, setting.message):
            setting.resend.answer(now)
            self._end(setting, "confirmed", ParameterConfirmed(name, value))
        else:  # may be an older answer under way: the repetitions decide
            setting.kept, setting.is_contradicted = value, True

    def _take_into_list(self, event: ParameterReceived, now: float) -> None:
        if self._count is None:
            self._resend.answer(now)
        if self._count != event.count:  # also when the table changed under way: all over again
            self._count, self._missing = event.count, set(range(event.count))
            if self._window is not None:
                self._state, self._window = fire(LIST_TRANSITIONS, self._state, "grown"), None
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
        hopeless = self._window.is_over(now) if self._window is not None else not self._resend.retry(now)
        if hopeless:
            self._end_list("give_up", ParameterFailed("", f"{len(self._missing) or 'all'} parameters missing"))
        elif self._count is None:
            self._out.append(mavlink.MAVLink_param_request_list_message(*self._vehicle))
        else:
            if self._window is None:
                self._state = fire(LIST_TRANSITIONS, self._state, "silence")
                self._window = Window(self._partner, sorted(self._missing), ASKED_AT_ONCE, now)
            self._ask(self._window, now)

    def _ask(self, window: Window, now: float) -> None:
        for index in window.ask(now):
            self._out.append(mavlink.MAVLink_param_request_read_message(*self._vehicle, b"", index))

    def _retry_setting(self, setting: _Setting, now: float) -> None:
        setting.contradictions += setting.is_contradicted
        setting.is_contradicted = False
        if setting.contradictions < CONTRADICTIONS and setting.resend.retry(now):
            self._out.append(setting.message)
            return
        reason = "no answer" if setting.kept is None else f"the vehicle keeps {setting.kept:g}"
        self._end(setting, "fail", ParameterFailed(setting.name, reason))

    def _end_list(self, trigger: str, event: ParametersComplete | ParameterFailed) -> None:
        self._state = fire(LIST_TRANSITIONS, self._state, trigger)
        self._resend.stop()
        self._window = None
        self._events.append(event)

    def _transmit_value(self, setting: _Setting, kind: int, now: float) -> None:
        try:
            carried = encode_value(setting.value, kind)
        except LocalProtocolError as error:
            self._end(setting, "fail", ParameterFailed(setting.name, str(error)))
            return
        setting.state = fire(SET_TRANSITIONS, setting.state, "type_known")
        raw = setting.name.encode("ascii")
        setting.message = mavlink.MAVLink_param_set_message(*self._vehicle, raw, carried, kind)
        self._transmit(setting, now)

    def _transmit(self, setting: _Setting, now: float) -> None:
        setting.resend.start(now)
        self._out.append(setting.message)

    def _end(self, setting: _Setting, trigger: str, event: ParameterConfirmed | ParameterFailed) -> None:
        setting.state = fire(SET_TRANSITIONS, setting.state, trigger)
        del self._settings[setting.name]
        self._events.append(event)


def _same(told: Message, sent: Message) -> bool:
    """True when both carry the same type and the same 32 bits."""
    bits = [struct.pack("<f", message.param_value) for message in (told, sent)]
    return bool(told.param_type == sent.param_type and bits[0] == bits[1])


def _error_name(error: int) -> str:
    entry = mavlink.enums["MAV_PARAM_ERROR"].get(error)
    return entry.name.removeprefix("MAV_PARAM_ERROR_") if entry else f"MAV_PARAM_ERROR {error}"
