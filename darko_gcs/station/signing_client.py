"""The state of signing on the link, and our key for a vehicle that has none."""

from __future__ import annotations

import math

from darko_gcs.state.values import SigningState
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.wire.framing import SIGNED_FLAG
from protocol.wire.message import Message, Source, source_of

KEY_RETRY_TIME = 15.0  # between two keys sent [s]; a vehicle waits 10 s for a frame signed with a new key


class SigningClient:
    """Watches the signatures of one endpoint's vehicle.

    The owner of the link sets ``is_private``: True while the vehicle is reached over loopback, None before it is heard.

    Args:
        endpoint: The ground station's.
        give_key: Send our key to a vehicle that does not sign. Only over loopback: SETUP_SIGNING carries the key
            readable, and a signature hides nothing.
    """

    def __init__(self, endpoint: GroundEndpoint, *, give_key: bool = False) -> None:
        self.is_private: bool | None = None
        self._endpoint, self._give_key = endpoint, give_key
        self._vehicle_signs = False
        self._next_key = -math.inf  # when the key may be sent again [s]

    @property
    def state(self) -> SigningState:
        """The state to show to the operator."""
        if self._endpoint.keyring.is_on:
            return SigningState.SIGNED if self._unsigned_vehicle() is None else SigningState.UNSIGNED_VEHICLE
        if self._vehicle_signs:
            return SigningState.NO_KEY
        return SigningState.OPEN if self.is_private is False else SigningState.PRIVATE

    def receive(self, message: Message) -> None:
        """Take an accepted message."""
        if source_of(message) == self._endpoint.vehicle:
            self._vehicle_signs = bool(message.get_header().incompat_flags & SIGNED_FLAG)

    def handle_timer(self, now: float) -> str:
        """Send the key if wanted, needed and safe. Returns a text for the operator, or ""."""
        vehicle, key = self._unsigned_vehicle(), self._endpoint.keyring.key(None)
        if not self._give_key or vehicle is None or key is None or now < self._next_key:
            return ""
        self._next_key = now + KEY_RETRY_TIME
        if not self.is_private:
            return "Signing key NOT sent: others could read it on this link. Give it over loopback, or by hand"
        self._endpoint.send_key(key, self._endpoint.keyring.next_timestamp(), vehicle)
        return f"Signing key sent to {vehicle[0]}/{vehicle[1]} over loopback"

    def _unsigned_vehicle(self) -> Source | None:
        """A vehicle that does not sign as it should, unless a vehicle that does is present."""
        return None if self._endpoint.is_present else self._endpoint.unsigned_vehicle
