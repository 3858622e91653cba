"""A vehicle's endpoint, and answers as they reach a ground station."""

import math

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.wire.codec import Codec
from tests.support.links.link import ARM, frame, table

ATTITUDE, HOME, VERSION = 30, 242, 148


def endpoint(**options):
    return VehicleEndpoint(
        commands={ARM},
        parameters=table(),
        validate=lambda _items: None,
        streams={ATTITUDE: 20_000, HOME: 1_000_000},
        on_request={VERSION},
        **options,
    )


def long(command, *params, target=(1, 1)):
    system, component = target
    values = [*params, *[math.nan] * (7 - len(params))]
    return mavlink.MAVLink_command_long_message(system, component, command, 0, *values)


def ask(vehicle, message, key="ground", ids=(255, 190)):
    """Hand one message in; returns the answers as (key, message)."""
    vehicle.receive_datagram(frame(message, *ids), key, 0.0)
    return heard(vehicle)


def heard(vehicle):
    return [(key, Codec(255, 190).decode(data)[0]) for key, data in vehicle.datagrams_to_send()]


def names(answers):
    return [message.get_type() for _, message in answers]
