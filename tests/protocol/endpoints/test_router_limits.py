"""A flood does not fill the router's tables and takes nothing from other peers."""

import pytest

from protocol.dialect import mavlink
from protocol.endpoints import router
from protocol.endpoints.router import Withheld
from tests.support.links.routing_net import ALIVE, CAMERA, COMPANION, MAVPROXY, QGC, REQUEST, Net, long


@pytest.fixture
def net():
    return Net(("qgc", QGC), ("mavproxy", MAVPROXY), ("camera", CAMERA), ("companion", COMPANION))


def test_a_silent_component_is_forgotten(net):
    net.now += router.ROUTE_LIFETIME + 2.0
    net.say("qgc", QGC)
    assert net.reaches("qgc", QGC, long(CAMERA)) == []
    assert net.withheld[Withheld.NOBODY_THERE] == 1


def test_a_flood_from_many_ids_displaces_no_active_source(net):
    for _ in range(5):
        net.say("camera", CAMERA)
    for number in range(2000):
        net.say("camera", (2 + number % 200, 1 + number // 200), ALIVE[CAMERA])
    assert all(len(n.sources) <= router.MAX_SOURCES_PER_PEER for n in net.end._router._neighbours.values())
    net.now += 1.0
    assert net.reaches("qgc", QGC, long(CAMERA)) == ["camera"]


def test_a_flood_from_many_ports_leaves_the_tables_small(net):
    for port in ("qgc", "camera"):
        net.say(port, {"qgc": QGC, "camera": CAMERA}[port])
    for number in range(2000):
        net.now += 0.001
        net.say(number, (9, 1 + number % 200), ALIVE[CAMERA])
    assert len(net.end._router._neighbours) <= 17
    assert len(net.end._router._recent) <= router.MAX_REMEMBERED_FRAMES
    assert net.reaches("qgc", QGC, long(CAMERA)) == ["camera"]


def test_the_forwarding_rate_of_a_peer_is_limited(net):
    before = net.end.routing
    for number in range(3000):
        net.now += 0.001
        net.say("camera", CAMERA, mavlink.MAVLink_named_value_int_message(number, b"n", number))
    copies, frames = (after - start for after, start in zip(net.end.routing[1::-1], before[1::-1], strict=True))
    most = 3.0 * (router.COPIES_PER_SECOND + router.RESERVE_PER_SECOND) + router.RESERVE_PER_SECOND
    assert 3.0 * router.COPIES_PER_SECOND - router.MAX_COPIES_BURST <= copies <= most + 1
    assert net.withheld == {Withheld.TOO_MANY: 3000 - frames}


def test_the_copies_of_one_datagram_are_limited(net):
    net.now += 10.0
    frames = (net.frame(CAMERA, mavlink.MAVLink_named_value_int_message(n, b"n", n)) for n in range(2000))
    copies = net.deliver("camera", b"".join(frames))
    assert len(copies) >= router.MAX_COPIES_BURST
    assert len(copies) <= router.MAX_COPIES_BURST + router.RESERVE_PER_SECOND


def test_remembered_frames_are_limited():
    net = Net(("camera", CAMERA), *((port, (200 + port, 190)) for port in range(8)))
    net.now += 1.0
    for port in range(8):
        net.deliver(port, b"".join(net.frame((200 + port, 190), long(CAMERA, REQUEST, n)) for n in range(200)))
    assert net.end.routing.forwarded > 1600
    assert len(net.end._router._recent) == router.MAX_REMEMBERED_FRAMES


def test_changing_ports_share_the_reserve():
    net = Net(peers=["a", "b", "c"])
    copies = sum(len(net.say(number, (9, 1 + number % 250), ALIVE[CAMERA])) for number in range(2000))
    assert copies <= router.RESERVE_PER_SECOND


def test_a_flood_does_not_reduce_the_rate_of_an_established_peer():
    net = Net(("qgc", QGC), ("camera", CAMERA))
    for number in range(1000):
        net.now += 0.001
        net.say("flood", (9, 1), ALIVE[CAMERA])
        if number % 100 == 99:
            assert net.reaches("camera", CAMERA, long(QGC)) == ["qgc"]
