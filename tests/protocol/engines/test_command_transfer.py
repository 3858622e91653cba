"""Command client and server over a bad link."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.client.command_client import CommandClient
from protocol.engines.server.command_server import CommandServer
from protocol.events import CommandCancelRequested, CommandDone, CommandRequested
from protocol.wire.codec import Codec
from protocol.wire.message import Peer
from tests.support.links.lossy_pipe import LossyPipe
from tests.support.links.virtual_clock import VirtualClock

ARM, TAKEOFF, REPOSITION = 400, 22, 192


ACCEPTED, IN_PROGRESS, CANCELLED = 0, 5, 6


GROUND = Peer(255, 190, "ground")


def long(command=ARM, p1=1.0, confirmation=0, target=(1, 1), rest=math.nan):
    return mavlink.MAVLink_command_long_message(*target, command, confirmation, p1, *[rest] * 6)


def server(repeatable=()):
    return CommandServer(1, 1, {ARM, TAKEOFF, REPOSITION}, repeatable)


class Flight:
    """Both engines on a lossy link; each command takes three seconds."""

    TAKES = 3.0

    def __init__(self, seed, **losses):
        self.clock, self.client, self.server = VirtualClock(), CommandClient(255, 190), server()
        self.up, self.down = LossyPipe(seed, **losses), LossyPipe(seed + 1000, **losses)
        self.ground, self.vehicle = Codec(255, 190), Codec(1, 1)
        self.begun, self.running, self.ends, self.done = 0, {}, [], []
        self.next_progress = 0.0

    def run(self, until):
        while not self.done and self.clock.now < until:
            self.clock.advance_to(self.clock.now + 0.05)
            self._step(self.clock.now)

    def _step(self, now):
        for message in self._through(self.up, self.vehicle, now):
            self.server.receive(message, now, GROUND)
        self._fly(now)
        for out in self.server.messages_to_send():
            self.down.send(self.vehicle.encode(out.message), now)
        for message in self._through(self.down, self.ground, now):
            self.client.receive(message, now)
        self.client.handle_timer(now)
        for message in self.client.messages_to_send():
            self.up.send(self.ground.encode(message), now)
        self.done += [event for event in self.client.events() if isinstance(event, CommandDone)]

    def _through(self, pipe, codec, now):
        return [message for data in pipe.receive(now) for message in codec.decode(data)]

    def _fly(self, now):
        for event in self.server.events():
            if isinstance(event, CommandRequested):
                self.begun += 1
                self.running[event.request] = now + self.TAKES
            elif isinstance(event, CommandCancelRequested):
                self._end(event.request, CANCELLED, now)
        for request, end in list(self.running.items()):
            if now >= end:
                self._end(request, ACCEPTED, now)
            elif now >= self.next_progress:
                self.next_progress = now + 0.5
                self.server.acknowledge(request, IN_PROGRESS, now, progress=50)

    def _end(self, request, result, now):
        del self.running[request]
        self.ends.append(result)
        self.server.acknowledge(request, result, now)


@pytest.mark.parametrize("seed", range(20))
def test_on_a_bad_link_a_long_command_runs_once_and_both_ends_agree_on_the_result(seed):
    flight = Flight(seed, drop=0.3, duplicate=0.2, reorder=0.3, delay=0.1)
    flight.client.send(long(), 0.0)
    flight.run(until=30.0)
    assert (flight.begun, flight.ends) == (1, [ACCEPTED])
    assert [event.result for event in flight.done] == [ACCEPTED]


@pytest.mark.parametrize("seed", range(20))
def test_on_a_bad_link_a_cancel_stops_a_command_and_both_ends_agree_on_the_result(seed):
    flight = Flight(seed, drop=0.3, duplicate=0.2, reorder=0.3, delay=0.1)
    request = flight.client.send(long(), 0.0)
    flight.run(until=1.5)
    flight.client.request_cancel(request, flight.clock.now)
    flight.run(until=30.0)
    assert flight.begun == 1
    assert [event.result for event in flight.done] == flight.ends
