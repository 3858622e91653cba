"""Texts about signing: changed keys and refused frames.

https://mavlink.io/en/guide/message_signing.html
"""

from __future__ import annotations

from protocol.events import SigningChanged
from protocol.wire.keyring import Keyring, KeyState, Verdict
from sitl.mavlink.broadcast import Broadcast
from sitl.mavlink.handlers import on_event

REPORT_INTERVAL = 30.0  # between two reports of refused frames: a flood of frames must not become one of texts [s]


class SigningService:
    """Reports changed keys at once and refused frames now and then.

    Args:
        keyring: Counts refused frames.
        broadcast: Tells everyone a text.
    """

    def __init__(self, keyring: Keyring, broadcast: Broadcast) -> None:
        self._keyring, self._broadcast = keyring, broadcast
        self._reported, self._next_report = 0, float("-inf")

    @on_event(SigningChanged)
    def announce(self, event: SigningChanged, _now: float) -> None:
        """A key was accepted, refused or has expired."""
        if event.state is KeyState.REFUSED:
            self._broadcast.complain(event.text)
        elif event.state is KeyState.EXPIRED:
            self._broadcast.warn(event.text)
        else:
            self._broadcast.info(event.text)

    def handle_timer(self, now: float) -> None:
        """Report refused frames if there are more of them and the last report is old enough.

        Args:
            now: The link's time [s].
        """
        refused = self._keyring.refused
        if refused == self._reported or now < self._next_report:
            return
        self._reported, self._next_report = refused, now + REPORT_INTERVAL
        counts = self._keyring.counts
        kinds = [verdict for verdict in Verdict if verdict.is_refused and verdict in counts]
        self._broadcast.warn("Messages refused so far: " + ", ".join(f"{counts[kind]} {kind.value}" for kind in kinds))
