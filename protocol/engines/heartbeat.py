"""Presence: who sends HEARTBEAT, and who listens (https://mavlink.io/en/services/heartbeat.html)."""

import math

from protocol.codec import Message, Source, source_of
from protocol.dialect import mavlink
from protocol.engines.base import Engine, Table, fire
from protocol.events import VehicleFound, VehicleLost, VehicleReturned

__all__ = ["TRANSITIONS", "HeartbeatMonitor", "HeartbeatSource"]

PERIOD = 1.0  # [s]
SILENCE = 3.0  # [s] after which clients call a vehicle lost

TRANSITIONS: Table = {
    ("searching", "heartbeat"): "present",
    ("present", "heartbeat"): "present",
    ("present", "silence"): "lost",
    ("lost", "heartbeat"): "present",
}


class HeartbeatSource(Engine[Message]):
    """Sends HEARTBEAT every second, and at once when its content changes."""

    def __init__(self, period: float = PERIOD) -> None:
        super().__init__()
        self._period = period
        self._message: Message | None = None
        self._deadline = math.inf

    def announce(self, message: Message, now: float) -> None:
        """What HEARTBEAT says from now on. After this call: drain ``messages_to_send()``."""
        if self._message is None or message.to_dict() != self._message.to_dict():
            self._message = message
            self._send()
            self._deadline = now + self._period

    def next_deadline(self) -> float:
        """When the next HEARTBEAT is due."""
        return self._deadline

    def handle_timer(self, now: float) -> None:
        """Send when due; beats missed by a late caller are not made up for."""
        if now >= self._deadline:
            self._send()
            self._deadline += self._period * (1 + math.floor((now - self._deadline) / self._period))

    def _send(self) -> None:
        self._out.append(self._message)


class HeartbeatMonitor(Engine[Message]):
    """Finds the autopilot (component 1), notices its silence and its return.

    The first one that is heard stays the vehicle, also while it is lost: whoever speaks up during its silence would
    else be given what was meant for it, and keep its place when it returns.

    Args:
        silence: After which it is lost [s].
        system: The system id it must have; None takes any.
    """

    def __init__(self, silence: float = SILENCE, system: int | None = None) -> None:
        super().__init__()
        self._system = system
        self.state = "searching"
        self.vehicle: Source | None = None
        self._silence, self._heard = silence, -math.inf

    @property
    def is_present(self) -> bool:
        """True while HEARTBEATs arrive."""
        return self.state == "present"

    def receive(self, message: Message, now: float) -> None:
        """Take a HEARTBEAT; ground stations, other components and second vehicles are not ours."""
        if message.get_type() != "HEARTBEAT" or not _is_autopilot(message):
            return
        source = source_of(message)
        if not self.may_be(source):
            return
        if self.vehicle is None:
            self._events.append(VehicleFound(*source))
        elif self.state == "lost":
            self._events.append(VehicleReturned(now - self._heard))
        self.state = fire(TRANSITIONS, self.state, "heartbeat")
        self.vehicle, self._heard = source, now

    def may_be(self, source: Source) -> bool:
        """Whether a sender is the vehicle, or could become it."""
        return self.vehicle in {None, source} and self._system in {None, source[0]}

    def next_deadline(self) -> float:
        """When silence becomes loss."""
        return self._heard + self._silence if self.is_present else math.inf

    def handle_timer(self, now: float) -> None:
        """Declare the vehicle lost when it has been silent for too long."""
        if now >= self.next_deadline():
            self.state = fire(TRANSITIONS, self.state, "silence")
            self._events.append(VehicleLost(now - self._heard))


def _is_autopilot(message: Message) -> bool:
    return bool(
        message.get_srcComponent() == mavlink.MAV_COMP_ID_AUTOPILOT1
        and message.type != mavlink.MAV_TYPE_GCS
        and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID
    )
