"""The vehicle's side of the parameter protocol (https://mavlink.io/en/services/parameter.html).

What cannot be is answered with PARAM_ERROR to who asked: DOES_NOT_EXIST for a name or an index nobody knows,
VALUE_OUT_OF_RANGE, TYPE_MISMATCH for a type that only other parameters have, TYPE_UNSUPPORTED for one that none has.
No parameter is read-only, and none can fail to be read. After a PARAM_SET everyone is told what holds, changed or not.

Of the extended protocol (https://mavlink.io/en/services/parameter_ext.html) there is the refusal: PARAM_EXT_ACK to who
sets. Who reads finds no parameters there; that service has no answer for it, so the operator is told in words.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.engines.base import Peer, Server, addressed_to
from protocol.engines.parameters import Parameter, decode_value, encode_value, type_name
from protocol.errors import LocalProtocolError
from protocol.events import ParameterChanged, ParameterRefused

__all__ = ["ParameterServer"]

BURST, SPACING = 5, 0.01  # a list goes out five at a time [-], every 10 ms [s]: no receive buffer overflows
LISTS = 8  # sent at once; who asks for one more is not answered, and asks again
EXTENDED = "this vehicle has no extended parameters"
_BY_NAME = -1


class ParameterServer(Server):
    """Holds the table while the vehicle runs; who keeps it on disk listens to ``ParameterChanged``."""

    def __init__(self, system: int, component: int, parameters: Sequence[Parameter]) -> None:
        super().__init__()
        self._system, self._component = system, component
        self._table = list(parameters)
        self._indices = {parameter.name: index for index, parameter in enumerate(self._table)}
        if len(self._indices) != len(self._table):
            raise LocalProtocolError("two parameters have one name")
        self._lists: dict[tuple[int, int], tuple[Peer, int]] = {}  # who wants all, and the next index
        self._deadline = math.inf
        self._handlers = {
            "PARAM_REQUEST_LIST": self._handle_list,
            "PARAM_REQUEST_READ": self._handle_read,
            "PARAM_SET": self._handle_set,
            "PARAM_EXT_SET": self._refuse_extended_set,
            "PARAM_EXT_REQUEST_READ": self._refuse_extended_read,
            "PARAM_EXT_REQUEST_LIST": self._refuse_extended_list,
        }
        self.handles = frozenset(self._handlers)

    @property
    def table(self) -> tuple[Parameter, ...]:
        """All parameters with their present values."""
        return tuple(self._table)

    def value(self, name: str) -> float:
        """Present value of a parameter.

        Raises:
            LocalProtocolError: There is no such parameter.
        """
        return self._table[self._index(name)].value

    def set(self, name: str, value: float) -> None:
        """A change by the vehicle itself; everyone is told.

        Raises:
            LocalProtocolError: There is no such parameter, or it cannot take the value.
        """
        index = self._index(name)
        self._table[index] = replace(self._table[index], value=value)
        self._broadcast(self._message(index))

    def receive(self, message: Message, now: float, peer: Peer) -> None:
        """Take a PARAM_REQUEST_LIST, PARAM_REQUEST_READ or PARAM_SET, or one of their extended sisters."""
        handler = self._handlers.get(message.get_type())
        if handler is not None and addressed_to(message, self._system, self._component):
            handler(message, now, peer)

    def next_deadline(self) -> float:
        """When the next part of a list goes out."""
        return self._deadline

    def handle_timer(self, now: float) -> None:
        """Send the next part of every list asked for."""
        if now < self._deadline:
            return
        for key, (peer, start) in list(self._lists.items()):
            stop = min(start + BURST, len(self._table))
            for index in range(start, stop):
                self._reply(peer, self._message(index))
            self._lists[key] = (peer, stop)
            if stop == len(self._table):
                del self._lists[key]
        self._deadline = now + SPACING if self._lists else math.inf

    def _handle_list(self, _message: Message, now: float, peer: Peer) -> None:
        if self._table and (peer[:2] in self._lists or len(self._lists) < LISTS):
            self._lists[peer[:2]] = (peer, 0)
            if math.isinf(self._deadline):  # who asks again and again must not quicken the lists under way
                self._deadline = now

    def _handle_read(self, message: Message, _now: float, peer: Peer) -> None:
        index = message.param_index
        if index == _BY_NAME:
            index = self._indices.get(message.param_id, _BY_NAME)
        if 0 <= index < len(self._table):
            self._reply(peer, self._message(index))
        else:
            self._refuse(message.param_id, message.param_index, mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST, peer)

    def _handle_set(self, message: Message, _now: float, peer: Peer) -> None:
        name = message.param_id
        index = self._indices.get(name)
        if index is None:
            self._refuse(name, _BY_NAME, mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST, peer)
            return
        old, value = self._table[index], decode_value(message.param_value, message.param_type)
        if message.param_type != old.type and _is_whole(value, message.param_type, old.type):
            value = int(value)
        elif message.param_type != old.type:
            self._refuse_type(old, value, message.param_type, index, peer)
            return
        flaw = old.flaw(value)
        if flaw:
            self._events.append(ParameterRefused(name, value, flaw))
            self._refuse(name, index, mavlink.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE, peer)
        elif value != old.value:
            self._table[index] = replace(old, value=value)
            self._events.append(ParameterChanged(name, value))
        self._broadcast(self._message(index))  # whatever happened, everyone learns what holds now

    def _refuse_type(self, held: Parameter, value: float, told: int, index: int, peer: Peer) -> None:
        is_known = told in {parameter.type for parameter in self._table}
        error = "TYPE_MISMATCH" if is_known else "TYPE_UNSUPPORTED"
        reason = f"{type_name(told)} is the wrong type, it is {type_name(held.type)}"
        self._events.append(ParameterRefused(held.name, value, reason))
        self._refuse(held.name, index, getattr(mavlink, f"MAV_PARAM_ERROR_{error}"), peer)
        self._broadcast(self._message(index))

    def _refuse_extended_set(self, message: Message, _now: float, peer: Peer) -> None:
        name, result = message.param_id, mavlink.PARAM_ACK_VALUE_UNSUPPORTED
        self._reply(peer, mavlink.MAVLink_param_ext_ack_message(_raw(name), b"", message.param_type, result))
        self._events.append(ParameterRefused(name, None, EXTENDED))

    def _refuse_extended_read(self, message: Message, _now: float, _peer: Peer) -> None:
        self._events.append(ParameterRefused(message.param_id or f"Index {message.param_index}", None, EXTENDED))

    def _refuse_extended_list(self, _message: Message, _now: float, _peer: Peer) -> None:
        self._events.append(ParameterRefused("Parameter list", None, EXTENDED))

    def _index(self, name: str) -> int:
        if name not in self._indices:
            raise LocalProtocolError(f"no parameter {name}")
        return self._indices[name]

    def _message(self, index: int) -> Message:
        p = self._table[index]
        return mavlink.MAVLink_param_value_message(
            p.name.encode("ascii"), encode_value(p.value, p.type), p.type, len(self._table), index
        )

    def _refuse(self, name: str, index: int, error: int, peer: Peer) -> None:
        message = mavlink.MAVLink_param_error_message(peer.system, peer.component, _raw(name), index, error)
        self._reply(peer, message)


def _raw(name: str) -> bytes:
    """A name that somebody sent, as it goes back."""
    return name.encode("ascii", errors="replace")[:16]


def _is_whole(value: float, told: int, kind: int) -> bool:
    """True for a float that an integer parameter can hold: who reads the table as one file knows no other type."""
    if told != mavlink.MAV_PARAM_TYPE_REAL32 or not float(value).is_integer():
        return False
    try:
        encode_value(value, kind)
    except LocalProtocolError:
        return False
    return True
