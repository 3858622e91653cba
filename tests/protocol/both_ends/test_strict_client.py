"""An uploader that only does what the protocol requires, with the timeouts of MAVSDK and QGroundControl."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.server.mission_server import MissionServer
from protocol.wire.codec import Codec
from protocol.wire.message import Peer
from tests.support.links.link import plan
from tests.support.links.lossy_pipe import LossyPipe

GROUND, ITEMS = Peer(255, 190, "ground"), plan(20)
TRIES = 5


class StrictUploader:
    """Repeats its MISSION_COUNT; sends items only when they are requested.

    It ignores a request that is ahead of its count, and fails on an early ack, on an item asked for too often, and on
    silence.
    """

    def __init__(self, wait):
        self.wait, self.out, self.result = wait, [], None
        self.next, self.tries = 0, 0
        self.deadline = wait
        self.send_count()

    def send_count(self):
        self.out.append(mavlink.MAVLink_mission_count_message(1, 1, len(ITEMS)))

    def receive(self, message, now):
        if self.result is not None:
            return
        if message.get_type() == "MISSION_ACK":
            is_end = message.type == 0 and self.next == len(ITEMS)
            self.end("accepted" if is_end else f"ack {message.type} before item {self.next}")
        elif message.get_type() != "MISSION_REQUEST_INT":
            self.end(f"{message.get_type()} is no answer")
        elif message.seq <= self.next:
            self.serve(message.seq, now)

    def serve(self, seq, now):
        self.tries = 0 if seq == self.next else self.tries
        if self.tries >= TRIES:
            self.end(f"{seq} asked for too often")
            return
        self.out.append(ITEMS[seq].to_message(seq, 1, 1))
        self.next, self.tries, self.deadline = seq + 1, self.tries + 1, now + self.wait

    def handle_timer(self, now):
        if now < self.deadline:
            return
        self.tries, self.deadline = self.tries + 1, now + self.wait
        if self.tries > TRIES:
            self.end("silence")
        elif self.next == 0:
            self.send_count()

    def end(self, result):
        self.result, self.deadline = result, math.inf


def upload(wait, seed, **losses):
    """The result of an upload, and the plan on the vehicle afterwards."""
    client, server = StrictUploader(wait), MissionServer(1, 1, validate=lambda _items: None)
    up, down = LossyPipe(seed, **losses), LossyPipe(seed + 1000, **losses)
    ground, vehicle, now = Codec(255, 190), Codec(1, 1), 0.0
    while client.result is None:
        for message in client.out:
            up.send(ground.encode(message), now)
        client.out = []
        for outgoing in server.messages_to_send():
            down.send(vehicle.encode(outgoing.message), now)
        now = min(client.deadline, server.next_deadline(), up.next_arrival(), down.next_arrival())
        for message in [m for data in up.receive(now) for m in vehicle.decode(data)]:
            server.receive(message, now, GROUND)
        for message in [m for data in down.receive(now) for m in ground.decode(data)]:
            client.receive(message, now)
        server.handle_timer(now)
        client.handle_timer(now)
    return client.result, server.items


@pytest.mark.parametrize("wait", [0.5, 1.5])
@pytest.mark.parametrize("delay", [0.0, 0.02, 0.2])
def test_a_strict_client_uploads_over_any_round_trip_that_its_own_waits_allow(wait, delay):
    assert upload(wait, 0, delay=delay) == ("accepted", ITEMS)


@pytest.mark.parametrize("wait", [0.5, 1.5])
@pytest.mark.parametrize(
    ("losses", "excused"),
    [
        ({"drop": 0.05}, "silence"),  # the last ack was lost, and the client does not request it again
        ({"duplicate": 0.05}, "ack 0 before item 19"),  # a late request set the client back before the ack
        ({"reorder": 0.1}, ""),
    ],
)
def test_a_strict_client_uploads_over_an_imperfect_link(wait, losses, excused):
    outcomes = [upload(wait, seed, delay=0.02, **losses) for seed in range(10)]
    assert [present == ITEMS for _, present in outcomes] == [True] * 10
    results = [result for result, _ in outcomes]
    assert set(results) <= {"accepted", excused}
    assert results.count("accepted") >= 8
