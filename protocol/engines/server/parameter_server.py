"""The vehicle's side of the parameter protocol (https://mavlink.io/en/services/parameter.html).

Errors are answered with PARAM_ERROR to the sender: DOES_NOT_EXIST for an unknown name or index, VALUE_OUT_OF_RANGE,
TYPE_MISMATCH for a type that only other parameters have, TYPE_UNSUPPORTED for a type without any parameter. No
parameter is read-only, and reading never fails. After a PARAM_SET the value in force is broadcast, changed or not.

The extended protocol (https://mavlink.io/en/services/parameter_ext.html) is refused: PARAM_EXT_SET is answered with
PARAM_EXT_ACK. That service has no refusal for a request to read, so the operator gets a text.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from protocol.dialect import mavlink
from protocol.engines.base import Server
from protocol.engines.server.replies import param_error, raw_name
from protocol.engines.table_values import Parameter, ParameterRangeError, decode_value, encode_value
from protocol.errors import LocalProtocolError
from protocol.events import ParameterChanged, ParameterRefused
from protocol.names import enum_name
from protocol.ranges import PARAMETERS_PER_INTERVAL, SEND_INTERVAL
from protocol.wire.message import Message, Peer, addressed_to

MAX_OPEN_LISTS = 8  # sent at the same time; a further peer gets no answer and asks again
NO_EXTENDED_PARAMETERS = "this vehicle has no extended parameters"
_BY_NAME = -1


PutInForce = Callable[[Parameter], str]
"""Makes the vehicle fly by a parameter with a new value in its range; gives why it cannot, beside the others, or ""."""


class ParameterServer(Server):
    """Holds the table while the vehicle runs; its owner saves it to disk upon ``ParameterChanged``.

    Args:
        system: Own system id.
        component: Own component id.
        parameters: The table.
        put_in_force: Has the last word about a value within its range, before it is answered.
    """

    def __init__(
        self,
        system: int,
        component: int,
        parameters: Sequence[Parameter],
        put_in_force: PutInForce = lambda _parameter: "",
    ) -> None:
        super().__init__()
        self._system, self._component, self._put_in_force = system, component, put_in_force
        self._table = list(parameters)
        self._indices = {parameter.name: index for index, parameter in enumerate(self._table)}
        if len(self._indices) != len(self._table):
            raise LocalProtocolError("two parameters have the same name")
        self._lists: dict[tuple[int, int], tuple[Peer, int]] = {}  # peers that get a list, and the next index
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
        """All parameters with their current values."""
        return tuple(self._table)

    def value(self, name: str) -> float:
        """Current value of a parameter.

        Raises:
            LocalProtocolError: There is no such parameter.
        """
        return self._table[self._index(name)].value

    def set(self, name: str, value: float) -> None:
        """Change a parameter from the vehicle's side; the new value is broadcast.

        Raises:
            LocalProtocolError: There is no such parameter, or the value is outside its range.
        """
        index = self._index(name)
        self._table[index] = replace(self._table[index], value=value)
        self._broadcast(self._message(index))

    def receive(self, message: Message, now: float, peer: Peer) -> None:
        """Take a PARAM_REQUEST_LIST, PARAM_REQUEST_READ or PARAM_SET, or one of the extended protocol."""
        handler = self._handlers.get(message.get_type())
        if handler is not None and addressed_to(message, self._system, self._component):
            handler(message, now, peer)

    def next_deadline(self) -> float:
        """Link time at which the next part of a list is due [s]."""
        return self._deadline

    def handle_timer(self, now: float) -> None:
        """Send the next part of every requested list."""
        if now < self._deadline:
            return
        for key, (peer, start) in list(self._lists.items()):
            stop = min(start + PARAMETERS_PER_INTERVAL, len(self._table))
            for index in range(start, stop):
                self._reply(peer, self._message(index))
            self._lists[key] = (peer, stop)
            if stop == len(self._table):
                del self._lists[key]
        self._deadline = now + SEND_INTERVAL if self._lists else math.inf

    def _handle_list(self, _message: Message, now: float, peer: Peer) -> None:
        if self._table and (peer[:2] in self._lists or len(self._lists) < MAX_OPEN_LISTS):
            self._lists[peer[:2]] = (peer, 0)
            if math.isinf(self._deadline):  # repeated requests must not speed up the lists in progress
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
        flaw = self._change(index, value) if value != old.value else ""
        if flaw:
            self._events.append(ParameterRefused(name, value, flaw))
            self._refuse(name, index, mavlink.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE, peer)
        self._broadcast(self._message(index))  # in any case everyone gets the value in force

    def _change(self, index: int, value: float) -> str:
        """Put a value in force and in the table; why not, if it cannot be."""
        try:
            changed = replace(self._table[index], value=value)  # the one check of its range
        except ParameterRangeError as error:
            return error.flaw
        if flaw := self._put_in_force(changed):
            return flaw
        self._table[index] = changed
        self._events.append(ParameterChanged(changed.name, value))
        return ""

    def _refuse_type(self, parameter: Parameter, value: float, kind: int, index: int, peer: Peer) -> None:
        is_known = kind in {row.type for row in self._table}
        error = "TYPE_MISMATCH" if is_known else "TYPE_UNSUPPORTED"
        names = [enum_name("MAV_PARAM_TYPE", number) for number in (kind, parameter.type)]
        reason = f"{names[0]} is the wrong type, it is {names[1]}"
        self._events.append(ParameterRefused(parameter.name, value, reason))
        self._refuse(parameter.name, index, getattr(mavlink, f"MAV_PARAM_ERROR_{error}"), peer)
        self._broadcast(self._message(index))

    def _refuse_extended_set(self, message: Message, _now: float, peer: Peer) -> None:
        name, result = message.param_id, mavlink.PARAM_ACK_VALUE_UNSUPPORTED
        self._reply(peer, mavlink.MAVLink_param_ext_ack_message(raw_name(name), b"", message.param_type, result))
        self._events.append(ParameterRefused(name, None, NO_EXTENDED_PARAMETERS))

    def _refuse_extended_read(self, message: Message, _now: float, _peer: Peer) -> None:
        self._events.append(
            ParameterRefused(message.param_id or f"Index {message.param_index}", None, NO_EXTENDED_PARAMETERS)
        )

    def _refuse_extended_list(self, _message: Message, _now: float, _peer: Peer) -> None:
        self._events.append(ParameterRefused("Parameter list", None, NO_EXTENDED_PARAMETERS))

    def _index(self, name: str) -> int:
        if name not in self._indices:
            raise LocalProtocolError(f"no parameter {name}")
        return self._indices[name]

    def _message(self, index: int) -> Message:
        p = self._table[index]
        return mavlink.MAVLink_param_value_message(
            param_id=p.name.encode("ascii"),
            param_value=encode_value(p.value, p.type),
            param_type=p.type,
            param_count=len(self._table),
            param_index=index,
        )

    def _refuse(self, name: str, index: int, error: int, peer: Peer) -> None:
        self._reply(peer, param_error(peer, name, index, error))


def _is_whole(value: float, received: int, kind: int) -> bool:
    """True for a float that fits an integer parameter: clients that read the table as a file know no other type."""
    if received != mavlink.MAV_PARAM_TYPE_REAL32 or not float(value).is_integer():
        return False
    try:
        encode_value(value, kind)
    except LocalProtocolError:
        return False
    return True
