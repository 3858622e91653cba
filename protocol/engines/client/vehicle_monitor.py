"""Finds the vehicle by its HEARTBEAT and notices its silence (https://mavlink.io/en/services/heartbeat.html)."""

from __future__ import annotations

import math

from protocol.dialect import mavlink
from protocol.engines.base import Engine, TransitionTable, fire
from protocol.events import VehicleFound, VehicleLost, VehicleReturned
from protocol.wire.message import Message, Source, source_of

__all__ = ["VEHICLE_MONITOR_TRANSITIONS", "VehicleMonitor"]

HEARTBEAT_TIMEOUT = 3.0  # [s] of silence after which a vehicle counts as lost

VEHICLE_MONITOR_TRANSITIONS: TransitionTable = {
    ("searching", "heartbeat"): "present",
    ("present", "heartbeat"): "present",
    ("present", "silence"): "lost",
    ("lost", "heartbeat"): "present",
}


class VehicleMonitor(Engine[Message]):
    """Finds the autopilot (component 1), notices its silence and its return.

    The first autopilot heard stays the vehicle, also while it is lost. Otherwise another one that appears during the
    silence would receive the messages meant for it, and stay the vehicle after its return.

    Args:
        timeout: Silence after which it is lost [s].
        system: The system id it must have; None accepts any.
    """

    def __init__(self, timeout: float = HEARTBEAT_TIMEOUT, system: int | None = None) -> None:
        super().__init__()
        self._system = system
        self.state = "searching"
        self.vehicle: Source | None = None
        self._timeout, self._heard = timeout, -math.inf

    @property
    def is_present(self) -> bool:
        """True while HEARTBEATs arrive."""
        return self.state == "present"

    def receive(self, message: Message, now: float) -> None:
        """Take a HEARTBEAT; those of ground stations, other components and further vehicles are ignored."""
        if message.get_type() != "HEARTBEAT" or not _is_autopilot(message):
            return
        source = source_of(message)
        if not self.may_be(source):
            return
        if self.vehicle is None:
            self._events.append(VehicleFound(*source))
        elif self.state == "lost":
            self._events.append(VehicleReturned(now - self._heard))
        self.state = fire(VEHICLE_MONITOR_TRANSITIONS, self.state, "heartbeat")
        self.vehicle, self._heard = source, now

    def may_be(self, source: Source) -> bool:
        """Whether a sender is the vehicle, or could become it."""
        return self.vehicle in {None, source} and self._system in {None, source[0]}

    def next_deadline(self) -> float:
        """Link time at which a silent vehicle is declared lost [s]."""
        return self._heard + self._timeout if self.is_present else math.inf

    def handle_timer(self, now: float) -> None:
        """Declare the vehicle lost if it has been silent for too long."""
        if now >= self.next_deadline():
            self.state = fire(VEHICLE_MONITOR_TRANSITIONS, self.state, "silence")
            self._events.append(VehicleLost(now - self._heard))


def _is_autopilot(message: Message) -> bool:
    return bool(
        message.get_srcComponent() == mavlink.MAV_COMP_ID_AUTOPILOT1
        and message.type != mavlink.MAV_TYPE_GCS
        and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID
    )
