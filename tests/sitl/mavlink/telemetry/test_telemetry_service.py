"""Telemetry of the whole vehicle, link by link: what one client asks for, what the others get, and at what cost."""

import math
from itertools import pairwise

import pytest

from protocol.dialect import mavlink
from protocol.endpoints.router import MAX_LEARNED_PEERS
from protocol.names import Mode
from protocol.wire.codec import Codec
from sitl.autopilot.settings import Settings
from sitl.mavlink.telemetry.streams import Stream
from sitl.mavlink.telemetry.telemetry_service import BUILDERS, STREAMS
from sitl.mavlink.telemetry.vehicle_state import heartbeat
from sitl.simulation.avionics import Navigation
from tests.support.vehicle.fake_station import PEER, Bench
from tests.support.vehicle.signed_station import KEY, SignedStation

ACCEPTED, DENIED, UNSUPPORTED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED, mavlink.MAV_RESULT_UNSUPPORTED
SET, REQUEST = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAV_CMD_REQUEST_MESSAGE
ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
HEARTBEAT = Stream(mavlink.MAVLINK_MSG_ID_HEARTBEAT, heartbeat, 1.0)  # of real time
PRIVATE = ("DARKO_HYBRID_STATE", "DARKO_ACTUATORS", "DARKO_ENERGY", "DARKO_AIR")


def rates(station, seconds=6.0):
    """Messages a second of each kind that a station gets from now on."""
    station.heard.clear()
    station.bench.advance(seconds)
    counts = {}
    for message in station.heard:
        counts[message.get_type()] = counts.get(message.get_type(), 0) + 1
    return {kind: count / seconds for kind, count in counts.items()}


def ask_for_all(station, rate, start=1):
    """As MAVProxy and Mission Planner do every few seconds."""
    station.send(mavlink.MAVLink_request_data_stream_message(1, 1, mavlink.MAV_DATA_STREAM_ALL, rate, start))


@pytest.fixture
def pair(tmp_path):
    """The DarkO ground station's link, which asks for all that there is, and another client's."""
    bench = Bench(tmp_path)
    main, other = bench.station(255, PEER), bench.station(245, "other")
    other.beat()
    main.ask_for("DARKO_HYBRID_STATE", "CURRENT_MODE", "CONTROL_STATUS")
    bench.advance(1.0)
    return bench, main, other


def test_a_client_that_asks_for_everything_at_4_hz_gets_it_and_slows_nobody_else(pair):
    _, main, other = pair
    other.ask_for("DARKO_HYBRID_STATE", "CURRENT_MODE")
    before = rates(main)
    ask_for_all(other, 4)
    assert rates(main) == before
    slowed = rates(other)
    for name in ("ATTITUDE", "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "VFR_HUD", "SYS_STATUS", "BATTERY_STATUS"):
        assert slowed[name] == pytest.approx(4, abs=0.3), name
    for name in (*PRIVATE, "HEARTBEAT", "EXTENDED_SYS_STATE", "CURRENT_MODE"):
        assert slowed[name] == pytest.approx(before[name], abs=0.3), name


def test_streams_are_stopped_and_brought_back(pair):
    _, main, other = pair
    ask_for_all(other, 0, start=0)
    assert not {"ATTITUDE", "SYS_STATUS", "VFR_HUD"} & set(rates(other))
    assert rates(main)["ATTITUDE"] == pytest.approx(20, abs=0.3)
    ask_for_all(other, 0)
    assert rates(other)["ATTITUDE"] == pytest.approx(20, abs=0.3)


def test_requests_of_one_link_change_no_byte_on_another(tmp_path):
    def frames(folder, *, wishes):
        bench, sent = Bench(folder), []
        other = bench.station(245, "other")
        other.beat()

        def deliver():
            sent.extend(data for key, data in bench.node.datagrams(bench.now) if key == PEER)

        bench.deliver = deliver
        for step in range(20):
            if wishes:
                ask_for_all(other, step)
                number = mavlink.MAVLINK_MSG_ID_DARKO_ACTUATORS
                other.send(mavlink.MAVLink_command_long_message(1, 1, SET, 0, number, 1e4 * step, 0, 0, 0, 0, 0))
            bench.advance(0.1)
        return sent

    quiet = frames(tmp_path / "quiet", wishes=False)
    assert len(quiet) > 200
    assert frames(tmp_path / "busy", wishes=True) == quiet


def test_each_message_is_built_once_for_all_links(tmp_path, monkeypatch):
    built, number = [], mavlink.MAVLINK_MSG_ID_ATTITUDE
    build = BUILDERS[number]
    monkeypatch.setitem(BUILDERS, number, lambda snapshot: built.append(snapshot.time) or build(snapshot))
    bench = Bench(tmp_path)
    stations = [bench.station(200 + n, f"link {n}") for n in range(16)]
    for station in stations:
        station.beat()
    for station in stations[::2]:
        assert station.command(SET, mavlink.MAVLINK_MSG_ID_ATTITUDE, 100_000.0) == ACCEPTED
    built.clear()
    assert rates(stations[1], 2.0)["ATTITUDE"] == pytest.approx(20, abs=0.6)
    assert len(built) == len(set(built)) > 30


def test_a_forgotten_client_starts_with_the_defaults_again(tmp_path):
    bench = Bench(tmp_path)
    client = bench.station(245, "client")
    ask_for_all(client, 4)
    assert rates(client)["ATTITUDE"] == pytest.approx(4, abs=0.3)
    for n in range(MAX_LEARNED_PEERS):
        other = bench.station(100 + n, f"port {n}")
        for _ in range(3):
            other.beat()
    assert rates(client) == {}
    client.beat()
    assert rates(client)["ATTITUDE"] == pytest.approx(20, abs=0.3)


def test_an_unsigned_interval_request_is_ignored_once_signing_is_on(tmp_path):
    ground = SignedStation(tmp_path, given={None: KEY})
    stop = mavlink.MAVLink_request_data_stream_message(1, 1, mavlink.MAV_DATA_STREAM_ALL, 0, 0)

    def attitudes():
        ground.heard.clear()
        ground.advance(2.0)
        return sum(m.get_type() == "ATTITUDE" for m in ground.heard)

    ground.send(stop)
    assert attitudes() == pytest.approx(40, abs=1)
    ground.key = KEY
    ground.send(stop)
    assert attitudes() == 0


def looks(bench, seconds):
    """The control periods after which the vehicle looks at the link."""
    vehicle = bench.aircraft.vehicle
    seen, end = [vehicle.periods], vehicle.periods + seconds * 500
    while seen[-1] < end:
        bench.node.advance(bench.node.periods_to_fly())
        seen.append(vehicle.periods)
    return seen


def test_the_vehicle_flies_until_the_autopilot_ticks_or_a_message_is_due(tmp_path):
    bench = Bench(tmp_path)
    seen = looks(bench, 1.0)
    assert set(seen) >= {*range(seen[0], seen[-1], 10), *range(seen[0], seen[-1], 25)}  # 50 Hz, and 20 Hz
    bench.station().command(SET, mavlink.MAVLINK_MSG_ID_ATTITUDE, 1.0)
    assert {b - a for a, b in pairwise(looks(bench, 1.0))} == {5}  # a hundred times a second, whatever is asked for


# Who is in control


def status(station):
    told = station.last("CONTROL_STATUS")
    return told.gcs_main, bool(told.flags & mavlink.GCS_CONTROL_STATUS_FLAGS_TAKEOVER_ALLOWED)


def test_the_station_in_control_is_announced_at_once_and_every_two_seconds(pair):
    _, main, other = pair
    other.ask_for("CONTROL_STATUS")
    assert rates(other, 10.0)["CONTROL_STATUS"] == pytest.approx(0.5, abs=0.1)
    told = other.last("CONTROL_STATUS")
    assert told.flags & mavlink.GCS_CONTROL_STATUS_FLAGS_SYSTEM_MANAGER
    assert told.gcs_secondary == [0] * 10
    assert status(other) == (0, True)
    assert main.command(mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, 1, 0, 10) == ACCEPTED
    assert status(main) == status(other) == (255, False)


def test_it_is_announced_whether_control_may_be_taken(pair):
    bench, main, other = pair
    other.ask_for("CONTROL_STATUS")
    assert main.command(mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, 1, 1, 10) == ACCEPTED
    assert status(other) == (255, True)
    assert other.command(mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, 1, 0, 10) == ACCEPTED
    assert status(main) == (245, False)
    bench.advance(12.0)  # silence
    assert status(main) == (0, True)


def test_whoever_asks_for_control_hears_who_has_it(tmp_path):
    bench = Bench(tmp_path)
    station = bench.station()
    assert station.last("CONTROL_STATUS") is None
    assert station.command(mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, 1, 0, 10) == ACCEPTED
    assert status(station) == (255, False)


def test_where_everyone_may_command_nobody_is_in_control_and_requests_are_refused(tmp_path):
    bench = Bench(tmp_path, settings=Settings(control_policy=0))
    station = bench.station()
    assert station.command(ARM, 1) == ACCEPTED
    assert station.command(REQUEST, mavlink.MAVLINK_MSG_ID_CONTROL_STATUS) == ACCEPTED
    assert status(station) == (0, False)


# Small messages of identity


@pytest.mark.parametrize(
    ("name", "crc"), [("protocol_version", 217), ("available_modes_monitor", 30), ("control_status", 21)]
)
def test_messages_newer_than_the_generator_equal_the_published_ones(name, crc):
    """CRC_EXTRA covers name, fields and their order; the numbers are those of MAVLink's own C headers."""
    assert getattr(mavlink, f"MAVLink_{name}_message").crc_extra == crc


def test_the_protocol_version_answers_both_requests(pair):
    _, main, _ = pair
    for command, first in ((mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION, 1), (REQUEST, 300)):
        main.heard.clear()
        assert main.command(command, first) == ACCEPTED
        told = main.last("PROTOCOL_VERSION")
        assert (told.version, told.min_version, told.max_version) == (200, 100, 200)


def test_the_modes_monitor_is_sent_on_request_and_reports_no_change(pair):
    bench, main, _ = pair
    assert "AVAILABLE_MODES_MONITOR" not in rates(main, 10.0)  # its definition: sent only after the first change
    assert main.command(REQUEST, mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES_MONITOR) == ACCEPTED
    assert main.last("AVAILABLE_MODES_MONITOR").seq == 0
    assert main.command(SET, mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES_MONITOR, 1e6) == ACCEPTED
    bench.advance(3.0)
    assert {m.seq for m in main.heard if m.get_type() == "AVAILABLE_MODES_MONITOR"} == {0}


# What is not here: answered at once, so that clients stop asking

MISSING_MESSAGES = {
    "VIDEO_STREAM_INFORMATION": 269,
    "CAMERA_FOV_STATUS": 271,
    "GIMBAL_MANAGER_INFORMATION": 280,
    "GIMBAL_MANAGER_STATUS": 281,
    "GIMBAL_DEVICE_INFORMATION": 283,
    "COMPONENT_INFORMATION": 395,
    "COMPONENT_INFORMATION_BASIC": 396,
}
MISSING_COMMANDS = (
    "REQUEST_VIDEO_STREAM_INFORMATION",
    "SET_CAMERA_ZOOM",
    "VIDEO_START_STREAMING",
)


def answers(station, message):
    """All that comes in answer to one message, telemetry left out."""
    station.heard.clear()
    station.send(message)
    return [(m.get_type(), m.command, m.result) for m in station.heard if m.get_type() == "COMMAND_ACK"]


@pytest.fixture(scope="module")
def standing(tmp_path_factory):
    return Bench(tmp_path_factory.mktemp("state")).station()


@pytest.mark.parametrize("number", MISSING_MESSAGES.values(), ids=MISSING_MESSAGES)
def test_a_message_the_vehicle_does_not_have_is_refused_at_once(standing, number):
    wanted = mavlink.MAVLink_command_long_message(1, 1, REQUEST, 0, number, 0, 0, 0, 0, 0, 0)
    assert answers(standing, wanted) == [("COMMAND_ACK", REQUEST, UNSUPPORTED)]


@pytest.mark.parametrize("name", MISSING_COMMANDS)
@pytest.mark.parametrize("as_int", [False, True])
def test_what_the_camera_lacks_is_refused_at_once(standing, name, as_int):
    number = getattr(mavlink, f"MAV_CMD_{name}")
    if as_int:
        message = mavlink.MAVLink_command_int_message(1, 1, 3, number, 0, 0, 1, math.nan, math.nan, math.nan, 0, 0, 0)
    else:
        message = mavlink.MAVLink_command_long_message(1, 1, number, 0, 1, *[math.nan] * 6)
    assert answers(standing, message) == [("COMMAND_ACK", number, UNSUPPORTED)]


def test_a_command_for_an_absent_camera_is_not_answered(standing):
    wanted = mavlink.MAVLink_command_long_message(1, 100, REQUEST, 0, 259, 0, 0, 0, 0, 0, 0)
    assert answers(standing, wanted) == []


def test_every_streamed_message_can_be_requested(standing):
    for stream in (*(s for s in STREAMS if Navigation.TRUTH in s.needs), HEARTBEAT):
        if stream.message_id in {mavlink.MAVLINK_MSG_ID_DARKO_PLAN_STATUS, mavlink.MAVLINK_MSG_ID_DARKO_ARENA}:
            continue  # only of a vehicle with a flight plan, and under a net
        standing.heard.clear()
        assert standing.command(REQUEST, stream.message_id) == ACCEPTED
        assert standing.last(mavlink.mavlink_map[stream.message_id].msgname) is not None
        assert Codec(1, 1).encode(standing.heard[-1])


def test_the_net_is_told_of_a_vehicle_under_one_alone(tmp_path, standing):
    station = Bench(tmp_path, arena="voliere").station()
    for one, has_net in ((station, True), (standing, False)):
        one.heard.clear()
        assert one.command(REQUEST, mavlink.MAVLINK_MSG_ID_DARKO_ARENA) == ACCEPTED
        told = one.last("DARKO_ARENA")
        assert (told is not None) is has_net
    net = station.last("DARKO_ARENA")
    assert (net.name, net.length, net.width, net.height) == ("voliere", 10.0, 10.0, 7.0)
    assert net.margin == pytest.approx(1.2)


# Messages that only those get who ask: the private ones, and those newer than pymavlink's definitions.


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
