"""Admission of senders as peers of a vehicle, and the peers that make room for others."""

import pytest

from protocol.endpoints.router import MAX_LEARNED_PEERS, PEER_TIMEOUT
from tests.support.links.routing_net import CAMERA, COMPANION, MAVPROXY, QGC, Net


@pytest.fixture
def net():
    return Net(("qgc", QGC), ("mavproxy", MAVPROXY), ("camera", CAMERA), ("companion", COMPANION))


def test_peers_that_are_gone_make_room_first():
    net = Net(*((port, (200 + port, 190)) for port in range(MAX_LEARNED_PEERS) for _ in range(9)))
    net.now += PEER_TIMEOUT + 1.0
    net.say(0, (200, 190))
    for _ in range(3):
        net.say("new", QGC)
        net.say("newer", CAMERA)
    assert {0, "new", "newer"} < set(net.end.statistics)
    assert net.end.statistics["new"].received == 3
    assert len(net.end.statistics) == MAX_LEARNED_PEERS


def test_a_burst_of_frames_does_not_displace_a_steady_peer():
    net = Net()
    for _ in range(5):
        net.now += 1.0
        net.say("qgc", QGC)
    for port in (port for port in range(2 * MAX_LEARNED_PEERS) for _ in range(20)):
        net.say(port, (100, 190))
    assert "qgc" in net.end.statistics
    assert len(net.end.statistics) == MAX_LEARNED_PEERS
