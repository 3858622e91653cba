"""The station asks the vehicle for DARKO_* and CONTROL_STATUS, and again when they stop."""

import pytest

from darko_gcs.station.family_requests import REQUESTED, SILENCE, FamilyRequests
from protocol.dialect import mavlink
from protocol.events import CommandDone, VehicleFound, VehicleLost, VehicleReturned
from protocol.wire.codec import Codec
from tests.support.gcs.linked_station import LinkedStation
from tests.support.vehicle.darko_messages import hybrid_state

REQUEST = mavlink.MAV_CMD_REQUEST_MESSAGE


@pytest.fixture
def link(tmp_path):
    return LinkedStation(tmp_path)


def asked(link):
    """Ids of the messages that the station has requested, in order, as they reached the vehicle."""
    messages = [message for data in link.sent for message in Codec(1, 1).decode(data)]
    return [round(m.param1) for m in messages if m.get_type() == "COMMAND_LONG" and m.command == REQUEST]


def has_all(link):
    return None not in {
        link.snapshot.hybrid.state,
        link.snapshot.actuation.actuators,
        link.snapshot.estimates.air,
        link.snapshot.battery.energy,
    }


@pytest.mark.long
def test_a_vehicle_that_appears_is_asked_once_and_quietly(link):
    assert link.run(3.0, lambda: has_all(link))
    link.run(20.0)
    assert asked(link) == list(REQUESTED)
    assert not [line for line in link.lines if "message" in line.lower()]


def test_a_vehicle_that_restarts_is_asked_again(link):
    link.run(5.0)
    link.start_vehicle(up=3.0)
    link.run(4.0)
    assert asked(link) == list(REQUESTED) * 2
    before = link.snapshot.hybrid.state.time
    link.run(1.0)
    assert link.snapshot.hybrid.state.time > before


@pytest.mark.long
def test_a_vehicle_that_has_forgotten_the_station_is_asked_again(link):
    link.run(3.0)
    link.vehicle.endpoint._streams._own.clear()
    link.run(1.0)
    before = link.snapshot.hybrid.state.time
    link.run(SILENCE + 1.0)
    assert sorted(asked(link)) == sorted(REQUESTED * 2)
    assert link.snapshot.hybrid.state.time > before + 0.5


class Endpoint:
    """Takes requests; a test answers them."""

    def __init__(self):
        self.is_present, self.requests = True, []

    def command(self, _command, message_id, *_params, now):
        self.requests.append((round(message_id), now))
        return len(self.requests)


class Asking:
    """The requests of a station whose vehicle has just been found."""

    def __init__(self):
        self.endpoint = Endpoint()
        self.requests = FamilyRequests(self.endpoint)
        self.requests.handle_timer(0.0)
        assert not self.endpoint.requests
        self.requests.follow(VehicleFound(1, 1), 1.0)
        self.requests.handle_timer(1.0)

    def answer(self, request, result, now=1.5):
        self.requests.follow(CommandDone(request, REQUEST, result, ""), now)

    def times(self, until=60):
        """Times at which the first message is requested, with one look a second [s]."""
        for now in range(2, until):
            self.requests.handle_timer(float(now))
        return [now for number, now in self.endpoint.requests if number == REQUESTED[0]]


@pytest.mark.parametrize("result", [mavlink.MAV_RESULT_UNSUPPORTED, mavlink.MAV_RESULT_DENIED])
def test_a_vehicle_without_such_messages_is_not_asked_again_until_it_returns(result):
    asking = Asking()
    asking.answer(1, result)
    assert asking.times() == [1.0]
    asking.requests.follow(VehicleReturned(5.0), 60.0)
    asking.requests.handle_timer(60.0)
    assert asking.times()[-1] == 60.0


@pytest.mark.parametrize("result", [None, mavlink.MAV_RESULT_TEMPORARILY_REJECTED])
def test_a_vehicle_that_did_not_or_could_not_answer_is_asked_later(result):
    asking = Asking()
    asking.answer(1, result)
    assert asking.times() == [1.0, 2.0 + SILENCE]


def test_no_request_is_repeated_while_it_waits_for_its_answer():
    asking = Asking()
    asking.requests.receive(hybrid_state(10), 1.2)
    assert asking.times() == [1.0]


def test_a_lost_vehicle_is_not_asked():
    asking = Asking()
    asking.answer(1, None)
    asking.endpoint.is_present = False
    asking.requests.follow(VehicleLost(3.0), 4.0)
    assert asking.times() == [1.0]


def test_the_answers_are_no_events_of_the_operators(link):
    link.run(5.0)
    assert has_all(link)
    assert link.events_of(CommandDone) == []
