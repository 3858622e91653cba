"""Messages that only those links get which ask for one of their family."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.server.stream_server import StreamServer
from protocol.events import CommandRequested, MessageRequested
from protocol.wire.message import Peer

ACCEPTED, REJECTED, DENIED, UNSUPPORTED = 0, 1, 2, 3
SET, GET, REQUEST = 511, 510, 512
ATTITUDE, OTHER = 30, 436
STATE, MOTORS, EVENT = 53000, 53001, 53003  # of one family
DEFAULTS = {ATTITUDE: 50_000, STATE: 100_000, MOTORS: 50_000, OTHER: 2_000_000}
NOBODY, EVERYBODY = (), None


class Server:
    """A server with links ``a`` and ``b``."""

    def __init__(self, *, shared=False, defaults=DEFAULTS):
        self.links = dict.fromkeys("ab")
        self.server = StreamServer(
            1, 1, defaults, families=[{STATE, MOTORS, EVENT}, {OTHER}], links=None if shared else self.links.keys()
        )
        self.now_us = 0

    def ask(self, key, command, *params):
        seven = (*params, *(math.nan,) * (7 - len(params)))
        request = CommandRequested(request=1, command=command, params=seven, frame=None, peer=Peer(255, 190, key))
        return self.server.serve(request, self.now_us / 1e6)

    def interval(self, key, number):
        assert self.ask(key, GET, number) == ACCEPTED
        ((_, message),) = self.server.messages_to_send()
        return message.interval_us

    def rates(self, seconds=2):
        """Messages a second that each link gets."""
        for _ in range(50):  # past the first message after a change
            self.server.due(self.now_us)
            self.now_us += 10_000
        got = {key: {} for key in self.links}
        for _ in range(seconds * 100):
            for number, audience in self.server.due(self.now_us).items():
                for key in self.links if audience is None else audience:
                    got[key][number] = got[key].get(number, 0) + 1 / seconds
            self.now_us += 10_000
        return got


@pytest.fixture
def server():
    return Server()


def test_a_link_that_did_not_ask_gets_nothing_of_the_family(server):
    assert server.rates() == {key: {ATTITUDE: 20} for key in "ab"}
    assert server.interval("a", STATE) == -1
    assert server.server.audience(EVENT) == NOBODY
    assert server.server.audience(ATTITUDE) == EVERYBODY


@pytest.mark.parametrize("how", [(REQUEST, STATE), (REQUEST, MOTORS, 0.0), (SET, STATE, 0.0), (SET, STATE)])
def test_one_request_brings_the_whole_family_to_the_asking_link_alone(server, how):
    before = server.rates()["b"]
    assert server.ask("a", *how) == ACCEPTED
    assert server.rates() == {"a": {ATTITUDE: 20, STATE: 10, MOTORS: 20}, "b": before}
    assert [server.interval(key, MOTORS) for key in "ab"] == [50_000, -1]
    assert server.server.audience(EVENT) == ("a",)
    assert server.server.audience(OTHER) == NOBODY


def test_what_is_asked_for_comes_in_step_with_the_rest(server):
    server.server.due(130_000)
    server.ask("a", REQUEST, STATE)
    due = {time: server.server.due(time) for time in range(130_000, 300_000, 10_000)}
    assert [time for time, numbers in due.items() if STATE in numbers] == [200_000]
    assert [time for time, numbers in due.items() if MOTORS in numbers] == [150_000, 200_000, 250_000]


def test_a_request_for_one_message_is_answered_with_it(server):
    server.ask("a", REQUEST, STATE)
    assert server.server.events() == [MessageRequested(STATE, 0.0, Peer(255, 190, "a"))]


def test_the_interval_asked_for_is_that_of_the_one_message(server):
    assert server.ask("a", SET, STATE, 1e6) == ACCEPTED
    assert server.rates()["a"] == {ATTITUDE: 20, STATE: 1, MOTORS: 20}
    assert server.ask("a", REQUEST, STATE) == ACCEPTED  # changes no interval
    assert server.interval("a", STATE) == 1_000_000


@pytest.mark.parametrize("how", [(SET, STATE, -1.0), (GET, STATE), (SET, STATE, math.inf), (SET, EVENT, 1e5)])
def test_what_does_not_ask_for_a_message_brings_none(server, how):
    server.ask("a", *how)
    assert server.rates()["a"] == {ATTITUDE: 20}
    assert set(server.server.intervals) == {None}


def test_an_unknown_event_of_a_family_is_unsupported(server):
    assert server.ask("a", REQUEST, EVENT) == UNSUPPORTED


def test_a_link_that_stops_every_stream_of_a_family_is_as_before(server):
    server.ask("a", REQUEST, STATE)
    server.ask("a", SET, STATE, -1.0)
    assert server.server.audience(EVENT) == ("a",)
    server.ask("a", SET, MOTORS, -1.0)
    assert server.server.audience(EVENT) == NOBODY
    assert set(server.server.intervals) == {None}


def test_the_request_is_forgotten_with_the_link(server):
    server.ask("a", REQUEST, STATE)
    del server.links["a"]
    assert server.server.audience(EVENT) == NOBODY
    server.links["a"] = None
    assert server.rates()["a"] == {ATTITUDE: 20}


def test_data_streams_leave_the_families_alone(server):
    message = mavlink.MAVLink_request_data_stream_message(1, 1, mavlink.MAV_DATA_STREAM_ALL, 4, 1)
    server.server.receive(message, 0.0, Peer(255, 190, "a"))
    assert server.rates()["a"] == {ATTITUDE: 4}


def test_links_that_cannot_be_distinguished_all_get_what_one_asks_for():
    shared = Server(shared=True)
    assert shared.server.audience(EVENT) == NOBODY
    shared.ask("a", REQUEST, STATE)
    assert shared.server.audience(EVENT) == EVERYBODY
    assert shared.rates()["b"] == {ATTITUDE: 20, STATE: 10, MOTORS: 20}


@pytest.mark.parametrize("how", [(REQUEST, STATE), (SET, STATE, 0.0)])
def test_a_family_that_is_too_much_for_the_link_is_refused(how):
    many = dict.fromkeys(range(30, 50), 10000)  # 2000 messages a second
    server = Server(defaults=DEFAULTS | many)
    assert server.ask("a", *how) == REJECTED
    assert server.interval("a", STATE) == -1
    assert not any(isinstance(event, MessageRequested) for event in server.server.events())
