"""The laws of the parameter protocol, both sides."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.engines.base import Peer
from protocol.engines.parameter_client import ASKED_AT_ONCE, CONTRADICTIONS, ParameterClient
from protocol.engines.parameter_server import EXTENDED, ParameterServer
from protocol.engines.parameters import Parameter, decode_value, encode_value
from protocol.engines.retransmission import Partner
from protocol.errors import LocalProtocolError
from protocol.events import (
    ParameterChanged,
    ParameterConfirmed,
    ParameterFailed,
    ParameterReceived,
    ParameterRefused,
    ParametersComplete,
)

REAL32, INT32, INT8, UINT16, UINT64, REAL64 = 9, 6, 2, 3, 7, 10
VEHICLE, GROUND = (1, 1), Peer(255, 190, "ground")
LIMITS = {
    1: (0, 255),
    INT8: (-128, 127),
    UINT16: (0, 65535),
    4: (-(2**15), 2**15 - 1),
    5: (0, 10**6),
    INT32: (0, 10**6),
}


def server(count=12):
    floats = [Parameter(f"P{n}", REAL32, n / 2, -100.0, 100.0) for n in range(count - 1)]
    return ParameterServer(1, 1, [*floats, Parameter("MODE", INT32, -3, -10, 10)])


def value_of(name, value, kind, count=1, index=0):
    return mavlink.MAVLink_param_value_message(name.encode(), encode_value(value, kind), kind, count, index)


def set_message(name, value, kind):
    return mavlink.MAVLink_param_set_message(1, 1, name.encode(), encode_value(value, kind), kind)


def raw_set(name, carried, kind):
    return mavlink.MAVLink_param_set_message(1, 1, name.encode(), carried, kind)


def read(name="", index=-1):
    return mavlink.MAVLink_param_request_read_message(1, 1, name.encode(), index)


def errors(out):
    return [o.message.error for o in out if o.message.get_type() == "PARAM_ERROR"]


# The value on the wire


@given(st.sampled_from(sorted(LIMITS)).flatmap(lambda k: st.tuples(st.just(k), st.integers(*LIMITS[k]))))
def test_integers_survive_as_bytes(case):
    kind, number = case
    assert decode_value(encode_value(number, kind), kind) == number


@given(st.floats(width=32, allow_nan=False))
def test_floats_survive_as_floats(number):
    assert decode_value(encode_value(number, REAL32), REAL32) == number


@pytest.mark.parametrize(
    ("value", "kind"), [(300, INT8), (1.5, INT32), (-1, UINT16), (1, 7), (1e39, REAL32), (math.nan, 6)]
)
def test_what_a_type_cannot_hold_is_refused(value, kind):
    with pytest.raises(LocalProtocolError):
        encode_value(value, kind)


def test_an_integer_whose_bytes_are_a_signalling_nan_is_refused_not_bent():
    with pytest.raises(LocalProtocolError):
        encode_value(-5_000_000, INT32)


@pytest.mark.parametrize(
    "row",
    [
        {"name": "A_NAME_OF_17_CHAR"},
        {"name": ""},
        {"name": "HÖHE"},
        {"value": 2.0, "maximum": 1.0},
        {"value": math.inf},
        {"type": INT8, "value": 0.5},
    ],
)
def test_a_row_that_cannot_be_told_is_refused(row):
    with pytest.raises(LocalProtocolError):
        Parameter(**{"name": "P", "type": REAL32, "value": 0.0} | row)


def test_two_parameters_cannot_share_a_name():
    with pytest.raises(LocalProtocolError):
        ParameterServer(1, 1, [Parameter("P", REAL32, 0.0)] * 2)


# The vehicle's side


def test_a_list_comes_whole_in_order_and_in_small_portions():
    engine, portions = server(), []
    engine.receive(mavlink.MAVLink_param_request_list_message(1, 1), 0.0, GROUND)
    while (now := engine.next_deadline()) < math.inf:
        engine.handle_timer(now)
        portions.append(engine.messages_to_send())
    out = [o for portion in portions for o in portion]
    assert [(o.message.param_index, o.message.param_count) for o in out] == [(n, 12) for n in range(12)]
    assert max(map(len, portions)) == 5
    assert {o.peer for o in out} == {GROUND}


def test_who_asks_for_the_list_again_and_again_quickens_nobodys():
    engine, told = server(200), []
    for step in range(100):  # one millisecond apart
        engine.receive(mavlink.MAVLink_param_request_list_message(1, 1), step / 1e3, Peer(step % 8, 1, step))
        if step / 1e3 >= engine.next_deadline():
            engine.handle_timer(step / 1e3)
        told += engine.messages_to_send()
    assert len(told) <= 10 * 8 * 5  # five of each list every 10 ms


def test_one_parameter_is_told_by_index_and_by_name():
    engine = server()
    for request in (read(index=3), read("P3")):
        engine.receive(request, 0.0, GROUND)
    assert [(o.message.param_id, o.message.param_index) for o in engine.messages_to_send()] == [("P3", 3)] * 2


@pytest.mark.parametrize("request_", [read("NO_SUCH"), read(index=12), read(index=-5)])
def test_what_does_not_exist_is_said_to_the_one_who_asked(request_):
    engine = server()
    engine.receive(request_, 0.0, GROUND)
    out = engine.messages_to_send()
    assert errors(out) == [mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST]
    assert out[0].peer == GROUND


def test_a_new_value_is_told_to_everyone_and_reported_once():
    engine = server()
    for _ in range(2):
        engine.receive(set_message("P3", 7.25, REAL32), 0.0, GROUND)
    out = engine.messages_to_send()
    assert [(o.peer, o.message.param_value) for o in out] == [(None, 7.25)] * 2
    assert engine.events() == [ParameterChanged("P3", 7.25)]
    assert engine.value("P3") == 7.25


RANGE, MISMATCH, UNKNOWN_TYPE = 2, 7, 6


@pytest.mark.parametrize(
    ("message", "error", "reason"),
    [
        (set_message("P3", 101.0, REAL32), RANGE, "outside"),
        (set_message("P3", math.nan, REAL32), RANGE, "finite"),
        (set_message("P3", 5, INT32), MISMATCH, "INT32 is the wrong type, it is REAL32"),
        (raw_set("P3", 1.0, UINT64), UNKNOWN_TYPE, "UINT64 is the wrong type"),
        (raw_set("P3", 1.0, REAL64), UNKNOWN_TYPE, "REAL64 is the wrong type"),
        (raw_set("P3", 1.0, UINT16), UNKNOWN_TYPE, "UINT16 is the wrong type"),
        (raw_set("P3", 1.0, 0), UNKNOWN_TYPE, "type 0 is the wrong type"),
        (raw_set("P3", 1.0, 255), UNKNOWN_TYPE, "type 255 is the wrong type"),
    ],
)
def test_a_refused_value_leaves_the_old_one_and_everyone_is_told_that(message, error, reason):
    engine = server()
    engine.receive(message, 0.0, GROUND)
    out = engine.messages_to_send()
    assert errors(out) == [error]
    told = [o for o in out if o.message.get_type() == "PARAM_VALUE"]
    assert [(o.peer, o.message.param_value) for o in told] == [(None, 1.5)]
    (event,) = engine.events()
    assert isinstance(event, ParameterRefused)
    assert reason in event.reason


def test_an_integer_is_taken_from_a_client_that_knows_only_floats():
    engine = server()
    engine.receive(set_message("MODE", 5.0, REAL32), 0.0, GROUND)
    (told,) = engine.messages_to_send()
    assert (told.message.param_type, decode_value(told.message.param_value, INT32)) == (INT32, 5)
    assert engine.events() == [ParameterChanged("MODE", 5)]
    assert isinstance(engine.value("MODE"), int)


@pytest.mark.parametrize(
    ("value", "error", "reason"),
    [
        (1.5, MISMATCH, "wrong type"),
        (1e30, MISMATCH, "wrong type"),
        (math.inf, MISMATCH, "wrong type"),
        (50.0, RANGE, "outside"),
    ],
)
def test_a_float_that_no_integer_can_hold_is_refused(value, error, reason):
    engine = server()
    engine.receive(set_message("MODE", value, REAL32), 0.0, GROUND)
    assert errors(engine.messages_to_send()) == [error]
    (event,) = engine.events()
    assert reason in event.reason
    assert engine.value("MODE") == -3


def test_setting_what_does_not_exist_is_an_error_and_nothing_else():
    engine = server()
    engine.receive(set_message("NO_SUCH", 1.0, REAL32), 0.0, GROUND)
    assert errors(engine.messages_to_send()) == [mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST]
    assert engine.events() == []


def test_the_errors_are_numbered_as_the_standard_numbers_them():
    names = ("TYPE_UNSUPPORTED", "TYPE_MISMATCH", "READ_FAIL")
    assert [getattr(mavlink, f"MAV_PARAM_ERROR_{name}") for name in names] == [6, 7, 8]


def test_an_extended_set_is_answered_as_unsupported_to_who_sent_it():
    engine = server()
    engine.receive(mavlink.MAVLink_param_ext_set_message(1, 1, b"P3", b"5", REAL32), 0.0, GROUND)
    (out,) = engine.messages_to_send()
    assert (out.peer, out.message.get_type()) == (GROUND, "PARAM_EXT_ACK")
    assert out.message.param_result == mavlink.PARAM_ACK_VALUE_UNSUPPORTED
    assert (engine.value("P3"), engine.events()) == (1.5, [ParameterRefused("P3", None, EXTENDED)])


@pytest.mark.parametrize(
    ("message", "name"),
    [
        (mavlink.MAVLink_param_ext_request_read_message(1, 1, b"P3", -1), "P3"),
        (mavlink.MAVLink_param_ext_request_read_message(1, 1, b"", 3), "Index 3"),
        (mavlink.MAVLink_param_ext_request_list_message(1, 1), "Parameter list"),
    ],
)
def test_an_extended_read_finds_nothing_and_the_operator_is_told(message, name):
    engine, vehicle = server(), Codec(1, 1)
    engine.receive(*vehicle.decode(Codec(255, 190).encode(message)), 0.0, GROUND)
    assert engine.messages_to_send() == []
    assert engine.events() == [ParameterRefused(name, None, EXTENDED)]


def test_the_vehicle_s_own_change_is_told_to_everyone():
    engine = server()
    engine.set("MODE", 4)
    (out,) = engine.messages_to_send()
    assert (out.peer, decode_value(out.message.param_value, INT32)) == (None, 4)
    for name, value in (("NO_SUCH", 1.0), ("MODE", 11)):
        with pytest.raises(LocalProtocolError):
            engine.set(name, value)


def test_requests_to_others_are_ignored():
    engine = server()
    engine.receive(mavlink.MAVLink_param_request_list_message(1, 100), 0.0, GROUND)
    assert engine.next_deadline() == math.inf


# The ground station's side


def test_missing_parameters_are_asked_for_by_index():
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


def test_not_all_missing_ones_are_asked_for_at_once():
    client = ParameterClient(255, 190)
    client.request_all(VEHICLE, 0.0)
    client.messages_to_send()
    client.receive(value_of("P0", 0.5, REAL32, count=200), 0.1)
    client.handle_timer(client.next_deadline())
    assert len(client.messages_to_send()) == ASKED_AT_ONCE


def test_a_silent_vehicle_fails_the_list():
    client = ParameterClient(255, 190)
    client.request_all(VEHICLE, 0.0)
    while (now := client.next_deadline()) < math.inf:
        client.handle_timer(now)
    assert client.events() == [ParameterFailed("", "all parameters missing")]


def test_a_table_that_grows_under_way_is_fetched_anew():
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


def test_an_older_value_under_way_does_not_end_a_setting():
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
def test_what_the_vehicle_said_before_a_setting_neither_confirms_nor_fails_it(late):
    partner, vehicle, ground = Partner(), Codec(1, 1), Codec(255, 190)
    frames = [ground.decode(vehicle.encode(m))[0] for m in (value_of("P", 1.0, REAL32), late)]
    client = ParameterClient(255, 190, partner)
    for frame in frames:
        partner.hear(frame, 0.0)
    client.receive(frames[0], 0.0)
    client.set(VEHICLE, "P", 2.0, 0.0)
    client.receive(frames[1], 0.1)
    assert client.is_busy


def test_a_vehicle_that_keeps_its_value_fails_the_setting_and_says_which():
    client = ParameterClient(255, 190)
    client.receive(value_of("P", 1.0, REAL32), 0.0)
    client.set(VEHICLE, "P", 2.0, 0.0)
    while (now := client.next_deadline()) < math.inf:
        client.receive(value_of("P", 1.0, REAL32), now)
        client.handle_timer(now)
    assert client.events()[-1] == ParameterFailed("P", "the vehicle keeps 1")
    assert len(client.messages_to_send()) == CONTRADICTIONS


def test_a_told_error_fails_at_once():
    client = ParameterClient(255, 190)
    client.set(VEHICLE, "NO_SUCH", 1.0, 0.0)
    client.receive(mavlink.MAVLink_param_error_message(255, 190, b"NO_SUCH", -1, 1), 0.1)
    assert client.events() == [ParameterFailed("NO_SUCH", "DOES_NOT_EXIST")]


def test_a_value_its_type_cannot_hold_fails_without_a_word_on_the_wire():
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
    assert client.events() == [ParameterReceived("P0", 1.0, REAL32, 0xFFFF, 1)]


def test_cancelling_ends_list_and_settings():
    client = ParameterClient(255, 190)
    client.request_all(VEHICLE, 0.0)
    client.set(VEHICLE, "P", 1.0, 0.0)
    client.cancel("closed")
    assert client.events() == [ParameterFailed("", "closed"), ParameterFailed("P", "closed")]
    assert client.next_deadline() == math.inf
