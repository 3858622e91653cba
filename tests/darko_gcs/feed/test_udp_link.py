"""The link's clock, and where a key is sent."""

import io
import time

import pytest

from darko_gcs.feed.udp_link import UdpLink
from darko_gcs.station.station import Station
from protocol.codec import Codec
from protocol.keyring import Keyring
from protocol.signing import is_secret
from protocol.tlog import TlogReader, TlogWriter
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
        link.datagram_received(vehicle.encode(heartbeat(armed=True, mode=number)), ("127.0.0.1", 9))
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


class FakeTransport:
    """Holds what asyncio would send."""

    def __init__(self):
        self.sent = []

    def sendto(self, data, _to):
        self.sent.append(data)


def test_a_key_for_a_loopback_vehicle_is_dropped_when_the_vehicle_has_moved():
    link = UdpLink(Station(keyring=Keyring({None: KEY}, timestamp=T)))
    link._transport, link._peer = FakeTransport(), LOCAL
    link.station.endpoint.send_key(KEY, T, (1, 1))
    link._peer = FAR
    link._send()
    assert link._transport.sent == []
    link.station.endpoint.send_key(KEY, T, (1, 1))
    link._peer = LOCAL
    link._send()
    assert [is_secret(data) for data in link._transport.sent] == [True]
