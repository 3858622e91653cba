"""Log client and server over a bad link, and through both endpoints."""

import random

import pytest

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.engines.client.log_client import LogClient
from protocol.engines.server.log_server import LogServer
from protocol.events import LogEraseRequested, LogProgress, LogReceived, LogsListed
from protocol.ranges import LOG_DATA_SIZE
from protocol.wire.message import Peer
from tests.support.links.link import Link, frame
from tests.support.links.log_store import Store
from tests.support.links.lossy_pipe import LossyPipe

GROUND, OTHER, VEHICLE = Peer(255, 190, "ground"), Peer(245, 190, "other"), (1, 1)


LONG = random.Random(3).randbytes(30_000)


FULL = LONG[: 4 * LOG_DATA_SIZE]


def outcome(client):
    return [event for event in client.events() if not isinstance(event, LogProgress)]


def converse(act, *, seed=0, limit=120.0, **losses):
    """Run a client's request over a link; returns its one event and the time of it."""
    server, client = LogServer(1, 1, Store(FULL, LONG, b"", b"x")), LogClient()
    up, down = LossyPipe(seed, **losses), LossyPipe(seed + 1000, **losses)
    now = 0.0
    act(client)
    while client.is_busy and now < limit:
        for engine, pipe in ((client, up), (server, down)):
            for item in engine.messages_to_send():
                pipe.send(getattr(item, "message", item), now)
        now = max(now, min(client.next_deadline(), server.next_deadline(), up.next_arrival(), down.next_arrival()))
        for message in up.receive(now):
            server.receive(message, now, GROUND)
        for message in down.receive(now):
            client.receive(message, now)
        server.handle_timer(now)
        client.handle_timer(now)
    (event,) = outcome(client)
    return event


@pytest.mark.parametrize("seed", range(6))
def test_lists_and_logs_survive_30_percent_loss(seed):
    losses = {"drop": 0.3, "duplicate": 0.1, "reorder": 0.3, "delay": 0.05}
    listed = converse(lambda client: client.request_list(VEHICLE, 0.0), seed=seed, **losses)
    assert [log.size for log in listed.logs] == [360, 30_000, 0, 1]
    for log, expected in zip(listed.logs, (FULL, LONG, b"", b"x"), strict=True):
        received = converse(lambda client, log=log: client.fetch(VEHICLE, log, 0.0), seed=seed, **losses)
        assert received == LogReceived(log, expected)


def test_only_the_station_in_control_may_erase():
    vehicle = VehicleEndpoint(validate=lambda _items: None, logs=Store(LONG))
    vehicle.operator.armed(GROUND, 0.0)
    asked = {}
    for system in (OTHER.system, GROUND.system):
        vehicle.receive_datagram(frame(mavlink.MAVLink_log_erase_message(1, 1), system), system, 0.1)
        asked[system] = any(isinstance(event, LogEraseRequested) for event in vehicle.events())
    assert asked == {OTHER.system: False, GROUND.system: True}


def test_logs_are_downloaded_through_both_endpoints():
    link = Link(drop=0.2)
    link.vehicle.endpoint = link.vehicle.endpoint.__class__(
        validate=lambda _items: None, peers=["ground"], logs=Store(LONG)
    )
    assert link.run(lambda: link.ground.vehicle is not None)
    link.ground.list_logs(link.now)
    (log,) = link.wait_for(LogsListed).logs
    link.ground.fetch_log(log, link.now)
    assert link.wait_for(LogReceived).data == LONG
