"""A mission client and messages of its vehicle."""

import math

from protocol.dialect import mavlink
from protocol.engines.client.mission_client import MissionClient
from protocol.events import MissionProgress
from protocol.wire.codec import Codec
from tests.support.links.link import plan

VEHICLE = (1, 1)


ITEMS = plan(3)


ACCEPTED, ERROR, NO_SPACE, INVALID_SEQUENCE, CANCELLED = 0, 1, 4, 13, 15


def ask(seq, kind=0):
    return mavlink.MAVLink_mission_request_int_message(255, 190, seq, kind)


def ack(result=ACCEPTED, kind=0, opaque_id=0):
    return mavlink.MAVLink_mission_ack_message(255, 190, result, kind, opaque_id)


def count(n, opaque_id=0):
    return mavlink.MAVLink_mission_count_message(255, 190, n, 0, opaque_id)


def item(seq):
    return ITEMS[seq].to_message(seq, 255, 190)


def current(seq):
    return mavlink.MAVLink_mission_current_message(seq)


def uploading():
    client = MissionClient(255, 190)
    client.upload(VEHICLE, ITEMS, 0.0)
    return client


def downloading():
    client = MissionClient(255, 190)
    client.download(VEHICLE, 0.0)
    return client


def feed(client, *messages, now=0.1):
    for message in messages:
        client.receive(message, now)


def numbered(*messages):
    """Messages as frames of a vehicle, with sequence numbers."""
    vehicle, ground = Codec(*VEHICLE), Codec(255, 190)
    return [ground.decode(vehicle.encode(message))[0] for message in messages]


def hear(client, remote, *messages, now=0.1):
    """Hand frames in as an endpoint does."""
    for message in messages:
        remote.hear(message, now)
        client.receive(message, now)


HEARTBEAT = mavlink.MAVLink_heartbeat_message(19, 12, 0, 0, 4, 3)


def sent(client):
    return [(m.get_type(), getattr(m, "seq", None)) for m in client.messages_to_send()]


def ends(client):
    return [event for event in client.events() if not isinstance(event, MissionProgress)]


def exhaust(client):
    """Let time pass without answers until the end; returns the number of repetitions and the end time."""
    client.messages_to_send()
    while (now := client.next_deadline()) < math.inf:
        client.handle_timer(now)
        last = now
    return len([m for m in client.messages_to_send() if m.get_type() != "MISSION_ACK"]), last
