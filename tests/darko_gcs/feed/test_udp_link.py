"""The link's clock, and where a key is sent."""

import asyncio
import io
import socket
import time

import pytest

from darko_gcs.errors import LinkError
from darko_gcs.feed.links import MAX_AT_ONCE, UdpLink
from darko_gcs.station.station import Station
from protocol.tlog import TlogReader, TlogWriter
from protocol.wire.codec import Codec
from protocol.wire.signing import Keyring, is_secret
from tests.support.gcs.messages import heartbeat
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
    assert link.station.snapshot.age(link.now) < 60.0


def test_a_clock_before_1970_is_recorded_as_1970(monkeypatch):
    monkeypatch.setattr(time, "time_ns", lambda: -HOUR)
    assert UdpLink(Station()).time_usec() == 0


class FakeSocket:
    """Holds what would be sent."""

    def __init__(self):
        self.log = []

    @property
    def sent(self):
        return [data for data, _ in self.log]

    def sendto(self, data, to):
        self.log.append((data, to))


def test_a_key_for_a_loopback_vehicle_is_dropped_when_the_vehicle_has_moved():
    link = UdpLink(Station(keyring=Keyring({None: KEY}, timestamp=T)))
    link._socket, link._peer = FakeSocket(), LOCAL
    link.station.endpoint.send_key(KEY, T, (1, 1))
    link._peer = FAR
    link._send()
    assert link._socket.sent == []
    link.station.endpoint.send_key(KEY, T, (1, 1))
    link._peer = LOCAL
    link._send()
    assert [is_secret(data) for data in link._socket.sent] == [True]


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
    link._socket = FakeSocket()
    vehicle = Codec(1, 1)
    link.take_datagrams([(vehicle.encode(heartbeat()), LOCAL)])
    link.station.arm(link.now)
    link.take_datagrams([(vehicle.encode(heartbeat()), FAR)])
    assert {to for _, to in link._socket.log} == {LOCAL}


async def test_a_port_in_use_and_a_name_that_is_none_are_reported():
    link = UdpLink(Station())
    await link.open("127.0.0.1", 0)
    for host, port in (("127.0.0.1", link.port), ("no such host", 0)):
        with pytest.raises(LinkError, match="cannot listen on"):
            await UdpLink(Station()).open(host, port)
    await link.close()
