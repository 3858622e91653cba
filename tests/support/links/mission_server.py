"""A mission server and messages of its ground stations."""

from protocol.dialect import mavlink
from protocol.engines.server.mission_server import MissionServer
from protocol.wire.codec import Codec
from protocol.wire.message import Peer
from tests.support.links.link import plan

GROUND, OTHER = Peer(255, 190, "ground"), Peer(245, 190, "other")


OLD = plan(2, offset=500)


def count(n, kind=0):
    return mavlink.MAVLink_mission_count_message(1, 1, n, kind)


def item(seq, items=None):
    return (items or plan(20))[seq].to_message(seq, 1, 1)


def server(items=OLD, refusal=None):
    return MissionServer(1, 1, items, validate=lambda _items: refusal)


def received(engine, peer=GROUND):
    """The messages sent, in short: ("REQUEST", seq), ("ACK", result), ("COUNT", n), ("ITEM", seq)."""
    short = []
    for out in engine.messages_to_send():
        message = out.message
        assert out.peer == peer
        assert (message.target_system, message.target_component) == peer[:2]
        kind = message.get_type()
        field = {
            "MISSION_REQUEST_INT": "seq",
            "MISSION_ACK": "type",
            "MISSION_COUNT": "count",
            "MISSION_ITEM_INT": "seq",
        }
        short.append((kind.removeprefix("MISSION_").removesuffix("_INT"), getattr(message, field[kind])))
    return short


def numbered(*messages, sender=GROUND):
    """Messages as frames of one sender, with sequence numbers."""
    ground, vehicle = Codec(*sender[:2]), Codec(1, 1)
    return [vehicle.decode(ground.encode(message))[0] for message in messages]


def feed(engine, *messages, peer=GROUND, now=0.0):
    for message in messages:
        engine.receive(message, now, peer)
