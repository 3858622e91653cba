"""Links of a vehicle to its peers, and the router between them (https://mavlink.io/en/guide/routing.html)."""

from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.generator.mavcrc import x25crc

from protocol.dialect import mavlink
from protocol.endpoints import router
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.endpoints.router import MAX_LEARNED_PEERS, PEER_TIMEOUT, RoutingStatistics, Withheld
from protocol.events import CommandRequested, ParametersComplete, SetpointReceived
from protocol.wire.codec import Codec
from protocol.wire.signing import Signature, sign_frame
from tests.support.links.link import ARM
from tests.support.links.routing_net import (
    ALIVE,
    CAMERA,
    COMPANION,
    ELSEWHERE,
    KEY,
    MAVPROXY,
    OTHER,
    QGC,
    REQUEST,
    Net,
    T,
    long,
)
from tests.support.logs import bare


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


@pytest.mark.parametrize(
    "message",
    [
        mavlink.MAVLink_statustext_message(4, b"lens dirty"),
        mavlink.MAVLink_ping_message(5, 6, 0, 0),
        long((0, 0)),
        ALIVE[CAMERA],
    ],
    ids=lambda message: message.get_type(),
)
def test_a_message_without_a_target_goes_to_every_other_peer(net, message):
    assert net.reaches("camera", CAMERA, message) == ["companion", "mavproxy", "qgc"]


@pytest.mark.parametrize(
    ("target", "ports"),
    [
        (CAMERA, ["camera"]),
        (MAVPROXY, ["mavproxy"]),
        ((255, 0), ["mavproxy"]),
        ((1, 0), ["camera", "companion"]),
        ((1, 1), []),
        ((1, 77), []),
        ((255, 77), ["mavproxy"]),
        (ELSEWHERE, []),
        ((7, 0), []),
    ],
)
def test_a_message_for_a_component_goes_where_it_was_heard(net, target, ports):
    assert net.reaches("qgc", QGC, long(target)) == ports


def test_a_message_for_a_component_of_the_own_system_that_was_not_heard_goes_nowhere():
    net = Net(("qgc", QGC), ("camera", (7, 100)), system=7)
    assert net.reaches("qgc", QGC, long((7, 100))) == ["camera"]
    assert net.reaches("qgc", QGC, long((7, 77))) == []


def test_a_command_for_another_component_is_neither_executed_nor_answered(net):
    for target in (CAMERA, (1, 77)):
        net.end.receive_datagram(net.frame(QGC, long(target, ARM, 1.0)), "qgc", net.now)
        assert not [event for event in net.end.events() if isinstance(event, CommandRequested)]
        assert all(key == "camera" for key, _ in net.end.datagrams_to_send())


def test_a_command_for_the_whole_system_is_executed_and_forwarded(net):
    net.end.receive_datagram(net.frame(QGC, long((1, 0), ARM, 1.0)), "qgc", net.now)
    assert [type(event) for event in net.end.events()] == [CommandRequested]
    assert sorted(key for key, _ in net.end.datagrams_to_send()) == ["camera", "companion"]


def test_manual_control_goes_to_its_target_system(net):
    net.say("rover", ELSEWHERE, ALIVE[CAMERA])
    assert net.reaches("qgc", QGC, mavlink.MAVLink_manual_control_message(7, 0, 0, 0, 0, 0)) == ["rover"]
    assert net.reaches("qgc", QGC, mavlink.MAVLink_manual_control_message(1, 0, 0, 0, 0, 0)) == ["camera", "companion"]


def test_operator_control_does_not_restrict_messages_for_other_components(net):
    net.say("qgc", QGC, long((1, 1), 32100, 0, 1))  # QGC takes control of the vehicle
    assert net.end.operator.holder[:2] == QGC
    other = (245, 190)
    assert net.reaches("api", other, long(CAMERA, mavlink.MAV_CMD_IMAGE_START_CAPTURE)) == []  # not a peer yet
    net.say("api", other, ALIVE[QGC])
    assert net.reaches("api", other, long(CAMERA, mavlink.MAV_CMD_IMAGE_START_CAPTURE)) == ["camera"]
    assert net.answers == []


def test_frames_from_a_port_that_is_not_a_peer_are_not_forwarded(net):
    assert net.reaches("stranger", (245, 190), long(CAMERA)) == []
    assert net.withheld == {Withheld.STRANGER: 1}


def test_two_ground_stations_read_parameters_of_one_vehicle(net):
    stations, events = {"one": GroundEndpoint(system=253), "two": GroundEndpoint(system=254)}, []
    for step in range(50):
        net.now += 0.1
        net.end.announce(mavlink.MAVLink_heartbeat_message(19, 12, 0, 0, 4, 3), net.now)
        net.end.handle_timer(net.now)
        net.end.receive_datagram(net.frame(CAMERA, ALIVE[CAMERA]), "camera", net.now)
        for port, station in stations.items():
            station.handle_timer(net.now)
            if step == 20:
                station.request_parameters(net.now)
            for data in station.datagrams_to_send():
                net.end.receive_datagram(data, port, net.now)
        for port, data in net.end.datagrams_to_send():
            if port in stations:
                stations[port].receive_datagram(data, net.now)
                events += stations[port].events()
    for station, other in zip(stations.values(), (254, 253), strict=True):
        sources = station.codec.statistics.sources
        assert station.vehicle == (1, 1)
        assert set(sources) >= {(1, 1), CAMERA, (other, 190)}
        assert sources[1, 1].lost == 0
    assert sum(isinstance(event, ParametersComplete) for event in events) == 2


def test_configured_peers_get_broadcasts_before_they_send():
    net = Net(("camera", CAMERA), peers=["given"])
    assert net.reaches("camera", CAMERA, ALIVE[CAMERA]) == ["given"]
    assert net.reaches("camera", CAMERA, long(QGC)) == []


def test_without_a_list_of_peers_nothing_is_forwarded():
    net = Net(("a", QGC), ("b", CAMERA), peers=None)
    assert net.say("b", CAMERA) == net.say("a", QGC, long(CAMERA)) == []
    assert net.end.routing == RoutingStatistics()


def versions(message):
    plain = Codec(*CAMERA).encode(message)
    return {
        "version 1": bare(message, version=1, system=CAMERA[0], component=CAMERA[1]),
        "version 2": plain,
        "with a signature nobody here can check": sign_frame(plain, OTHER, Signature(3, T)),
        "not trimmed": untrimmed(message),
    }


def untrimmed(message):
    known = mavlink.mavlink_map[message.get_msgId()]
    plain = Codec(*CAMERA).encode(message)
    payload = plain[10:-2].ljust(known.unpacker.size, b"\0")
    head = bytes([0xFD, len(payload)]) + plain[2:10]
    crc = x25crc(head[1:] + payload + bytes([known.crc_extra])).crc
    return head + payload + crc.to_bytes(2, "little")


@pytest.mark.parametrize("way", ["version 1", "version 2", "with a signature nobody here can check", "not trimmed"])
def test_frames_are_forwarded_byte_for_byte(net, way):
    data = versions(mavlink.MAVLink_statustext_message(4, b"lens"))[way]
    assert sorted(net.deliver("camera", data)) == [("companion", data), ("mavproxy", data), ("qgc", data)]


def test_each_frame_of_a_datagram_is_routed_by_itself(net):
    one, two = net.frame(CAMERA, long(QGC)), net.frame(CAMERA, long(MAVPROXY))
    assert net.deliver("camera", one + b"garbage" + two) == [("qgc", one), ("mavproxy", two)]


def test_damaged_frames_and_unknown_messages_are_not_forwarded(net):
    frame = net.frame(CAMERA, long(QGC))
    unknown = frame[:7] + b"\x2f\xea\x00" + frame[10:]
    assert net.deliver("camera", frame[:-1] + bytes([frame[-1] ^ 1])) == []
    assert net.deliver("camera", unknown) == []
    assert net.end.statistics["camera"].unknown_id == 1


@pytest.mark.parametrize("target", [(0, 0), (1, 0), QGC])
def test_keys_are_never_forwarded(net, target):
    before = net.end.routing.forwarded
    assert net.reaches("camera", CAMERA, mavlink.MAVLink_setup_signing_message(*target, list(KEY), T)) == []
    assert net.reaches("camera", CAMERA, mavlink.MAVLink_change_operator_control_message(*target[:1], 0, 0, b"x")) == []
    assert net.reaches("camera", CAMERA, mavlink.MAVLink_auth_key_message(b"key")) == []
    assert net.reaches("camera", CAMERA, mavlink.MAVLink_wifi_config_ap_message(b"net", b"password")) == []
    assert net.withheld[Withheld.SECRET] == 4
    assert net.end.routing.forwarded == before


def test_every_message_with_a_secret_is_listed():
    words = {"key", "secret_key", "passkey", "password", "pin", "new_pin", "puk"}
    named = {number for number, known in mavlink.mavlink_map.items() if words & set(known.fieldnames)}
    assert named == router.SECRET_MESSAGES


def test_messages_for_the_vehicle_alone_are_not_counted_as_withheld(net):
    assert net.reaches("qgc", QGC, mavlink.MAVLink_setup_signing_message(1, 1, list(KEY), T)) == []
    assert net.reaches("qgc", QGC, long((1, 1), ARM, 1.0)) == []
    assert net.withheld == {}


def test_radio_status_is_not_forwarded(net):
    assert net.reaches("companion", (51, 68), mavlink.MAVLink_radio_status_message(1, 2, 3, 4, 5, 6, 7)) == []
    assert net.withheld[Withheld.LINK_LOCAL] == 1


def test_frames_with_the_vehicles_own_ids_are_not_forwarded_and_make_no_peer(net):
    for port, message in (("liar", ALIVE[QGC]), ("camera", long(QGC)), ("camera", long((1, 1), ARM, 1.0))):
        net.end.receive_datagram(net.frame((1, 1), message), port, net.now)
        assert net.end.datagrams_to_send() == net.end.events() == []
    assert "liar" not in net.end.statistics


def test_frames_from_system_0_are_not_forwarded(net):
    assert net.reaches("camera", (0, 100), ALIVE[CAMERA]) == []
    assert net.withheld[Withheld.NO_SENDER] == 1


def test_component_0_of_another_system_is_routed_like_pymavlinks_default(net):
    script = (254, 0)
    net.say("script", script, ALIVE[QGC])
    assert net.reaches("script", script, long(CAMERA)) == ["camera"]
    assert net.reaches("camera", CAMERA, mavlink.MAVLink_command_ack_message(REQUEST, 0, 0, 0, *script)) == ["script"]


def test_a_frame_that_arrives_by_two_links_is_forwarded_once(net):
    net.say("second", COMPANION)
    data = net.frame(COMPANION, long(CAMERA))
    assert net.deliver("companion", data) == [("camera", data)]
    assert net.deliver("second", data) == []
    assert net.deliver("companion", data) == []
    assert net.withheld == {Withheld.REPEATED: 2}
    net.now += router.DUPLICATE_WINDOW + 0.1
    assert net.deliver("companion", data) == [("camera", data)]


def test_two_ports_of_one_station_do_not_get_each_others_frames(net):
    net.say("qgc too", QGC)
    assert net.reaches("qgc", QGC, ALIVE[QGC]) == ["camera", "companion", "mavproxy"]
    assert net.reaches("camera", CAMERA, long(QGC)) == ["qgc", "qgc too"]


def test_a_routing_loop_of_two_vehicles_ends():
    """Two vehicles with routers, connected by two links: a broadcast must not circulate."""
    here, there = Net(("qgc", QGC)), Net(("mavproxy", MAVPROXY), system=2)
    for net, ids in ((here, (2, 1)), (there, (1, 1))):
        for wire in ("wire a", "wire b"):
            net.say(wire, ids, ALIVE[CAMERA])
    flying, hops, heard = [(here, "qgc", here.frame(QGC, ALIVE[QGC]))], 0, Counter()
    while flying:
        net, port, data = flying.pop()
        net.end.receive_datagram(data, port, net.now)
        for key, copy in net.end.datagrams_to_send():
            heard[key] += 1
            if key.startswith("wire"):
                flying.append((there if net is here else here, key, copy))
        hops += 1
        assert hops < 20
    assert heard["mavproxy"] == 1
    assert heard["qgc"] == 0


PORTS = ("a", "b", "c", "d")


SENDERS = (QGC, MAVPROXY, CAMERA, COMPANION, (1, 1), (0, 0), (255, 0))


TARGETS = ((0, 0), (1, 0), (1, 1), CAMERA, COMPANION, QGC, (255, 0), (255, 77), ELSEWHERE)


@pytest.mark.long
@settings(max_examples=150, deadline=None)
@given(
    st.lists(
        st.tuples(st.sampled_from(PORTS), st.sampled_from(SENDERS), st.sampled_from(TARGETS), st.integers(0, 5)),
        max_size=40,
    )
)
def test_no_frame_returns_to_its_sender_or_reaches_a_peer_twice(said):
    """Any frames from any ports, some of them again from another port, as in a routing loop.

    The vehicle does not remember frames from ports that are not its peers.
    """
    net, frames, came, went = Net(peers=["a", "b"]), [], {}, Counter()
    for port, ids, target, again in said:
        data = frames[-again] if 0 < again <= len(frames) else net.frame(ids, long(target))
        frames.append(data)
        copies = net.deliver(port, data)
        if port in net.end.statistics:
            came.setdefault(data, set()).add(port)
        for key, copy in copies:
            went[key, copy] += 1
            assert copy == data
            assert key not in came[data]
    assert set(went.values()) <= {1}


def test_set_points_for_the_vehicle_are_not_forwarded(net):
    message = mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 2552, *[1.0] * 11)
    net.end.receive_datagram(net.frame(COMPANION, message), "companion", net.now)
    assert [type(event) for event in net.end.events()] == [SetpointReceived]
    assert net.end.datagrams_to_send() == []
