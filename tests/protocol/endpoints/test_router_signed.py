"""Forwarding on signed links."""

import pytest

from protocol.endpoints.router import Links
from protocol.wire.codec import Codec
from protocol.wire.signing import Keyring, verify
from tests.support.links.routing_net import ALIVE, CAMERA, COMPANION, KEY, MAVPROXY, OTHER, QGC, Net, T, long


@pytest.fixture
def net():
    return Net(("qgc", QGC), ("mavproxy", MAVPROXY), ("camera", CAMERA), ("companion", COMPANION))


def signed_net(**keys):
    net = Net(keyring=Keyring({None: KEY} | keys, timestamp=T))
    for port, ids in (("qgc", QGC), ("camera", CAMERA)):
        net.deliver(port, net.signed(ids, ALIVE[ids], keys.get(port, KEY)))
    assert set(net.end.statistics) == {"qgc", "camera"}
    return net


def test_correctly_signed_frames_are_forwarded_with_their_own_signature():
    net = signed_net()
    data = net.signed(QGC, long(CAMERA))
    assert net.deliver("qgc", data) == [("camera", data)]


@pytest.mark.parametrize("how", ["unsigned", "wrong key", "replayed", "looked at"])
def test_with_a_key_other_frames_are_not_forwarded_and_never_signed(how):
    net = signed_net()
    old = net.signed(QGC, long(CAMERA))
    net.deliver("qgc", old)
    data = {
        "unsigned": net.frame(QGC, long(CAMERA)),
        "wrong key": net.signed(QGC, long(CAMERA), OTHER),
        "replayed": old,
        "looked at": net.frame(QGC, ALIVE[QGC]),
    }[how]
    net.end.receive_datagram(data, "qgc", net.now)
    net.end.receive_datagram(data, "stranger", net.now)
    assert net.end.datagrams_to_send() == []
    net.end.status_text(6, "x")
    for _, sent in net.end.datagrams_to_send():
        assert verify(sent, KEY)
        assert Codec(9, 9).decode(sent)[0].get_type() == "STATUSTEXT"


def test_frames_signed_with_one_links_key_do_not_reach_a_link_with_another():
    net = signed_net(camera=OTHER)
    assert net.deliver("qgc", net.signed(QGC, long(CAMERA))) == []
    assert net.deliver("camera", net.signed(CAMERA, ALIVE[CAMERA], OTHER)) == []


def test_a_peer_does_not_read_itself():
    links = Links(1, 1, ["a", "b", "c"], Keyring({"a": KEY, "b": KEY, "c": OTHER}))
    assert (links.readers("a"), links.readers("c")) == (["b"], [])


def test_a_link_without_a_key_gets_signed_frames():
    net = Net(peers=["listener"], keyring=Keyring({"camera": KEY}, timestamp=T))
    data = net.signed(CAMERA, ALIVE[CAMERA])
    assert net.deliver("camera", data) == [("listener", data)]
    assert net.deliver("listener", net.frame(QGC, long(CAMERA))) == []
