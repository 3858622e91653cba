"""Signed frames, and a vehicle that accepts them."""

from collections.abc import Hashable

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.events import SetpointReceived, SigningChanged
from protocol.wire.signing import Keyring, Signature, sign_frame
from tests.support.links.link import ARM, frame, table

KEY, OTHER = bytes(range(32)), bytes(range(1, 33))


T = 36_000_000_000_000  # some day in 2026 [10 us since 2015]


LOCAL = "ground"


def heartbeat(kind=6, autopilot=8):
    return mavlink.MAVLink_heartbeat_message(kind, autopilot, 0, 0, 4, 3)


def arm():
    return mavlink.MAVLink_command_long_message(1, 1, ARM, 0, 1, 0, 0, 0, 0, 0, 0)


def setup(key, timestamp=T):
    return mavlink.MAVLink_setup_signing_message(1, 1, list(key), timestamp)


def order():
    return mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 2552, *[1.0] * 11)


def signed(message, key=KEY, timestamp=T, link=0, system=255, component=190):
    return sign_frame(frame(message, system, component), key, Signature(link, timestamp))


def vehicle(keyring=None, **keys):
    known: dict[Hashable, bytes] = {None: KEY}
    known.update(keys)
    keyring = keyring or Keyring(known, timestamp=T, is_private=lambda name: name == LOCAL)
    return VehicleEndpoint(
        commands={ARM}, parameters=table(), validate=lambda _items: None, peers=[LOCAL], keyring=keyring
    )


def open_vehicle():
    return vehicle(Keyring(timestamp=T, is_private=lambda name: name == LOCAL))


def obeys(end, data, now=0.0, peer=LOCAL):
    end.receive_datagram(data, peer, now)
    return any(isinstance(event, SetpointReceived) for event in end.events())


def states(end, data, now=0.0, peer=LOCAL):
    end.receive_datagram(data, peer, now)
    end.handle_timer(now)
    return [event.state for event in end.events() if isinstance(event, SigningChanged)]
