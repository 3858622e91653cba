"""Operator control: which of several ground stations may control the vehicle, and how control changes hands.

The rules are those of MAVLink's multi-station draft (MAV_CMD_REQUEST_OPERATOR_CONTROL, 32100):

- While no station is in control, every station may control the vehicle. A station that sends 32100 is in control, and
  so is the one that armed the vehicle, if the endpoint's owner calls ``armed``.
- Messages of other stations that would change the flight are refused, with the result that each protocol has for it;
  requests for information are allowed. Components of the vehicle's own system are never refused.
- A station that asks gets control if the one in control allows it (param2 of its own request) or gives control back.
  Otherwise the one in control is notified: it gets the same command with the asking station's id as param4.
- Control obtained by arming ends with disarming. Any control ends after ``CONTROL_TIMEOUT`` seconds of silence.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.engines.base import Server
from protocol.engines.server.replies import command_ack, mission_ack, param_error, plan_file_ack
from protocol.engines.server.stream_server import STREAM_COMMANDS
from protocol.events import CommandRefused, OperatorChanged, OperatorRefused, OperatorRequested
from protocol.ranges import refuse_command
from protocol.wire.message import Message, Peer, addressed_to, target_fields

CONTROL_TIMEOUT = 10.0  # [s] of silence after which a station loses control
NOTIFY_INTERVAL = 3.0  # [s] between two notifications that another station asks for control

_COMMANDS = frozenset({"COMMAND_LONG", "COMMAND_INT"})
_PLANS = frozenset({"MISSION_COUNT", "MISSION_WRITE_PARTIAL_LIST", "MISSION_CLEAR_ALL", "MISSION_SET_CURRENT"})
_OTHER_CONTROLS = frozenset(
    {
        "MANUAL_CONTROL",
        "SET_HOME_POSITION",
        "SET_GPS_GLOBAL_ORIGIN",
        "PARAM_SET",
        "SET_MODE",
        "LOG_ERASE",
        "DARKO_PLAN_FILE",
    }
)
SETPOINT_MESSAGES = frozenset(
    {
        "SET_POSITION_TARGET_LOCAL_NED",
        "SET_POSITION_TARGET_GLOBAL_INT",
        "SET_ATTITUDE_TARGET",
        "SET_ACTUATOR_CONTROL_TARGET",
    }
)


class _Wish(NamedTuple):
    control: bool  # True: to get control; False: to give it back
    takeover: bool  # other stations may take control from this one
    timeout: float  # for the answer of the station in control [s]


class OperatorControl(Server):
    """Checks every message before the other engines: ``admits`` decides whether it may reach them.

    Args:
        system: Own system id.
        component: Own component id.
        harmless: Further commands that do not control the vehicle.
    """

    handles = frozenset[str]()  # it handles no message type of its own

    def __init__(self, system: int, component: int, harmless: Iterable[int] = ()) -> None:
        super().__init__()
        self.only_one = True  # one station at a time is in control
        self.takeover = False  # other stations may take control from the present one
        self._system, self._component = system, component
        self._harmless = STREAM_COMMANDS | frozenset(harmless)
        self._holder: Peer | None = None
        self._by_arming = False
        self._fell_silent: int | None = None
        self._heard = self._notified = -math.inf

    @property
    def holder(self) -> Peer | None:
        """The station in control; None: every station is."""
        return self._holder if self.only_one else None

    @property
    def missed(self) -> int | None:
        """System id of the station in control, or of one that fell silent in control and was not replaced since."""
        return self._fell_silent if self.holder is None else self.holder.system

    def receive(self, message: Message, now: float, peer: Peer) -> None:
        """As ``admits``, without the result."""
        self.admits(message, now, peer)

    def admits(self, message: Message, now: float, peer: Peer) -> bool:
        """Whether a message may reach the other engines; if not, its sender has been answered."""
        self.handle_timer(now)
        holder = self.holder
        if holder is not None and peer.system == holder.system:
            self._holder, self._heard = peer, now
        if peer.system == self._fell_silent:
            self._fell_silent = None
        if not addressed_to(message, self._system, self._component):
            return True
        if self.is_asked(message):
            self._answer(message, now, peer)
            return False
        if holder is None or peer.system in {holder.system, self._system} or not self._controls(message):
            return True
        self._refuse(message, peer)
        self._events.append(OperatorRefused(peer, holder.system))
        return False

    def is_asked(self, message: Message) -> bool:
        """Whether a message asks for control of this vehicle, or gives it back."""
        is_command = message.get_type() in _COMMANDS and addressed_to(message, self._system, self._component)
        return is_command and message.command == mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL

    def armed(self, peer: Peer, now: float) -> None:
        """This peer armed the vehicle: it gets control if no station has it."""
        if self._holder is None and peer.system != self._system:
            self._give(peer, now, by_arming=True)

    def disarmed(self) -> None:
        """The vehicle is not armed."""
        self._fell_silent = None
        if self._by_arming:
            self._free("disarmed")

    def handle_timer(self, now: float) -> None:
        """Take control from a silent station."""
        if self._holder is not None and now >= self.next_deadline():
            self._fell_silent = self._holder.system
            self._free(f"silent for {CONTROL_TIMEOUT:g} s")

    def next_deadline(self) -> float:
        """Link time at which a silent station loses control [s]."""
        return self._heard + CONTROL_TIMEOUT if self._holder is not None else math.inf

    def _answer(self, message: Message, now: float, peer: Peer) -> None:
        params = (message.param1, message.param2, message.param3, message.param4, 0.0, 0.0, 0.0)
        flaw = refuse_command(message.command, None, params)
        wish = None if flaw else _read(message)
        result = mavlink.MAV_RESULT_ACCEPTED
        is_taken = self.holder is not None and self.holder.system != peer.system
        if wish is None:
            result = mavlink.MAV_RESULT_DENIED
            self._events.append(CommandRefused(message.command, result, peer, flaw or "Control denied: no such action"))
        elif not self.only_one:
            result = mavlink.MAV_RESULT_UNSUPPORTED
        elif is_taken and not wish.control:
            result = mavlink.MAV_RESULT_NOT_IN_CONTROL
        elif is_taken and not self.takeover:
            result = mavlink.MAV_RESULT_FAILED  # means to stations: the request was passed on and may still be granted
            self._ask_holder(wish, now, peer)
        elif wish.control:
            self._give(peer, now, by_arming=False)
            self.takeover = wish.takeover
        elif self._holder is not None:
            self._free("given back")
        self._reply(peer, command_ack(peer, message.command, result))

    def _ask_holder(self, wish: _Wish, now: float, peer: Peer) -> None:
        if self._holder is None or now - self._notified < NOTIFY_INTERVAL:
            return
        self._notified = now
        request = mavlink.MAVLink_command_long_message(
            **target_fields(self._holder),
            command=mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL,
            confirmation=0,
            param1=1.0,
            param2=float(wish.takeover),
            param3=wish.timeout,
            param4=float(peer.system),
            param5=0.0,
            param6=0.0,
            param7=0.0,
        )
        self._reply(self._holder, request)
        self._events.append(OperatorRequested(peer, self._holder.system))

    def _give(self, peer: Peer, now: float, *, by_arming: bool) -> None:
        changed = self._holder is None or self._holder.system != peer.system
        self._holder, self._heard, self._by_arming = peer, now, by_arming
        self._fell_silent = None
        self.takeover = False
        if changed:
            self._events.append(OperatorChanged(peer.system, "armed" if by_arming else "requested"))

    def _free(self, why: str) -> None:
        self._holder, self._by_arming, self.takeover = None, False, False
        self._events.append(OperatorChanged(0, why))

    def _controls(self, message: Message) -> bool:
        kind = message.get_type()
        if kind in _COMMANDS:
            return message.command not in self._harmless
        return kind in _PLANS | SETPOINT_MESSAGES | _OTHER_CONTROLS

    def _refuse(self, message: Message, peer: Peer) -> None:
        """Send the refusal of the message's protocol; set-points, SET_MODE, home, origin and LOG_ERASE have none."""
        kind = message.get_type()
        if kind in _COMMANDS:
            self._reply(peer, command_ack(peer, message.command, mavlink.MAV_RESULT_NOT_IN_CONTROL))
        elif kind in _PLANS:
            mission_type = getattr(message, "mission_type", mavlink.MAV_MISSION_TYPE_MISSION)
            self._reply(peer, mission_ack(peer, mavlink.MAV_MISSION_DENIED, mission_type))
        elif kind == "PARAM_SET":
            self._reply(peer, param_error(peer, message.param_id, -1, mavlink.MAV_PARAM_ERROR_PERMISSION_DENIED))
        elif kind == "DARKO_PLAN_FILE":
            result, text = mavlink.MAV_RESULT_NOT_IN_CONTROL, b"another ground station is in control"
            self._reply(peer, plan_file_ack(peer, message.crc, message.offset, result, text))


def _read(message: Message) -> _Wish | None:
    """The request in a MAV_CMD_REQUEST_OPERATOR_CONTROL.

    Its parameters are action, takeover, timeout and the sender's id. Until 2026 they were 0, action, takeover and
    timeout; stations of both kinds are in use.
    """
    params = (message.param1, message.param2, message.param3, message.param4)
    if params[0] == 0.0 and params[1] == 1.0 and params[3] != message.get_srcSystem():
        params = (*params[1:], math.nan)
    action, takeover, timeout, _ = params
    return _Wish(bool(action), takeover == 1.0, timeout) if action in {0.0, 1.0} else None
