"""The loop of the vehicle process: however much it receives, it goes on flying."""

import argparse
import socket

import pytest

from sitl.mavlink.transport import MAX_DATAGRAM, UdpTransport
from sitl.process import vehicle_process
from sitl.process.vehicle_process import Pacer


@pytest.fixture
def transport():
    made = UdpTransport(("127.0.0.1", 0))
    yield made
    made.close()


@pytest.fixture
def crowd(transport):
    """Sends to the vehicle's port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect(("127.0.0.1", transport.port))
        yield sender


@pytest.mark.parametrize(
    ("gcs_port", "api_port", "sends_to"),
    [(14550, 14540, "14550 and 14540"), (14550, 0, "14550"), (0, 0, "those who speak to it")],
)
def test_the_vehicle_says_where_it_listens_and_sends(gcs_port, api_port, sends_to):
    args = argparse.Namespace(bind="127.0.0.1", gcs_port=gcs_port, api_port=api_port)
    assert vehicle_process.link_text(args, 14580) == f"on 127.0.0.1:14580, sends to {sends_to}"


class Listener:
    """Takes half a millisecond for each datagram, by its own clock."""

    def __init__(self):
        self.now, self.heard, self.flown = 0.0, [], 0

    def monotonic(self):
        return self.now

    def receive(self, data, _peer, _now):
        self.heard.append(data)
        self.now += 5e-4

    def datagrams(self, _now):
        return []

    def periods_to_fly(self):
        return 5

    def advance(self, ticks):
        self.flown += ticks


def test_a_crowd_is_heard_for_a_moment_and_again_later(transport, crowd, monkeypatch):
    listener = Listener()
    monkeypatch.setattr(vehicle_process, "time", listener)
    said = [bytes([n]) for n in range(20)]
    for data in said:
        crowd.send(data)
    vehicle_process._receive(listener, transport)
    assert listener.heard == said[: len(listener.heard)]
    assert 0 < listener.now <= vehicle_process.MAX_LISTENING + 5e-4
    while listener.heard != said:
        before = len(listener.heard)
        vehicle_process._receive(listener, transport)
        assert len(listener.heard) > before


def test_a_late_vehicle_listens_once_per_step_of_flight(transport, crowd, monkeypatch):
    listener = Listener()
    monkeypatch.setattr(vehicle_process, "time", listener)
    monkeypatch.setattr(vehicle_process, "MAX_LISTENING", 0.0)  # each datagram takes longer than there is time for
    for n in range(20):
        crowd.send(bytes([n]))
    vehicle_process.serve(listener, transport, Pacer(0.0), until=lambda: listener.flown >= 25)
    assert len(listener.heard) == 5


def test_only_the_end_of_an_oversized_datagram_is_lost(transport, crowd):
    for data in (b"a" * 60_000, b"b" * 1500):
        crowd.send(data)
    assert [data for data, _ in transport.receive()] == [b"a" * MAX_DATAGRAM, b"b" * 1500]
