"""The parameter client: a complete table, confirmed settings."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.client.parameter_client import MAX_CONTRADICTIONS, MAX_OPEN_PARAMETER_REQUESTS, ParameterClient
from protocol.engines.parameter_values import decode_value, encode_value
from protocol.engines.retransmission import Remote
from protocol.events import ParameterConfirmed, ParameterFailed, ParameterReceived, ParametersComplete
from protocol.wire.codec import Codec

REAL32, INT32, INT8 = 9, 6, 2


VEHICLE = (1, 1)


def value_of(name, value, kind, count=1, index=0):
    return mavlink.MAVLink_param_value_message(name.encode(), encode_value(value, kind), kind, count, index)


def test_missing_parameters_are_requested_by_index():
    client = ParameterClient(255, 190)
    client.request_all(VEHICLE, 0.0)
    client.messages_to_send()
    for index in (0, 1, 3):
        client.receive(value_of(f"P{index}", 0.5, REAL32, count=5, index=index), 0.1)
    client.handle_timer(client.next_deadline())
    assert [m.param_index for m in client.messages_to_send()] == [2, 4]
    for index in (2, 4):
        client.receive(value_of(f"P{index}", 0.5, REAL32, count=5, index=index), 1.0)
    assert client.events()[-1] == ParametersComplete(5)
    assert not client.is_busy


def test_missing_parameters_are_not_all_requested_at_once():
    client = ParameterClient(255, 190)
    client.request_all(VEHICLE, 0.0)
    client.messages_to_send()
    client.receive(value_of("P0", 0.5, REAL32, count=200), 0.1)
    client.handle_timer(client.next_deadline())
    assert len(client.messages_to_send()) == MAX_OPEN_PARAMETER_REQUESTS


def test_a_silent_vehicle_fails_the_list():
    client = ParameterClient(255, 190)
    client.request_all(VEHICLE, 0.0)
    while (now := client.next_deadline()) < math.inf:
        client.handle_timer(now)
    assert client.events() == [ParameterFailed("", "all parameters missing")]


def test_a_table_that_changes_its_size_is_downloaded_anew():
    client = ParameterClient(255, 190)
    client.request_all(VEHICLE, 0.0)
    client.receive(value_of("P0", 0.5, REAL32, count=2, index=0), 0.0)
    client.receive(value_of("P1", 0.5, REAL32, count=3, index=1), 0.0)
    client.handle_timer(client.next_deadline())
    assert [m.param_index for m in client.messages_to_send()[1:]] == [0, 2]


def test_a_parameter_of_unknown_type_is_read_before_it_is_set():
    client = ParameterClient(255, 190)
    client.set(VEHICLE, "MODE", 5, 0.0)
    assert [m.get_type() for m in client.messages_to_send()] == ["PARAM_REQUEST_READ"]
    client.receive(value_of("MODE", -3, INT32), 0.1)
    (message,) = client.messages_to_send()
    assert (message.param_type, decode_value(message.param_value, INT32)) == (INT32, 5)
    client.receive(value_of("MODE", 5, INT32), 0.2)
    assert client.events()[-1] == ParameterConfirmed("MODE", 5)
    assert not client.is_busy


def test_an_older_value_does_not_end_a_setting():
    client = ParameterClient(255, 190)
    client.receive(value_of("P", 1.0, REAL32), 0.0)
    client.set(VEHICLE, "P", 2.0, 0.0)
    client.receive(value_of("P", 1.0, REAL32), 0.1)
    assert client.is_busy
    client.receive(value_of("P", 2.0, REAL32), 0.2)
    assert client.events()[-1] == ParameterConfirmed("P", 2.0)


@pytest.mark.parametrize(
    "late", [value_of("P", 2.0, REAL32), mavlink.MAVLink_param_error_message(255, 190, b"P", 0, 2)]
)
def test_frames_from_before_a_setting_neither_confirm_nor_fail_it(late):
    remote, vehicle, ground = Remote(), Codec(1, 1), Codec(255, 190)
    frames = [ground.decode(vehicle.encode(m))[0] for m in (value_of("P", 1.0, REAL32), late)]
    client = ParameterClient(255, 190, remote)
    for frame in frames:
        remote.hear(frame, 0.0)
    client.receive(frames[0], 0.0)
    client.set(VEHICLE, "P", 2.0, 0.0)
    client.receive(frames[1], 0.1)
    assert client.is_busy


def test_a_setting_fails_with_the_value_the_vehicle_keeps():
    client = ParameterClient(255, 190)
    client.receive(value_of("P", 1.0, REAL32), 0.0)
    client.set(VEHICLE, "P", 2.0, 0.0)
    while (now := client.next_deadline()) < math.inf:
        client.receive(value_of("P", 1.0, REAL32), now)
        client.handle_timer(now)
    assert client.events()[-1] == ParameterFailed("P", "the vehicle keeps 1")
    assert len(client.messages_to_send()) == MAX_CONTRADICTIONS


def test_a_param_error_fails_a_setting_at_once():
    client = ParameterClient(255, 190)
    client.set(VEHICLE, "NO_SUCH", 1.0, 0.0)
    client.receive(mavlink.MAVLink_param_error_message(255, 190, b"NO_SUCH", -1, 1), 0.1)
    assert client.events() == [ParameterFailed("NO_SUCH", "DOES_NOT_EXIST")]


def test_a_value_that_does_not_fit_its_type_is_not_sent():
    client = ParameterClient(255, 190)
    client.receive(value_of("N", 1, INT8), 0.0)
    client.set(VEHICLE, "N", 300, 0.0)
    assert client.messages_to_send() == []
    assert isinstance(client.events()[-1], ParameterFailed)


def test_answers_without_an_index_do_not_count_towards_the_list():
    client = ParameterClient(255, 190)
    client.request_all(VEHICLE, 0.0)
    client.receive(value_of("P0", 1.0, REAL32, count=1, index=0xFFFF), 0.0)
    assert client.is_busy
    assert client.events() == [ParameterReceived(name="P0", value=1.0, type=REAL32, index=0xFFFF, count=1)]


def test_cancelling_ends_list_and_settings():
    client = ParameterClient(255, 190)
    client.request_all(VEHICLE, 0.0)
    client.set(VEHICLE, "P", 1.0, 0.0)
    client.cancel("closed")
    assert client.events() == [ParameterFailed("", "closed"), ParameterFailed("P", "closed")]
    assert client.next_deadline() == math.inf
