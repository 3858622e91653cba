"""Several ground stations, one in control: who may steer the vehicle, and how control changes hands.

The rules are those of MAVLink's multi-station draft (MAV_CMD_REQUEST_OPERATOR_CONTROL, 32100):

- While nobody is in control, every station may steer. Who asks with 32100 is in control; also who armed the vehicle, if
  the endpoint's owner tells.
- What others send to steer is refused, with the result the protocol has for it; they may ask for anything that only
  tells them something. Components of the vehicle's own system are never refused.
- A station that asks gets control if the one in control allows it (param2 of its own request) or gives control back;
  otherwise that one is told of the request: it gets the same command with the asker's id as param4.
- Control that came by arming ends with disarming; any ends when the station was silent for ``SILENT`` seconds.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.engines import stream
from protocol.engines.base import Peer, Server, addressed_to
from protocol.events import OperatorChanged, OperatorRefused, OperatorRequested

__all__ = ["OperatorControl"]

SILENT = 10.0  # a station in control that says nothing for so long loses it [s]
TOLD_AGAIN = 3.0  # between notes to the station in control that another one asks [s]

_COMMANDS = frozenset({"COMMAND_LONG", "COMMAND_INT"})
_PLANS = frozenset({"MISSION_COUNT", "MISSION_WRITE_PARTIAL_LIST", "MISSION_CLEAR_ALL", "MISSION_SET_CURRENT"})
_ANCHORS = frozenset({"SET_HOME_POSITION", "SET_GPS_GLOBAL_ORIGIN"})
_SETPOINTS = frozenset(
    {
        "SET_POSITION_TARGET_LOCAL_NED",
        "SET_POSITION_TARGET_GLOBAL_INT",
        "SET_ATTITUDE_TARGET",
        "SET_ACTUATOR_CONTROL_TARGET",
        "MANUAL_CONTROL",
    }
)


class _Wish(NamedTuple):
    control: bool  # to be in control; not: to give it back
    takeover: bool  # to let others take it
    timeout: float  # that the one in control has for its answer [s]


class OperatorControl(Server):
    """Stands before all other engines: ``admits`` says whether a message may reach them.

    Args:
        system: Own system id.
        component: Own component id.
        harmless: Further commands that steer nothing.
    """

    handles = frozenset[str]()  # it takes no message type for itself

    def __init__(self, system: int, component: int, harmless: Iterable[int] = ()) -> None:
        super().__init__()
        self.only_one = True  # whether one station at a time is in control
        self.takeover = False  # whether the one in control lets others take it
        self._system, self._component = system, component
        self._harmless = stream.COMMANDS | frozenset(harmless)
        self._holder: Peer | None = None
        self._by_arming = False
        self._fell_silent: int | None = None
        self._heard = self._told = -math.inf

    @property
    def holder(self) -> Peer | None:
        """The station in control; None: every one is."""
        return self._holder if self.only_one else None

    @property
    def missed(self) -> int | None:
        """System id of the station in control, or of the one that fell silent in control and nobody replaced since."""
        return self._fell_silent if self.holder is None else self.holder.system

    def receive(self, message: Message, now: float, peer: Peer) -> None:
        """As ``admits``, for who does not want to know."""
        self.admits(message, now, peer)

    def admits(self, message: Message, now: float, peer: Peer) -> bool:
        """Whether a message may be acted on; if not, its sender has its answer."""
        self.handle_timer(now)
        holder = self.holder
        if holder is not None and peer.system == holder.system:
            self._holder, self._heard = peer, now
        if peer.system == self._fell_silent:
            self._fell_silent = None
        if not addressed_to(message, self._system, self._component):
            return True
        if message.get_type() in _COMMANDS and message.command == mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL:
            self._answer(message, now, peer)
            return False
        if holder is None or peer.system in {holder.system, self._system} or not self._steers(message):
            return True
        self._refuse(message, peer)
        self._events.append(OperatorRefused(peer, holder.system))
        return False

    def armed(self, peer: Peer, now: float) -> None:
        """The vehicle was armed by this peer: it is in control if nobody is."""
        if self._holder is None and peer.system != self._system:
            self._give(peer, now, by_arming=True)

    def disarmed(self) -> None:
        """The vehicle is not armed."""
        self._fell_silent = None
        if self._by_arming:
            self._free("disarmed")

    def handle_timer(self, now: float) -> None:
        """Control of a silent station ends."""
        if self._holder is not None and now >= self.next_deadline():
            self._fell_silent = self._holder.system
            self._free(f"silent for {SILENT:g} s")

    def next_deadline(self) -> float:
        """When a silent station loses control."""
        return self._heard + SILENT if self._holder is not None else math.inf

    def _answer(self, message: Message, now: float, peer: Peer) -> None:
        wish = _read(message)
        result = mavlink.MAV_RESULT_ACCEPTED
        others = self.holder is not None and self.holder.system != peer.system
        if wish is None:
            result = mavlink.MAV_RESULT_DENIED
        elif not self.only_one:
            result = mavlink.MAV_RESULT_UNSUPPORTED
        elif others and not wish.control:
            result = mavlink.MAV_RESULT_NOT_IN_CONTROL
        elif others and not self.takeover:
            result = mavlink.MAV_RESULT_FAILED  # for stations: it was passed on, and may be granted yet
            self._ask_holder(wish, now, peer)
        elif wish.control:
            self._give(peer, now, by_arming=False)
            self.takeover = wish.takeover
        elif self._holder is not None:
            self._free("given back")
        self._reply(peer, mavlink.MAVLink_command_ack_message(message.command, result, 0, 0, *peer[:2]))

    def _ask_holder(self, wish: "_Wish", now: float, peer: Peer) -> None:
        if self._holder is None or now - self._told < TOLD_AGAIN:
            return
        self._told = now
        params = (1.0, float(wish.takeover), wish.timeout, float(peer.system), 0.0, 0.0, 0.0)
        self._reply(
            self._holder,
            mavlink.MAVLink_command_long_message(
                *self._holder[:2], mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, 0, *params
            ),
        )
        self._events.append(OperatorRequested(peer, self._holder.system))

    def _give(self, peer: Peer, now: float, *, by_arming: bool) -> None:
        changed = self._holder is None or self._holder.system != peer.system
        self._holder, self._heard, self._by_arming = peer, now, by_arming
        self._fell_silent = None
        self.takeover = False
        if changed:
            self._events.append(OperatorChanged(peer.system, "armed" if by_arming else "asked for it"))

    def _free(self, why: str) -> None:
        self._holder, self._by_arming, self.takeover = None, False, False
        self._events.append(OperatorChanged(0, why))

    def _steers(self, message: Message) -> bool:
        kind = message.get_type()
        if kind in _COMMANDS:
            return message.command not in self._harmless
        return kind in _PLANS | _SETPOINTS | _ANCHORS | {"PARAM_SET", "SET_MODE", "LOG_ERASE"}

    def _refuse(self, message: Message, peer: Peer) -> None:
        """The protocol's own word for it; set-points, modes by message, home, origin and log erasure have none."""
        kind, to = message.get_type(), peer[:2]
        if kind in _COMMANDS:
            self._reply(
                peer, mavlink.MAVLink_command_ack_message(message.command, mavlink.MAV_RESULT_NOT_IN_CONTROL, 0, 0, *to)
            )
        elif kind in _PLANS:
            mission_type = getattr(message, "mission_type", mavlink.MAV_MISSION_TYPE_MISSION)
            self._reply(peer, mavlink.MAVLink_mission_ack_message(*to, mavlink.MAV_MISSION_DENIED, mission_type))
        elif kind == "PARAM_SET":
            name = message.param_id.encode("ascii", errors="replace")[:16]
            denied = mavlink.MAV_PARAM_ERROR_PERMISSION_DENIED
            self._reply(peer, mavlink.MAVLink_param_error_message(*to, name, -1, denied))


def _read(message: Message) -> _Wish | None:
    """What MAV_CMD_REQUEST_OPERATOR_CONTROL asks for.

    Its parameters are action, takeover, time-out and the sender's id; until 2026 they were 0, action, takeover and
    time-out, and stations of both kinds are about.
    """
    params = (message.param1, message.param2, message.param3, message.param4)
    if params[0] == 0.0 and params[1] == 1.0 and params[3] != message.get_srcSystem():
        params = (*params[1:], math.nan)
    action, takeover, timeout, _ = params
    return _Wish(bool(action), takeover == 1.0, timeout) if action in {0.0, 1.0} else None
