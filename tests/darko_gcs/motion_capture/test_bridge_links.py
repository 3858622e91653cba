"""The bridge's two ends, without a socket: the client's side of NatNet, and MAVLink to the autopilot."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from darko_gcs.motion_capture.bridge_links import AutopilotLink, NatnetLink
from protocol.dialect import mavlink
from protocol.natnet import Address, Packet, descriptions, frame_packet, server_info
from protocol.wire.codec import Codec
from protocol.wire.signing import Keyring
from tests.support.motion_capture.hall import UNICAST, cameras, frames_of

CAMERAS = cameras(ideal=True)
FRAMES = frames_of(CAMERAS, 0.2)


def kinds(packets):
    return [struct.unpack_from("<H", data)[0] for data in packets]


def met(address=UNICAST, version=(3, 1)):
    link = NatnetLink()
    link.receive(server_info(version, address), 0.0)
    return link


def test_it_asks_for_the_server_each_second_until_it_answers():
    link = NatnetLink()
    assert [kinds(link.requests(now)) for now in (0.0, 0.5, 1.0)] == [[Packet.CONNECT], [], [Packet.CONNECT]]


def test_it_asks_for_the_bodies_at_once_and_keeps_a_stream_of_its_own_alive():
    link = met()
    assert kinds(link.requests(0.0)) == [Packet.CONNECT, Packet.REQUEST_DESCRIPTIONS, Packet.KEEP_ALIVE]
    link.receive(descriptions(CAMERAS.body, (3, 1)), 0.1)
    link.receive(frame_packet(FRAMES[0], CAMERAS.body, (3, 1)), 0.9)
    assert link.names == {"DarkO": 1}
    assert [kinds(link.requests(now)) for now in (0.9, 1.0, 1.5)] == [[], [Packet.KEEP_ALIVE], []]


def test_a_group_is_not_kept_alive():
    assert kinds(met(Address(1511, "239.255.42.99")).requests(0.0)) == [Packet.CONNECT, Packet.REQUEST_DESCRIPTIONS]


def test_without_frames_for_two_seconds_the_server_is_gone_and_is_asked_for_again():
    link = met()
    link.receive(descriptions(CAMERAS.body, (3, 1)), 0.1)
    link.receive(frame_packet(FRAMES[0], CAMERAS.body, (3, 1)), 1.0)
    link.requests(3.0)
    assert link.is_streaming
    assert Packet.CONNECT in kinds(link.requests(3.1))
    assert not link.is_streaming


@pytest.mark.parametrize("version", [(2, 9), (5, 0)])
def test_a_bit_stream_that_cannot_be_read_is_not_read(version):
    info = bytearray(server_info((3, 1), UNICAST))
    info[4 + 260 : 4 + 262] = bytes(version)
    link = NatnetLink()
    link.receive(bytes(info), 0.0)
    assert link.receive(frame_packet(FRAMES[0], CAMERAS.body, (3, 1)), 0.0) is None


def test_damaged_packets_are_counted():
    link = met()
    link.receive(frame_packet(FRAMES[0], CAMERAS.body, (3, 1))[:50], 0.0)
    link.receive(struct.pack("<HH", 1, 0), 0.0)
    assert link.damaged == 2


def test_its_farewell_disconnects():
    assert kinds([met().farewell()]) == [Packet.DISCONNECT]


@given(st.lists(st.binary(max_size=400), max_size=6))
def test_nothing_disturbs_the_link(packets):
    link = NatnetLink()
    link.receive(server_info((4, 1), Address(1511)), 0.0)
    for data in packets:
        link.receive(data, 0.0)
        for kind in (1, 5, 7):
            link.receive(struct.pack("<HH", kind, len(data)) + data, 0.0)
    link.receive(server_info((4, 1), Address(1511)), 1.0)
    link.requests(2.0)
    assert link.receive(frame_packet(FRAMES[0], CAMERAS.body, (4, 1)), 2.0).number == FRAMES[0].number


KEY = bytes(range(32))
AHEAD = 500.0  # the vehicle's clock [s]


class Vehicle:
    """Answers TIMESYNC after a while, and asks itself if it is a PX4."""

    def __init__(self, link, *, asks=False, keyring=None, ids=(1, 1)):
        self.link, self.asks, self.ahead = link, asks, AHEAD
        self.codec = Codec(*ids, (keyring or Keyring()).link(None))
        self.heard = []

    def run(self, first, last, late=0.001):
        for k in range(round(10 * first), round(10 * last)):
            now = k / 10.0
            for data in self.link.outgoing(now):
                for message in self.codec.decode(data):
                    self.heard.append(message)
                    if message.get_type() == "TIMESYNC" and message.tc1 == 0:
                        self.say(
                            mavlink.MAVLink_timesync_message(round(1e9 * (now + late + self.ahead)), message.ts1),
                            now + 2 * late,
                        )
            if self.asks:
                self.say(mavlink.MAVLink_timesync_message(0, round(1e9 * (now + self.ahead))), now)

    def say(self, message, now):
        return self.link.receive(self.codec.encode(message), now)

    def beat(self, now, autopilot=mavlink.MAV_AUTOPILOT_PX4):
        return self.say(mavlink.MAVLink_heartbeat_message(20, autopilot, 0, 0, 4, 3), now)


def test_stamps_are_of_the_vehicle_s_clock_where_it_does_not_compare_clocks_itself():
    link = AutopilotLink(1, Keyring())
    assert (link.clock, link.stamp(2.0)) == ("local", 2_000_000)
    Vehicle(link).run(0.0, 3.0)
    assert link.clock == "vehicle"
    assert link.stamp(2.0) == pytest.approx(502e6, abs=10)


def test_stamps_stay_in_our_clock_where_the_vehicle_asks_for_it():
    link = AutopilotLink(1, Keyring())
    vehicle = Vehicle(link, asks=True)
    vehicle.run(0.0, 3.0)
    assert link.stamp(2.0) == 2_000_000
    answer = [m for m in vehicle.heard if m.get_type() == "TIMESYNC" and m.tc1][-1]
    assert answer.ts1 == round(1e9 * (answer.tc1 * 1e-9 + AHEAD))


@pytest.mark.parametrize(("clock", "asks", "stamp"), [("local", False, 2e6), ("vehicle", True, 502e6)])
def test_the_clock_can_be_chosen(clock, asks, stamp):
    link = AutopilotLink(1, Keyring(), clock)
    Vehicle(link, asks=asks).run(0.0, 2.0)
    assert link.stamp(2.0) == pytest.approx(stamp, abs=10)


def test_the_quickest_answer_counts_and_late_ones_do_not():
    link = AutopilotLink(1, Keyring())
    vehicle = Vehicle(link)
    vehicle.run(0.0, 1.0, late=0.001)
    vehicle.ahead = AHEAD + 0.05
    vehicle.run(1.0, 2.0, late=0.04)
    vehicle.run(2.0, 3.0, late=0.4)
    assert link.stamp(2.0) == pytest.approx(502e6, abs=10)


def test_a_vehicle_that_was_restarted_has_another_clock():
    link = AutopilotLink(1, Keyring())
    vehicle = Vehicle(link)
    vehicle.run(0.0, 2.0)
    vehicle.ahead = 0.0
    vehicle.run(2.0, 4.0)
    assert link.stamp(2.0) == pytest.approx(2e6, abs=10)


def test_it_beats_each_second_as_no_companion():
    link = AutopilotLink(1, Keyring())
    vehicle = Vehicle(link)
    vehicle.run(0.0, 3.0)
    beats = [m for m in vehicle.heard if m.get_type() == "HEARTBEAT"]
    assert {(m.type, m.autopilot, m.get_srcSystem(), m.get_srcComponent()) for m in beats} == {(0, 8, 1, 197)}
    assert len(beats) == 3


def test_refusals_are_passed_on_once_until_the_vehicle_is_gone():
    link = AutopilotLink(1, Keyring())
    vehicle = Vehicle(link)
    refusal = mavlink.MAVLink_statustext_message(4, b"ODOMETRY refused: not a number")
    vehicle.beat(0.0)
    assert vehicle.say(mavlink.MAVLink_statustext_message(6, b"Armed"), 0.0) == []
    assert vehicle.say(refusal, 0.0) == ["ODOMETRY refused: not a number"]
    assert vehicle.say(refusal, 1.0) == []
    late = [mavlink.MAVLink_statustext_message(4, b"ODOMETRY refused: %d ms late" % ms) for ms in (80, 96)]
    assert [len(vehicle.say(each, 1.0)) for each in late] == [1, 0]
    vehicle.beat(10.0)
    assert vehicle.say(refusal, 10.0) == ["ODOMETRY refused: not a number"]


def test_it_hears_its_own_vehicle_alone_and_with_a_key_only_what_is_signed():
    link = AutopilotLink(1, Keyring({None: KEY}, timestamp=1000))
    Vehicle(link).beat(0.0)
    assert not link.is_heard(0.0)
    Vehicle(link, keyring=Keyring({None: KEY}, timestamp=2000), ids=(2, 1)).beat(0.0)
    assert not link.is_heard(0.0)
    Vehicle(link, keyring=Keyring({None: KEY}, timestamp=2000)).beat(0.0)
    assert (link.is_heard(0.0), link.is_heard(3.0), link.autopilot) == (True, False, "PX4")
    assert all(data[2] & 1 for data in link.outgoing(1.0))  # signed


def flying(link, first, last, ahead=0.0, asks=False):
    """A vehicle that tells its time since boot, and a server that stamps by it."""
    vehicle = Vehicle(link, asks=asks)
    for k in range(first, last):
        vehicle.say(mavlink.MAVLink_system_time_message(0, 10 * k), 0.01 * k)
        link.compare(0.01 * k + ahead)
    return vehicle


def test_stamps_of_a_server_whose_clock_is_the_vehicle_s_time_since_boot_are_kept():
    link = AutopilotLink(1, Keyring())
    flying(link, 0, 20)
    assert link.clock == "local"
    flying(link, 20, 60)
    assert (link.clock, link.stamp(100.0, 0.5), link.stamp(100.0)) == ("server", 500_000, 100_000_000)
    flying(link, 60, 61, ahead=2.0)
    assert link.clock == "local"


def test_stamps_of_a_server_with_a_clock_of_its_own_and_for_a_vehicle_that_asks_are_not():
    other, asking = AutopilotLink(1, Keyring()), AutopilotLink(1, Keyring())
    flying(other, 0, 200, ahead=30.0)
    flying(asking, 0, 200, asks=True).run(0.0, 1.0)
    assert (other.clock, asking.clock) == ("local", "local")
