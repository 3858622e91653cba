"""The bridge's end of MAVLink: clocks, heartbeats, signatures, and what the vehicle says."""

import pytest

from darko_gcs.motion_capture.bridge_links import AutopilotLink
from protocol.dialect import mavlink
from protocol.wire.codec import Codec
from protocol.wire.signing import Keyring

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
