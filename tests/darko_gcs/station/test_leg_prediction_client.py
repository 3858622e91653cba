"""Asks the vehicle what legs would take, again if there is no answer."""

import pytest

from darko_gcs.state.values import LegChain
from darko_gcs.station.leg_prediction_client import FRESH_TIME, MAX_REPETITIONS, REST, LegPredictionClient
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode

ONE = LegChain(((0.0, 0.0, -5.0), (9.0, 0.0, -5.0)), (LegMode.HOVER,))
TWO = LegChain(((0.0, 0.0, -5.0), (9.0, 0.0, -5.0), (9.0, 9.0, -5.0)), (LegMode.NONE, LegMode.NONE), 0.5, 2.0, 15.0)


class SentMessages:
    """In place of an endpoint with a vehicle."""

    is_present, vehicle = True, (1, 1)

    def __init__(self):
        self.sent = []

    def send(self, message):
        self.sent.append(message)


@pytest.fixture
def endpoint():
    return SentMessages()


@pytest.fixture
def client(endpoint):
    return LegPredictionClient(endpoint)


def answer(request, time=10.0):
    rows = [[time] * 8 for _ in range(4)]
    return mavlink.MAVLink_darko_legs_prediction_message(
        request.request, *rows, 255, 190, request.count, [LegMode.HOVER] * 8, [0] * 8
    )


def test_chains_are_asked_about_one_after_the_other(client, endpoint):
    client.want([ONE, TWO], 0.0)
    (first,) = endpoint.sent
    assert (first.count, list(first.x[:2]), list(first.asked[:2])) == (1, [0.0, 9.0], [LegMode.HOVER, 0])
    client.receive(answer(first), 0.1)
    second = endpoint.sent[1]
    assert (second.count, second.hover_speed, second.airspeed, second.heading) == (2, 2.0, 15.0, 0.5)
    client.receive(answer(second), 0.2)
    assert len(endpoint.sent) == 2
    assert [len(client.known[chain]) for chain in (ONE, TWO)] == [1, 2]
    assert client.known[ONE][0].chosen == (10.0, 10.0)


def test_an_old_answer_is_asked_for_again_and_stays_until_then(client, endpoint):
    client.want([ONE], 0.0)
    client.receive(answer(endpoint.sent[0]), 0.1)
    client.want([ONE], FRESH_TIME)
    assert len(endpoint.sent) == 1
    client.want([ONE], FRESH_TIME + 0.2)
    assert client.known[ONE][0].hover_time == 10.0
    client.receive(answer(endpoint.sent[1], 12.0), 11.0)
    assert client.known[ONE][0].hover_time == 12.0


def test_an_answer_to_another_request_is_not_taken(client, endpoint):
    client.want([ONE], 0.0)
    late = answer(endpoint.sent[0])
    late.request += 1
    client.receive(late, 0.1)
    assert client.known == {}


def test_a_silent_vehicle_is_asked_some_times_and_then_left_alone(client, endpoint):
    client.want([ONE], 0.0)
    for tenth in range(1, 60):
        client.handle_timer(tenth / 10)
    assert len(endpoint.sent) == 1 + MAX_REPETITIONS
    client.handle_timer(3.0 + REST)
    assert len(endpoint.sent) == 2 + MAX_REPETITIONS


def test_what_is_not_wanted_any_more_is_forgotten(client, endpoint):
    client.want([ONE], 0.0)
    client.receive(answer(endpoint.sent[0]), 0.1)
    client.want([TWO], 0.2)
    assert ONE not in client.known
    client.forget()
    assert client.known == {}
