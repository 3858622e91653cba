"""Links that reach out to a vehicle: what they send first, what they hear, and how they fail."""

import asyncio
import os
import pty
import tty

import pytest
from hypothesis import given
from hypothesis import strategies as st

from darko_gcs.errors import LinkError
from darko_gcs.feed.links import OutwardAddress, outward_address
from darko_gcs.scripting.link_session import open_link
from darko_gcs.station.station import Station
from protocol.wire.codec import Codec
from protocol.wire.framing import FrameBuffer
from tests.support.gcs.messages import heartbeat

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
        await until(lambda: link.station.snapshot.source == (1, 1))
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
        await until(lambda: link.station.snapshot.source == (1, 1) and heard)
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
        await until(lambda: link.station.snapshot.source == (1, 1))
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
