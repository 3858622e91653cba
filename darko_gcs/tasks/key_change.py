"""Changes the vehicle's signing key without a moment at which nobody can command it.

https://mavlink.io/en/guide/message_signing.html. SETUP_SIGNING, signed with the key in force, carries the new key. The
vehicle accepts the new key when a frame signed with it arrives. Both sides keep the old key until they have seen the
other use the new one, and for good if that never happens.
"""

from __future__ import annotations

import argparse
import asyncio
import math

from darko_gcs.errors import GroundError, LinkError
from darko_gcs.scripting.link_session import POLL_PERIOD, VEHICLE_TIMEOUT, open_link
from darko_gcs.station.keyring_setup import SigningClient, open_keyring
from darko_gcs.station.station import Station
from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GROUND_HEARTBEAT, GroundEndpoint
from protocol.errors import FileError
from protocol.wire.codec import Codec
from protocol.wire.message import Source
from protocol.wire.signing import Signature, load_key, sign_frame

PROPOSAL_PERIOD = 1.0  # [s]
MAX_PROPOSALS = 5
CONFIRMATION_WAIT = 9.0  # after the last proposal; a vehicle waits 10 s for the confirmation [s]
PROBE_LINK_ID = 255  # gives the frames that are signed with the new key a stream of their own


class KeyChangeover:
    """Proposes a key and sends frames signed with it, until the vehicle signs with it; then the keyring has it too.

    Args:
        endpoint: The ground station's, with the key in force.
        signing: Knows whether the vehicle is on loopback: over no other link is a key sent.
        key: The new key.

    Raises:
        GroundError: The link is not signed, or has this key already.
    """

    def __init__(self, endpoint: GroundEndpoint, signing: SigningClient, key: bytes) -> None:
        if not endpoint.keyring.is_on:
            raise GroundError("no key is in force: give the vehicle its first key with --give-key")
        if endpoint.keyring.key(None) == key:
            raise GroundError("the new key is the one in force")
        self._endpoint, self._signing, self._key = endpoint, signing, key
        self._proposals_left, self._next_proposal = MAX_PROPOSALS, -math.inf

    @property
    def is_done(self) -> bool:
        """True as soon as the vehicle signs with the new key."""
        return self._endpoint.keyring.key(None) == self._key

    def handle_timer(self, now: float) -> None:
        """Propose the key again when it is time.

        Raises:
            GroundError: The vehicle is not on loopback: no key was sent.
            LinkError: The vehicle never signed with the new key; the old one stays in force.
        """
        vehicle = self._endpoint.vehicle
        if self.is_done or vehicle is None or now < self._next_proposal:
            return
        if not self._signing.is_private:
            raise GroundError("the key was NOT sent: others could read it on this link. Change it over loopback")
        if not self._proposals_left:
            raise LinkError("the vehicle did not accept the new key: the old one stays in force")
        self._proposals_left -= 1
        self._next_proposal = now + (PROPOSAL_PERIOD if self._proposals_left else CONFIRMATION_WAIT)
        self._propose(vehicle)

    def _propose(self, vehicle: Source) -> None:
        keyring = self._endpoint.keyring
        keyring.propose(None, self._key, keyring.next_timestamp(), signed=True)  # as the vehicle does on its side
        self._endpoint.send_key(self._key, keyring.next_timestamp(), vehicle)
        frame = Codec(self._endpoint.codec.system, mavlink.MAV_COMP_ID_MISSIONPLANNER).encode(GROUND_HEARTBEAT)
        self._endpoint.send_frame(sign_frame(frame, self._key, Signature(PROBE_LINK_ID, keyring.next_timestamp())))


async def change_key(args: argparse.Namespace) -> Source:
    """Change the key of the vehicle on the link.

    Args:
        args: Options of ``darko-gcs signing``.

    Returns:
        System and component of the vehicle.

    Raises:
        GroundError: A key, the link or the vehicle fails; the message says which key is in force.
    """
    try:
        key = load_key(args.new_key)
    except FileError as error:
        raise GroundError(f"--new-key: {error}") from error
    station = Station(keyring=open_keyring(args.signing_key), vehicle=args.vehicle, system=args.id)
    changeover = KeyChangeover(station.endpoint, station.signing, key)
    async with open_link(station, args.host, args.port) as link:
        deadline = link.now + VEHICLE_TIMEOUT
        while not changeover.is_done:
            if station.endpoint.vehicle is None and link.now > deadline:
                raise LinkError(f"no vehicle that signs with the old key heard within {VEHICLE_TIMEOUT:g} s")
            changeover.handle_timer(link.now)
            await asyncio.sleep(POLL_PERIOD)
    vehicle = station.endpoint.vehicle
    if vehicle is None:
        raise LinkError("the vehicle was lost")
    return vehicle
