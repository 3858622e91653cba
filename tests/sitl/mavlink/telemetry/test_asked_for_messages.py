"""Messages that only those get who ask: the private ones, and those newer than pymavlink's definitions."""

import pytest

from protocol.dialect import mavlink
from protocol.endpoints.router import MAX_LEARNED_PEERS
from protocol.names import Mode
from tests.support.vehicle.fake_station import PEER, Bench

ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
SET, REQUEST = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAV_CMD_REQUEST_MESSAGE
STREAMED = {"DARKO_HYBRID_STATE", "DARKO_ACTUATORS", "DARKO_ENERGY", "DARKO_AIR"}


class Counter:
    """pymavlink's own account of a link, as MAVProxy's ``link`` prints it."""

    def __init__(self):
        from pymavlink import mavutil
        from pymavlink.dialects.v20 import ardupilotmega

        class Wire(mavutil.mavfile):
            def recv(self, n=None):
                end = len(self.inbox) if n is None else n
                data, self.inbox = self.inbox[:end], self.inbox[end:]
                return data

        self.wire = Wire(None, "memory")
        self.wire.inbox, self.wire.first_byte = b"", False
        self.wire.mav = ardupilotmega.MAVLink(None)
        self.wire.mav.robust_parsing = True
        self.unknown = 0

    def take(self, data):
        self.wire.inbox += data
        while (message := self.wire.recv_msg()) is not None:
            self.unknown += message.get_type().startswith("UNKNOWN")


def test_pymavlink_loses_nothing_unless_it_asks_for_what_it_does_not_know(tmp_path):
    bench, counter = Bench(tmp_path, up=3.0), Counter()
    other = bench.station(255, "other")
    other.beat()

    def deliver():
        for key, data in bench.node.datagrams(bench.now):
            if key == "other":
                counter.take(data)

    bench.deliver = deliver
    bench.advance(2.0)
    bench.autopilot.set_mode(Mode.LAND)  # with jumps, a new mode and a change of who is in control
    bench.advance_until(lambda: not bench.autopilot.armed, 20.0)
    assert bench.aircraft.vehicle.jumps
    assert (counter.unknown, counter.wire.mav_loss) == (0, 0)
    asked = mavlink.MAVLINK_MSG_ID_DARKO_ENERGY
    other.send(mavlink.MAVLink_command_long_message(1, 1, REQUEST, 0, asked, 0, 0, 0, 0, 0, 0))
    bench.advance(5.0)
    assert counter.unknown > 100
    assert counter.wire.mav_loss == pytest.approx(counter.unknown, abs=5)  # those since its last known frame come later


def private(messages):
    return {m.get_type() for m in messages if m.get_type().startswith("DARKO_")}


def heard_of(station, seconds=2.0):
    """Private messages that a station gets from now on."""
    station.heard.clear()
    station.advance(seconds)
    return private(station.heard)


def test_the_private_messages_and_events_go_to_the_station_that_asked(tmp_path):
    bench = Bench(tmp_path, up=3.0)
    main, other = bench.station(255, PEER), bench.station(245, "other")
    other.beat()
    main.ask_for("DARKO_AIR")
    bench.autopilot.set_mode(Mode.LAND)
    bench.advance(8.0)
    assert private(main.heard) == {"DARKO_JUMP", *STREAMED}
    assert private(other.heard) == set()
    assert {m.name for m in other.all("NAMED_VALUE_FLOAT")} == {"V", "law", "jumps", "governor", "power"}


def test_a_client_that_was_forgotten_has_to_ask_anew(tmp_path):
    bench = Bench(tmp_path)
    client = bench.station(245, "client")
    client.beat()
    client.ask_for("DARKO_AIR")
    assert heard_of(client) == STREAMED
    for n in range(MAX_LEARNED_PEERS):
        other = bench.station(100 + n, f"port {n}")
        for _ in range(3):
            other.beat()
    bench.advance(0.1)
    client.beat()
    assert heard_of(client) == set()
    assert client.command(SET, mavlink.MAVLINK_MSG_ID_DARKO_AIR, 1e6) == ACCEPTED
    assert heard_of(client) == STREAMED


def test_an_interval_tells_whether_a_client_has_asked(tmp_path):
    bench = Bench(tmp_path)
    main, other = bench.station(255, PEER), bench.station(245, "other")
    main.ask_for("DARKO_AIR")
    intervals = []
    for station in (main, other):
        station.command(mavlink.MAV_CMD_GET_MESSAGE_INTERVAL, mavlink.MAVLINK_MSG_ID_DARKO_ACTUATORS)
        intervals.append(station.last("MESSAGE_INTERVAL").interval_us)
    assert intervals == [50_000, -1]
