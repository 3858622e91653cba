"""Sends HEARTBEAT, on both sides (https://mavlink.io/en/services/heartbeat.html)."""

from __future__ import annotations

import math

from protocol.engines.base import Engine
from protocol.wire.message import Message

__all__ = ["HEARTBEAT_PERIOD", "HeartbeatSource"]

HEARTBEAT_PERIOD = 1.0  # [s]


class HeartbeatSource(Engine[Message]):
    """Sends HEARTBEAT every second, and at once when its content changes."""

    def __init__(self, period: float = HEARTBEAT_PERIOD) -> None:
        super().__init__()
        self._period = period
        self._message: Message | None = None
        self._deadline = math.inf

    def announce(self, message: Message, now: float) -> None:
        """Set the HEARTBEAT to send from now on. After this call: drain ``messages_to_send()``."""
        if self._message is None or message.to_dict() != self._message.to_dict():
            self._message = message
            self._send()
            self._deadline = now + self._period

    def next_deadline(self) -> float:
        """Link time at which the next HEARTBEAT is due [s]."""
        return self._deadline

    def handle_timer(self, now: float) -> None:
        """Send if due; beats that a late caller missed are not sent later."""
        if now >= self._deadline:
            self._send()
            self._deadline += self._period * (1 + math.floor((now - self._deadline) / self._period))

    def _send(self) -> None:
        self._out.append(self._message)
