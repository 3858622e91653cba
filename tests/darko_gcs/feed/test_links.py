"""Links of a station: a UDP socket that waits, and ``udpout:``, ``tcp:`` and ``serial:``, which reach out."""

import asyncio
import io
import os
import pty
import socket
import time
import tty
from unittest.mock import create_autospec

import pytest
from hypothesis import given
from hypothesis import strategies as st

from darko_gcs.errors import LinkError
from darko_gcs.feed.links import ADDRESS_LIFE, MAX_AT_ONCE, OutwardAddress, UdpLink, UdpSocket, outward_address
from darko_gcs.scripting.link_session import open_link
from darko_gcs.station.fleet import Fleet
from darko_gcs.station.station import Station
from protocol.tlog import TlogReader, TlogWriter
from protocol.wire.codec import Codec
from protocol.wire.framing import FrameBuffer
from protocol.wire.signing import Keyring, is_secret
from tests.support.gcs.messages import heartbeat, station_heartbeat
from tests.support.vehicle.signed_station import FAR, KEY, LOCAL, T

HOUR = 3600 * 10**9  # [ns]


@pytest.mark.parametrize("jump", [-HOUR, HOUR, -100 * 365 * 24 * HOUR])
async def test_a_wall_clock_that_is_set_in_flight_does_not_change_the_log_times(monkeypatch, jump):
    log, began = io.BytesIO(), time.time_ns()
    link = UdpLink(Station(TlogWriter(log)))
    vehicle = Codec(1, 1)
    for number in range(6):
        if number == 3:
            monkeypatch.setattr(time, "time_ns", lambda: began + jump)
        link.take_datagrams([(vehicle.encode(heartbeat(armed=True, mode=number)), ("127.0.0.1", 9))])
    link.station._recorder.flush()
    reader = TlogReader(log.getvalue())
    assert len(reader) == 6
    assert not len(reader.backward)
    assert reader.times[-1] - reader.times[0] < 60e6
    assert abs(int(reader.times[0]) - began // 1000) < 60e6
    assert link.station.snapshot.link.age(link.now) < 60.0


def test_a_clock_before_1970_is_recorded_as_1970(monkeypatch):
    monkeypatch.setattr(time, "time_ns", lambda: -HOUR)
    assert UdpLink(Station()).time_usec() == 0


def recording_socket():
    return create_autospec(UdpSocket, instance=True)


def sent_by(recording):
    """Data and address of everything that it was given to send."""
    return [call.args for call in recording.sendto.call_args_list]


def test_a_key_for_a_loopback_vehicle_is_dropped_when_the_vehicle_has_moved():
    link = UdpLink(Station(keyring=Keyring({None: KEY}, timestamp=T)))
    link._socket, link._peer = recording_socket(), LOCAL
    link.station.endpoint.send_key(KEY, T, (1, 1))
    link._peer = FAR
    link._send()
    assert sent_by(link._socket) == []
    link.station.endpoint.send_key(KEY, T, (1, 1))
    link._peer = LOCAL
    link._send()
    assert [is_secret(data) for data, _ in sent_by(link._socket)] == [True]


async def test_what_waits_is_taken_at_one_wake_up_and_answered_once(monkeypatch):
    link, batches = UdpLink(Station()), []
    take = link.take_datagrams
    monkeypatch.setattr(link, "take_datagrams", lambda batch: (batches.append(len(batch)), take(batch)))
    await link.open("127.0.0.1", 0)
    vehicle = Codec(1, 1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for number in range(MAX_AT_ONCE + 3):
            sender.sendto(vehicle.encode(heartbeat(armed=True, mode=number)), ("127.0.0.1", link.port))
        while sum(batches) < MAX_AT_ONCE + 3:
            await asyncio.sleep(0.001)
    await link.close()
    assert batches == [MAX_AT_ONCE, 3]
    assert link.station.endpoint.codec.statistics.received == MAX_AT_ONCE + 3


def test_an_answer_goes_to_the_address_that_was_heard_before_the_vehicle_moved():
    link = UdpLink(Station())
    link._socket = recording_socket()
    vehicle = Codec(1, 1)
    link.take_datagrams([(vehicle.encode(heartbeat()), LOCAL)])
    link.station.arm(link.now)
    link.take_datagrams([(vehicle.encode(heartbeat()), FAR)])
    assert {to for _, to in sent_by(link._socket)} == {LOCAL}


def test_what_is_sent_reaches_every_vehicle_where_it_is_heard_and_no_other_sender(monkeypatch):
    link = UdpLink(Station())
    fleet = Fleet(link.station)
    link._socket, now = recording_socket(), 100.0
    monkeypatch.setattr(UdpLink, "now", property(lambda _: now))
    first, second, stranger = (Codec(system, 1) for system in (1, 2, 3))
    elsewhere, outside = ("127.0.0.1", 14881), ("127.0.0.1", 14999)
    link.take_datagrams([(first.encode(heartbeat()), LOCAL)])
    for _ in range(2):
        link.take_datagrams([(second.encode(heartbeat()), elsewhere)])
    link.take_datagrams([(stranger.encode(station_heartbeat()), outside)])
    link._socket.sendto.reset_mock()
    fleet.stations[2].arm(now)
    link._send()
    assert {to for _, to in sent_by(link._socket)} == {LOCAL, elsewhere}
    now += ADDRESS_LIFE + 1.0
    link._socket.sendto.reset_mock()
    link.station.arm(now)
    link._send()
    assert {to for _, to in sent_by(link._socket)} == {LOCAL}


async def test_a_port_in_use_and_a_name_that_is_none_are_reported():
    link = UdpLink(Station())
    await link.open("127.0.0.1", 0)
    for host, port in (("127.0.0.1", link.port), ("no such host", 0)):
        with pytest.raises(LinkError, match="cannot listen on"):
            await UdpLink(Station()).open(host, port)
    await link.close()


BEAT = Codec(1, 1).encode(heartbeat())


async def until(condition):
    for _ in range(300):
        if condition():
            return
        await asyncio.sleep(0.01)
    raise AssertionError("not in time")


class Place(asyncio.DatagramProtocol):
    """A vehicle's UDP port that answers the first datagram."""

    def __init__(self):
        self.heard = []

    def connection_made(self, transport):
        self.transport = transport

    def datagram_received(self, data, addr):
        self.heard.append(data)
        self.transport.sendto(BEAT, addr)


async def test_it_speaks_first_and_hears_the_answer_by_udp():
    loop = asyncio.get_running_loop()
    transport, place = await loop.create_datagram_endpoint(Place, local_addr=("127.0.0.1", 0))
    port = transport.get_extra_info("sockname")[1]
    async with open_link(Station(), f"udpout:127.0.0.1:{port}", 0) as link:
        await until(lambda: link.station.snapshot.identity.source == (1, 1))
    assert place.heard
    transport.close()


async def test_it_hears_and_speaks_by_tcp_and_connects_again():
    heard, streams = [], []

    async def serve(reader, writer):
        streams.append(writer)
        writer.write(b"\x00junk" + BEAT[:5])
        await writer.drain()
        writer.write(BEAT[5:])
        heard.append(await reader.read(300))

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    async with open_link(Station(), f"tcp:127.0.0.1:{port}", 0) as link:
        await until(lambda: link.station.snapshot.identity.source == (1, 1) and heard)
        streams[0].close()
        await until(lambda: len(streams) == 2)
    assert heard[0][0] == 0xFD
    server.close()


async def test_it_hears_a_serial_line():
    pytest.importorskip("serial_asyncio_fast")
    ours, theirs = pty.openpty()
    tty.setraw(ours)
    async with open_link(Station(), f"serial:{os.ttyname(theirs)}:57600", 0) as link:
        os.write(ours, BEAT)
        await until(lambda: link.station.snapshot.identity.source == (1, 1))
    os.close(ours)
    os.close(theirs)


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("127.0.0.1", None),
        ("::1", None),
        ("udpout:host:14580", OutwardAddress("udpout", "host", 14580)),
        ("tcp:[::1]:5760", OutwardAddress("tcp", "[::1]", 5760)),
        ("serial:/dev/ttyUSB0", OutwardAddress("serial", "/dev/ttyUSB0", 57600)),
        ("serial:/dev/ttyUSB0:115200", OutwardAddress("serial", "/dev/ttyUSB0", 115200)),
    ],
)
def test_addresses(text, address):
    assert outward_address(text) == address


@pytest.mark.parametrize("text", ["udpout:", "udpout:host", "tcp:host:0", "tcp:host:x", "tcp::1"])
def test_an_address_that_makes_no_sense_is_refused(text):
    with pytest.raises(LinkError, match=r"an address is (udpout|tcp):HOST:PORT"):
        outward_address(text)


async def test_a_place_where_nothing_answers_is_an_error():
    with pytest.raises(LinkError, match=r"cannot connect to tcp:127\.0\.0\.1:1:"):
        async with open_link(Station(), "tcp:127.0.0.1:1", 0):
            pass


@given(st.lists(st.binary(max_size=30).filter(lambda b: not {0xFD, 0xFE} & set(b)), max_size=5), st.integers(1, 40))
def test_frames_come_out_of_a_stream_however_it_is_cut(junk, size):
    stream = b"".join(noise + BEAT for noise in junk)
    buffer, found = FrameBuffer(), []
    for at in range(0, len(stream), size):
        found += buffer.feed(stream[at : at + size])
    assert found == [BEAT] * len(junk)
