"""A recorded flight is sent to a station byte for byte, without what a station must not get."""

import asyncio

import pytest
from pymavlink import mavutil
from pymavlink.generator.mavcrc import x25crc

from darko_gcs.errors import GroundError, LinkError
from darko_gcs.feed.links import OutwardAddress, UdpLink
from darko_gcs.feed.replay_output import played_frames
from darko_gcs.station.station import Station
from darko_gcs.tasks.log_player import LogPlayer, loopback_or_asked
from protocol.dialect import mavlink
from protocol.tlog import TlogReader, read_tlog
from tests.support.logs import bare, flight, log_of, record
from tests.support.paths import DATA

COUNT = 150  # frames: so many fit into a socket's buffer


@pytest.fixture(scope="module")
def reader():
    """The beginning of a recorded flight."""
    whole = read_tlog(DATA / "square-flight.tlog")
    return TlogReader(b"".join(record(time, frame) for time, frame in list(whole.records())[:COUNT]))


def local(port):
    return OutwardAddress("udpout", "127.0.0.1", port)


async def played(player, port, **options):
    await player.open(local(port))
    await player.play(**options)
    player.close()


async def test_pymavlink_receives_the_recorded_frames_byte_for_byte(reader):
    receiver = mavutil.mavudp("127.0.0.1:0", input=True)
    try:
        player = LogPlayer(reader, speed=20.0)
        await played(player, receiver.port.getsockname()[1])
        frames = [bytes(message.get_msgbuf()) for message in iter(receiver.recv_msg, None)]
    finally:
        receiver.close()
    assert frames == [reader.frame(row) for row in player.frames.rows.tolist()]
    assert len(frames) == player.sent > 100


async def test_our_own_station_shows_the_recorded_vehicle(reader):
    station = Station()
    link = UdpLink(station)
    await link.open("127.0.0.1", 0)
    player = LogPlayer(reader, speed=2.0)
    await played(player, link.port)
    for _ in range(100):
        if station.snapshot.link.boot == reader.columns("ATTITUDE", (1, 1))["time_boot_ms"][-1] / 1e3:
            break
        await asyncio.sleep(0.01)
    await link.close()
    s, places = station.snapshot, reader.columns("LOCAL_POSITION_NED", (1, 1))
    assert s.identity.source == (1, 1)
    assert s.position.p == tuple(float(places[axis][-1]) for axis in "xyz")


async def test_frames_keep_their_times_and_a_beginning_is_kept(reader):
    now = 0.0

    def clock():
        nonlocal now
        now += 0.001
        return now

    player = LogPlayer(reader, speed=100.0, clock=clock)
    half = player.frames.duration / 2
    sent = []
    player._send = lambda frame: sent.append((now, frame))
    await player.play(half)
    rows = player.frames.rows[player.frames.times >= half].tolist()
    assert [frame for _, frame in sent] == [reader.frame(row) for row in rows]
    for (when, _), time in zip(sent, player.frames.times[-len(rows) :], strict=True):
        assert (time - half) / 100.0 <= when - 0.001 + 1e-9


def test_signed_frames_keys_and_frames_of_stations_are_left_out():
    beat = mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3)
    key = mavlink.MAVLink_setup_signing_message(1, 1, bytes(32), 0)
    arm = mavlink.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)
    signed = bytearray(bare(mavlink.MAVLink_system_time_message(1, 2)))
    signed[2] = 1
    extra = bytes([mavlink.MAVLink_system_time_message.crc_extra])
    signed[-2:] = x25crc(signed[1:-2] + extra).crc.to_bytes(2, "little")
    own = flight(10)
    ground = [bare(beat, system=250, component=1), bare(arm, system=250, component=1)]
    reader = TlogReader(log_of([*own, *ground, bare(key), bytes(signed) + bytes(13)]))
    frames = played_frames(reader)
    assert [reader.frame(row) for row in frames.rows.tolist()] == own
    assert frames.left_out == {"signed": 1, "of ground stations": 2, "with a signing key": 1, "bytes of damage": 0}
    assert "left out: 1 signed, 2 of ground stations, 1 with a signing key" in frames.words


def test_another_machine_must_be_asked_for():
    with pytest.raises(GroundError, match="not this machine"):
        loopback_or_asked("udpout:192.0.2.7:14550", is_network_allowed=False)
    assert loopback_or_asked("udpout:192.0.2.7:14550", is_network_allowed=True).place == "192.0.2.7"
    assert loopback_or_asked("udpout:localhost:14550", is_network_allowed=False).number == 14550


@pytest.mark.parametrize("text", ["127.0.0.1", "tcp:127.0.0.1:5760", "udpout:127.0.0.1", "udpout:127.0.0.1:99999"])
def test_what_is_no_address_to_play_to_is_refused(text):
    with pytest.raises(LinkError, match="udpout:HOST:PORT"):
        loopback_or_asked(text, is_network_allowed=False)
