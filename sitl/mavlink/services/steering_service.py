"""Set-points and sticks, which peers stream without an answer; a refusal is explained now and then."""

from __future__ import annotations

from protocol.events import SetpointReceived
from protocol.plans.validation import Refusal
from protocol.wire.message import Message
from sitl.autopilot.autopilot import Autopilot
from sitl.mavlink.broadcast import Broadcast
from sitl.mavlink.handlers import on_event, on_message
from sitl.mavlink.manual_control import sticks_of
from sitl.mavlink.offboard_setpoints import take_setpoint


class SteeringService:
    """Hands set-points and sticks to the autopilot.

    Args:
        autopilot: Flies them.
        broadcast: Tells everyone a text.
        system: The vehicle's system id.
    """

    def __init__(self, autopilot: Autopilot, broadcast: Broadcast, system: int) -> None:
        self._autopilot, self._broadcast, self._system = autopilot, broadcast, system

    @on_event(SetpointReceived)
    def take_setpoint(self, event: SetpointReceived, _now: float) -> None:
        """A set-point of OFFBOARD."""
        reason = take_setpoint(self._autopilot, event.message)
        if reason is not None:
            self._broadcast.complain(f"Set-point refused: {reason}")

    @on_message("MANUAL_CONTROL")
    def take_sticks(self, message: Message) -> None:
        """A pilot's sticks."""
        if message.target not in {0, self._system}:
            return
        sticks = sticks_of(message)
        if isinstance(sticks, Refusal):
            self._broadcast.complain(f"Sticks refused: {sticks.text}")
        else:
            self._autopilot.manual.take_sticks(sticks)
