"""The parameter client: a complete table, confirmed settings."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.base import Remote
from protocol.engines.client.parameter_client import MAX_CONTRADICTIONS, MAX_OPEN_PARAMETER_REQUESTS, ParameterClient
from protocol.engines.table_values import ValueEncoding, decode_value, encode_value
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


ARDUPILOT, PX4, GENERIC = 3, 12, 0
BYTEWISE_BIT, C_CAST_BIT = 1 << 4, 1 << 17


def heartbeat(autopilot):
    return mavlink.MAVLink_heartbeat_message(2, autopilot, 81, 0, 4, 3)


def version(capabilities):
    return mavlink.MAVLink_autopilot_version_message(capabilities, 0, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0)


def cast(name, value, kind, count=1, index=0):
    return mavlink.MAVLink_param_value_message(name.encode(), float(value), kind, count, index)


@pytest.mark.parametrize(
    ("autopilot", "capabilities", "sent"),
    [
        (ARDUPILOT, 0, 2.0),
        (ARDUPILOT, C_CAST_BIT, 2.0),
        (ARDUPILOT, BYTEWISE_BIT, encode_value(2, INT8)),
        (PX4, 0, encode_value(2, INT8)),
        (PX4, C_CAST_BIT, 2.0),
        (GENERIC, C_CAST_BIT, 2.0),
        (GENERIC, 0, encode_value(2, INT8)),
        (ARDUPILOT, BYTEWISE_BIT | C_CAST_BIT, 2.0),
    ],
)
def test_an_integer_is_sent_as_capabilities_or_else_the_autopilot_say(autopilot, capabilities, sent):
    client = ParameterClient(255, 190)
    client.receive(heartbeat(autopilot), 0.0)
    client.receive(version(capabilities), 0.0)
    client.set(VEHICLE, "FENCE_ACTION", 2, 0.0)
    client.receive(mavlink.MAVLink_param_value_message(b"FENCE_ACTION", 0.0, INT8, 1, 0), 0.1)
    message = client.messages_to_send()[-1]
    assert (message.get_type(), message.param_value, message.param_type) == ("PARAM_SET", sent, INT8)
    client.receive(mavlink.MAVLink_param_value_message(b"FENCE_ACTION", sent, INT8, 1, 0), 0.2)
    assert client.events()[-1] == ParameterConfirmed("FENCE_ACTION", 2)


def test_an_integer_that_a_float_does_not_hold_is_not_sent_to_an_autopilot_that_takes_floats():
    client = ParameterClient(255, 190)
    client.receive(heartbeat(ARDUPILOT), 0.0)
    client.receive(cast("SERIAL", 1, INT32), 0.0)
    client.set(VEHICLE, "SERIAL", 2**24 + 1, 0.0)
    assert client.messages_to_send() == []
    assert "24 bits" in client.events()[-1].reason


def test_an_unknown_autopilot_is_asked_for_its_capabilities_before_a_parameter_is_set():
    client = ParameterClient(255, 190)
    client.receive(heartbeat(GENERIC), 0.0)
    client.receive(cast("N", 1, INT8), 0.0)
    client.set(VEHICLE, "N", 2, 0.0)
    asked = client.messages_to_send()
    assert [m.get_type() for m in asked] == ["COMMAND_LONG", "PARAM_REQUEST_READ"]
    assert (asked[0].command, asked[0].param1) == (512, 148)
    client.receive(version(C_CAST_BIT), 0.1)
    client.receive(cast("N", 1, INT8), 0.1)
    assert client.messages_to_send()[-1].param_value == 2.0


def test_a_list_that_was_read_in_the_other_encoding_is_read_again():
    client = ParameterClient(255, 190)
    client.receive(heartbeat(GENERIC), 0.0)
    client.request_all(VEHICLE, 0.0)
    client.receive(cast("N", 1, INT8), 0.0)
    client.messages_to_send()
    client.receive(version(C_CAST_BIT), 0.1)
    assert client.messages_to_send()[-1].get_type() == "PARAM_REQUEST_LIST"
    client.receive(cast("N", 1, INT8), 0.2)
    received = [event for event in client.events() if isinstance(event, ParameterReceived)]
    assert [event.value for event in received] == [0, 1.0]
    assert client.encoding is ValueEncoding.C_CAST
