"""A vehicle between its peers: what goes on to whom, what does not, and that nothing comes back or comes twice."""

from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common

from protocol import router
from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.endpoint import GroundEndpoint, VehicleEndpoint
from protocol.events import CommandRequested, ParametersComplete, SetpointReceived
from protocol.keyring import Keyring
from protocol.links import DEPARTED, MOST_LEARNT, Links
from protocol.router import RoutingStatistics, Withheld
from protocol.signing import Signature, sign_frame, verify
from tests.support.link import ARM, table

KEY, OTHER = bytes(range(32)), bytes(range(1, 33))
T = 36_000_000_000_000  # some day in 2026 [10 us since 2015]
QGC, MAVPROXY, CAMERA, COMPANION, ELSEWHERE = (255, 190), (255, 230), (1, 100), (1, 191), (7, 3)
ALIVE = {
    QGC: mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, 8, 0, 0, 4, 3),
    MAVPROXY: mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, 8, 0, 0, 4, 3),
    CAMERA: mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_CAMERA, 8, 0, 0, 4, 3),
    COMPANION: mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_ONBOARD_CONTROLLER, 8, 0, 0, 4, 3),
}
REQUEST = mavlink.MAV_CMD_REQUEST_MESSAGE


def long(target, command=REQUEST, *params):
    values = [*params, *[0.0] * (7 - len(params))]
    return mavlink.MAVLink_command_long_message(*target, command, 0, *values)


class Net:
    """A vehicle and whoever speaks to it, each at a port of its own name."""

    def __init__(self, *ports, system=1, **options):
        self.now, self.timestamp = 10.0, T
        self.end = VehicleEndpoint(
            system=system, commands={ARM}, parameters=table(), validate=lambda _items: None, **{"peers": ()} | options
        )
        self.codecs = {}
        for port, ids in ports:
            self.say(port, ids)

    def frame(self, ids, message):
        return self.codecs.setdefault(ids, Codec(*ids)).encode(message)

    def signed(self, ids, message, key=KEY):
        self.timestamp += 1
        return sign_frame(self.frame(ids, message), key, Signature(0, self.timestamp))

    def say(self, port, ids, message=None):
        """Send one message as ``ids``; what the vehicle sends on, as (port, bytes)."""
        return self.deliver(port, self.frame(ids, message or ALIVE.get(ids, ALIVE[QGC])))

    def deliver(self, port, data):
        self.end.receive_datagram(data, port, self.now)
        self.answers, copies = [], []
        for key, sent in self.end.datagrams_to_send():
            own = Codec(9, 9).decode(sent)
            is_own = own and (own[0].get_srcSystem(), own[0].get_srcComponent()) == (1, 1)
            (self.answers if is_own else copies).append((key, sent))
        self.end.events()
        return copies

    def reaches(self, port, ids, message):
        """The ports one message goes on to."""
        return sorted(key for key, _ in self.say(port, ids, message))

    @property
    def withheld(self):
        return dict(self.end.routing.withheld)


@pytest.fixture
def net():
    return Net(("qgc", QGC), ("mavproxy", MAVPROXY), ("camera", CAMERA), ("companion", COMPANION))


# Who gets what


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
def test_what_is_for_nobody_in_particular_goes_to_every_other_peer(net, message):
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
def test_what_is_for_someone_goes_where_that_one_was_heard(net, target, ports):
    assert net.reaches("qgc", QGC, long(target)) == ports


def test_a_command_for_another_component_is_neither_obeyed_nor_answered(net):
    for target in (CAMERA, (1, 77)):
        net.end.receive_datagram(net.frame(QGC, long(target, ARM, 1.0)), "qgc", net.now)
        assert not [event for event in net.end.events() if isinstance(event, CommandRequested)]
        assert all(key == "camera" for key, _ in net.end.datagrams_to_send())


def test_a_command_for_the_whole_system_is_obeyed_and_goes_on(net):
    net.end.receive_datagram(net.frame(QGC, long((1, 0), ARM, 1.0)), "qgc", net.now)
    assert [type(event) for event in net.end.events()] == [CommandRequested]
    assert sorted(key for key, _ in net.end.datagrams_to_send()) == ["camera", "companion"]


def test_sticks_go_to_the_system_that_their_target_names(net):
    net.say("rover", ELSEWHERE, ALIVE[CAMERA])
    assert net.reaches("qgc", QGC, mavlink.MAVLink_manual_control_message(7, 0, 0, 0, 0, 0)) == ["rover"]
    assert net.reaches("qgc", QGC, mavlink.MAVLink_manual_control_message(1, 0, 0, 0, 0, 0)) == ["camera", "companion"]


def test_who_steers_is_not_judged_for_other_components(net):
    net.say("qgc", QGC, long((1, 1), 32100, 0, 1))  # QGC takes control of the vehicle
    assert net.end.operator.holder[:2] == QGC
    other = (245, 190)
    assert net.reaches("api", other, long(CAMERA, mavlink.MAV_CMD_IMAGE_START_CAPTURE)) == []  # not a peer yet
    net.say("api", other, ALIVE[QGC])
    assert net.reaches("api", other, long(CAMERA, mavlink.MAV_CMD_IMAGE_START_CAPTURE)) == ["camera"]
    assert net.answers == []


def test_a_port_that_said_nothing_to_the_vehicle_is_not_served(net):
    assert net.reaches("stranger", (245, 190), long(CAMERA)) == []
    assert net.withheld == {Withheld.STRANGER: 1}


def test_two_ground_stations_read_one_vehicle_and_take_nobody_else_for_it(net):
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


def test_ports_that_were_given_hear_broadcasts_before_they_speak():
    net = Net(("camera", CAMERA), peers=["given"])
    assert net.reaches("camera", CAMERA, ALIVE[CAMERA]) == ["given"]
    assert net.reaches("camera", CAMERA, long(QGC)) == []


def test_without_names_for_peers_nothing_goes_on():
    net = Net(("a", QGC), ("b", CAMERA), peers=None)
    assert net.say("b", CAMERA) == net.say("a", QGC, long(CAMERA)) == []
    assert net.end.routing == RoutingStatistics()


# Bytes


def versions(message):
    first = mavlink.MAVLink(None, *CAMERA)
    plain = Codec(*CAMERA).encode(message)
    return {
        "version 1": message.pack(first, force_mavlink1=True),
        "version 2": plain,
        "with a signature nobody here can check": sign_frame(plain, OTHER, Signature(3, T)),
        "not trimmed": untrimmed(message),
    }


def untrimmed(message):
    known = mavlink.mavlink_map[message.get_msgId()]
    plain = Codec(*CAMERA).encode(message)
    payload = plain[10:-2].ljust(known.unpacker.size, b"\0")
    head = bytes([0xFD, len(payload)]) + plain[2:10]
    crc = mavlink.x25crc(head[1:] + payload + bytes([known.crc_extra])).crc
    return head + payload + crc.to_bytes(2, "little")


@pytest.mark.parametrize("way", ["version 1", "version 2", "with a signature nobody here can check", "not trimmed"])
def test_bytes_go_on_exactly_as_they_came(net, way):
    data = versions(mavlink.MAVLink_statustext_message(4, b"lens"))[way]
    assert sorted(net.deliver("camera", data)) == [("companion", data), ("mavproxy", data), ("qgc", data)]


def test_each_frame_of_a_datagram_goes_its_own_way(net):
    one, two = net.frame(CAMERA, long(QGC)), net.frame(CAMERA, long(MAVPROXY))
    assert net.deliver("camera", one + b"garbage" + two) == [("qgc", one), ("mavproxy", two)]


def test_what_fails_its_checksum_or_is_of_no_known_message_stays_here(net):
    frame = net.frame(CAMERA, long(QGC))
    unknown = frame[:7] + b"\x2f\xea\x00" + frame[10:]
    assert net.deliver("camera", frame[:-1] + bytes([frame[-1] ^ 1])) == []
    assert net.deliver("camera", unknown) == []
    assert net.end.statistics["camera"].unknown_id == 1


# What stays here


@pytest.mark.parametrize("target", [(0, 0), (1, 0), QGC])
def test_keys_are_never_sent_on(net, target):
    before = net.end.routing.forwarded
    assert net.reaches("camera", CAMERA, mavlink.MAVLink_setup_signing_message(*target, list(KEY), T)) == []
    assert net.reaches("camera", CAMERA, mavlink.MAVLink_change_operator_control_message(*target[:1], 0, 0, b"x")) == []
    assert net.reaches("camera", CAMERA, mavlink.MAVLink_auth_key_message(b"key")) == []
    assert net.reaches("camera", CAMERA, mavlink.MAVLink_wifi_config_ap_message(b"net", b"password")) == []
    assert net.withheld[Withheld.SECRET] == 4
    assert net.end.routing.forwarded == before


def test_every_message_with_a_secret_in_it_is_known_as_one():
    words = {"key", "secret_key", "passkey", "password", "pin", "new_pin", "puk"}
    named = {number for number, known in mavlink.mavlink_map.items() if words & set(known.fieldnames)}
    assert named == router.SECRET


def test_what_is_for_the_vehicle_alone_is_not_counted_as_withheld(net):
    assert net.reaches("qgc", QGC, mavlink.MAVLink_setup_signing_message(1, 1, list(KEY), T)) == []
    assert net.reaches("qgc", QGC, long((1, 1), ARM, 1.0)) == []
    assert net.withheld == {}


def test_what_a_radio_says_of_its_link_stays_on_it(net):
    assert net.reaches("companion", (51, 68), mavlink.MAVLink_radio_status_message(1, 2, 3, 4, 5, 6, 7)) == []
    assert net.withheld[Withheld.LINK_LOCAL] == 1


def test_frames_in_the_vehicles_own_name_go_nowhere_and_make_no_peer(net):
    for port, message in (("liar", ALIVE[QGC]), ("camera", long(QGC)), ("camera", long((1, 1), ARM, 1.0))):
        net.end.receive_datagram(net.frame((1, 1), message), port, net.now)
        assert net.end.datagrams_to_send() == net.end.events() == []
    assert "liar" not in net.end.statistics


def test_system_0_is_nobody(net):
    assert net.reaches("camera", (0, 100), ALIVE[CAMERA]) == []
    assert net.withheld[Withheld.NO_SENDER] == 1


def test_component_0_of_another_system_is_a_script_with_pymavlinks_default(net):
    script = (254, 0)
    net.say("script", script, ALIVE[QGC])
    assert net.reaches("script", script, long(CAMERA)) == ["camera"]
    assert net.reaches("camera", CAMERA, mavlink.MAVLink_command_ack_message(REQUEST, 0, 0, 0, *script)) == ["script"]


# Loops


def test_a_frame_that_comes_by_two_links_goes_on_once(net):
    net.say("second", COMPANION)
    data = net.frame(COMPANION, long(CAMERA))
    assert net.deliver("companion", data) == [("camera", data)]
    assert net.deliver("second", data) == []
    assert net.deliver("companion", data) == []
    assert net.withheld == {Withheld.REPEATED: 2}
    net.now += router.REPEATED + 0.1
    assert net.deliver("companion", data) == [("camera", data)]


def test_two_ports_of_one_station_hear_nothing_of_each_other(net):
    net.say("qgc too", QGC)
    assert net.reaches("qgc", QGC, ALIVE[QGC]) == ["camera", "companion", "mavproxy"]
    assert net.reaches("camera", CAMERA, long(QGC)) == ["qgc", "qgc too"]


def test_a_ring_of_two_vehicles_ends():
    """Two vehicles with routers, joined by two wires: a broadcast must not go round and round."""
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


# Bounds


def test_a_silent_component_is_forgotten(net):
    net.now += router.FORGOTTEN + 2.0
    net.say("qgc", QGC)
    assert net.reaches("qgc", QGC, long(CAMERA)) == []
    assert net.withheld[Withheld.NOBODY_THERE] == 1


def test_clients_that_departed_make_room_however_much_they_said():
    net = Net(*((port, (200 + port, 190)) for port in range(MOST_LEARNT) for _ in range(9)))
    net.now += DEPARTED + 1.0
    net.say(0, (200, 190))
    for _ in range(3):
        net.say("new", QGC)
        net.say("newer", CAMERA)
    assert {0, "new", "newer"} < set(net.end.statistics)
    assert net.end.statistics["new"].received == 3
    assert len(net.end.statistics) == MOST_LEARNT


def test_ports_that_shout_drive_out_nobody_who_speaks_steadily():
    net = Net()
    for _ in range(5):
        net.now += 1.0
        net.say("qgc", QGC)
    for port in (port for port in range(2 * MOST_LEARNT) for _ in range(20)):
        net.say(port, (100, 190))
    assert "qgc" in net.end.statistics
    assert len(net.end.statistics) == MOST_LEARNT


def test_a_flood_in_many_names_drives_out_nobody_who_speaks(net):
    for _ in range(5):
        net.say("camera", CAMERA)
    for number in range(2000):
        net.say("camera", (2 + number % 200, 1 + number // 200), ALIVE[CAMERA])
    assert all(len(n.sources) <= router.MOST_SOURCES for n in net.end._router._neighbours.values())
    net.now += 1.0
    assert net.reaches("qgc", QGC, long(CAMERA)) == ["camera"]


def test_a_flood_from_many_ports_leaves_the_tables_small(net):
    for port in ("qgc", "camera"):
        net.say(port, {"qgc": QGC, "camera": CAMERA}[port])
    for number in range(2000):
        net.now += 0.001
        net.say(number, (9, 1 + number % 200), ALIVE[CAMERA])
    assert len(net.end._router._neighbours) <= 17
    assert len(net.end._router._recent) <= router.MOST_RECENT
    assert net.reaches("qgc", QGC, long(CAMERA)) == ["camera"]


def test_a_peer_sends_on_no_more_than_its_budget(net):
    before = net.end.routing
    for number in range(3000):
        net.now += 0.001
        net.say("camera", CAMERA, mavlink.MAVLink_named_value_int_message(number, b"n", number))
    copies, frames = (after - start for after, start in zip(net.end.routing[1::-1], before[1::-1], strict=True))
    most = 3.0 * (router.COPIES_PER_SECOND + router.RESERVE_PER_SECOND) + router.RESERVE_PER_SECOND
    assert 3.0 * router.COPIES_PER_SECOND - router.MOST_AT_ONCE <= copies <= most + 1
    assert net.withheld == {Withheld.TOO_MANY: 3000 - frames}


def test_one_datagram_full_of_frames_multiplies_no_further_than_its_budget(net):
    net.now += 10.0
    frames = (net.frame(CAMERA, mavlink.MAVLink_named_value_int_message(n, b"n", n)) for n in range(2000))
    copies = net.deliver("camera", b"".join(frames))
    assert len(copies) >= router.MOST_AT_ONCE
    assert len(copies) <= router.MOST_AT_ONCE + router.RESERVE_PER_SECOND


def test_frames_remembered_are_of_a_bounded_number():
    net = Net(("camera", CAMERA), *((port, (200 + port, 190)) for port in range(8)))
    net.now += 1.0
    for port in range(8):
        net.deliver(port, b"".join(net.frame((200 + port, 190), long(CAMERA, REQUEST, n)) for n in range(200)))
    assert net.end.routing.forwarded > 1600
    assert len(net.end._router._recent) == router.MOST_RECENT


def test_ports_that_change_with_every_frame_share_one_small_budget():
    net = Net(peers=["a", "b", "c"])
    copies = sum(len(net.say(number, (9, 1 + number % 250), ALIVE[CAMERA])) for number in range(2000))
    assert copies <= router.RESERVE_PER_SECOND


def test_a_flood_takes_nothing_from_a_peer_that_was_there():
    net = Net(("qgc", QGC), ("camera", CAMERA))
    for number in range(1000):
        net.now += 0.001
        net.say("flood", (9, 1), ALIVE[CAMERA])
        if number % 100 == 99:
            assert net.reaches("camera", CAMERA, long(QGC)) == ["qgc"]


# Signed links


def signed_net(**keys):
    net = Net(keyring=Keyring({None: KEY} | keys, timestamp=T))
    for port, ids in (("qgc", QGC), ("camera", CAMERA)):
        net.deliver(port, net.signed(ids, ALIVE[ids], keys.get(port, KEY)))
    assert set(net.end.statistics) == {"qgc", "camera"}
    return net


def test_with_a_key_what_is_rightly_signed_goes_on_under_its_own_signature():
    net = signed_net()
    data = net.signed(QGC, long(CAMERA))
    assert net.deliver("qgc", data) == [("camera", data)]


@pytest.mark.parametrize("how", ["unsigned", "wrong key", "replayed", "looked at"])
def test_with_a_key_nothing_else_leaves_least_of_all_under_the_vehicles_signature(how):
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


def test_what_is_signed_with_one_links_key_does_not_reach_a_link_with_another():
    net = signed_net(camera=OTHER)
    assert net.deliver("qgc", net.signed(QGC, long(CAMERA))) == []
    assert net.deliver("camera", net.signed(CAMERA, ALIVE[CAMERA], OTHER)) == []


def test_a_peer_is_no_reader_of_itself():
    links = Links(1, 1, ["a", "b", "c"], Keyring({"a": KEY, "b": KEY, "c": OTHER}))
    assert (links.readers("a"), links.readers("c")) == (["b"], [])


def test_a_listener_without_a_key_hears_what_is_signed():
    net = Net(peers=["listener"], keyring=Keyring({"camera": KEY}, timestamp=T))
    data = net.signed(CAMERA, ALIVE[CAMERA])
    assert net.deliver("camera", data) == [("listener", data)]
    assert net.deliver("listener", net.frame(QGC, long(CAMERA))) == []


# Real clients' frames


class Pymavlink:
    """Unmodified pymavlink at a port of its own."""

    def __init__(self, net, port, ids):
        self.net, self.port = net, port
        self.mav = common.MAVLink(None, *ids)

    def send(self, message):
        data = message.pack(self.mav)
        self.mav.seq = (self.mav.seq + 1) % 256
        return self.net.deliver(self.port, data)

    def hears(self, copies):
        data = b"".join(sent for key, sent in copies if key == self.port)
        return self.mav.parse_buffer(data) or []


def test_a_camera_and_two_ground_stations_find_and_answer_each_other():
    net = Net()
    camera, qgc = Pymavlink(net, "camera", CAMERA), Pymavlink(net, "qgc", QGC)
    script = Pymavlink(net, "script", (245, 190))
    for station in (qgc, script):
        station.send(common.MAVLink_heartbeat_message(common.MAV_TYPE_GCS, 8, 0, 0, 4, 3))
    beat = camera.send(common.MAVLink_heartbeat_message(common.MAV_TYPE_CAMERA, 8, 0, 0, 4, 3))
    for station in (qgc, script):
        (heartbeat,) = station.hears(beat)
        assert (heartbeat.get_srcSystem(), heartbeat.get_srcComponent()) == CAMERA

    wanted = common.MAVLINK_MSG_ID_CAMERA_INFORMATION
    asked = qgc.send(common.MAVLink_command_long_message(*CAMERA, REQUEST, 0, wanted, 0, 0, 0, 0, 0, 0))
    (request,) = camera.hears(asked)
    assert (request.command, request.param1, request.get_srcSystem()) == (REQUEST, wanted, 255)
    assert net.answers == script.hears(asked) == []

    answered = camera.send(common.MAVLink_command_ack_message(REQUEST, 0, 0, 0, *QGC))
    assert [m.get_type() for m in qgc.hears(answered)] == ["COMMAND_ACK"]
    assert script.hears(answered) == []
    told = camera.send(
        common.MAVLink_camera_information_message(
            7, list(b"ENAC".ljust(32, b"\0")), list(b"Eye".ljust(32, b"\0")), 1, 8.0, 6.0, 4.5, 640, 480, 0, 2, 0, b""
        )
    )
    for station in (qgc, script):
        (information,) = station.hears(told)
        assert bytes(information.vendor_name).rstrip(b"\0") == b"ENAC"
        assert (information.resolution_h, information.get_srcComponent()) == (640, 100)
    assert net.end.routing.withheld == {}


# Whatever is said


PORTS = ("a", "b", "c", "d")
SENDERS = (QGC, MAVPROXY, CAMERA, COMPANION, (1, 1), (0, 0), (255, 0))
TARGETS = ((0, 0), (1, 0), (1, 1), CAMERA, COMPANION, QGC, (255, 0), (255, 77), ELSEWHERE)


@settings(max_examples=150, deadline=None)
@given(
    st.lists(
        st.tuples(st.sampled_from(PORTS), st.sampled_from(SENDERS), st.sampled_from(TARGETS), st.integers(0, 5)),
        max_size=40,
    )
)
def test_no_frame_returns_to_its_sender_nor_reaches_one_peer_twice(said):
    """Any frames by any ports, some of them again by another port, as a loop would bring them."""
    net, frames, came, went = Net(peers=["a", "b"]), [], {}, Counter()
    for port, ids, target, again in said:
        data = frames[-again] if 0 < again <= len(frames) else net.frame(ids, long(target))
        frames.append(data)
        came.setdefault(data, set()).add(port)
        for key, copy in net.deliver(port, data):
            went[key, copy] += 1
            assert copy == data
            assert key not in came[data]
    assert set(went.values()) <= {1}


def test_set_points_for_the_vehicle_are_taken_and_stay(net):
    message = mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 2552, *[1.0] * 11)
    net.end.receive_datagram(net.frame(COMPANION, message), "companion", net.now)
    assert [type(event) for event in net.end.events()] == [SetpointReceived]
    assert net.end.datagrams_to_send() == []
