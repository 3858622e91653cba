"""The parameter server: lists, reads, settings and refusals."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.server.parameter_server import NO_EXTENDED_PARAMETERS, ParameterServer
from protocol.engines.table_values import Parameter, decode_value, encode_value
from protocol.errors import LocalProtocolError
from protocol.events import ParameterChanged, ParameterRefused
from protocol.wire.codec import Codec
from protocol.wire.message import Peer

REAL32, INT32, UINT16, UINT64, REAL64 = 9, 6, 3, 7, 10


GROUND = Peer(255, 190, "ground")


def server(count=12, **options):
    floats = [
        Parameter(name=f"P{n}", type=REAL32, value=n / 2, minimum=-100.0, maximum=100.0) for n in range(count - 1)
    ]
    table = [*floats, Parameter(name="MODE", type=INT32, value=-3, minimum=-10, maximum=10)]
    return ParameterServer(1, 1, table, **options)


def set_message(name, value, kind):
    return mavlink.MAVLink_param_set_message(1, 1, name.encode(), encode_value(value, kind), kind)


def raw_set(name, carried, kind):
    return mavlink.MAVLink_param_set_message(1, 1, name.encode(), carried, kind)


def read(name="", index=-1):
    return mavlink.MAVLink_param_request_read_message(1, 1, name.encode(), index)


def errors(out):
    return [o.message.error for o in out if o.message.get_type() == "PARAM_ERROR"]


def test_two_parameters_with_one_name_raise():
    with pytest.raises(LocalProtocolError):
        ParameterServer(1, 1, [Parameter(name="P", type=REAL32, value=0.0)] * 2)


def test_a_list_is_sent_completely_in_order_and_in_small_parts():
    engine, portions = server(), []
    engine.receive(mavlink.MAVLink_param_request_list_message(1, 1), 0.0, GROUND)
    while (now := engine.next_deadline()) < math.inf:
        engine.handle_timer(now)
        portions.append(engine.messages_to_send())
    out = [o for portion in portions for o in portion]
    assert [(o.message.param_index, o.message.param_count) for o in out] == [(n, 12) for n in range(12)]
    assert max(map(len, portions)) == 5
    assert {o.peer for o in out} == {GROUND}


def test_repeated_list_requests_do_not_speed_up_any_list():
    engine, received = server(200), []
    for step in range(100):  # one millisecond apart
        engine.receive(mavlink.MAVLink_param_request_list_message(1, 1), step / 1e3, Peer(step % 8, 1, step))
        if step / 1e3 >= engine.next_deadline():
            engine.handle_timer(step / 1e3)
        received += engine.messages_to_send()
    assert len(received) <= 10 * 8 * 5  # five of each list every 10 ms


def test_eight_lists_are_sent_at_a_time():
    engine = server()
    for system in range(1, 10):
        engine.receive(mavlink.MAVLink_param_request_list_message(1, 1), 0.0, Peer(system, 1, system))
    engine.handle_timer(engine.next_deadline())
    assert {o.peer.system for o in engine.messages_to_send()} == set(range(1, 9))


def test_one_parameter_is_read_by_index_and_by_name():
    engine = server()
    for request in (read(index=3), read("P3")):
        engine.receive(request, 0.0, GROUND)
    assert [(o.message.param_id, o.message.param_index) for o in engine.messages_to_send()] == [("P3", 3)] * 2


@pytest.mark.parametrize("request_", [read("NO_SUCH"), read(index=12), read(index=-5)])
def test_an_unknown_parameter_is_an_error_to_the_sender(request_):
    engine = server()
    engine.receive(request_, 0.0, GROUND)
    out = engine.messages_to_send()
    assert errors(out) == [mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST]
    assert out[0].peer == GROUND


def test_a_new_value_is_broadcast_and_reported_once():
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
        (raw_set("P3", 1.0, 0), UNKNOWN_TYPE, "MAV_PARAM_TYPE 0 is the wrong type"),
        (raw_set("P3", 1.0, 255), UNKNOWN_TYPE, "MAV_PARAM_TYPE 255 is the wrong type"),
    ],
)
def test_a_refused_value_keeps_the_old_one_which_is_broadcast(message, error, reason):
    engine = server()
    engine.receive(message, 0.0, GROUND)
    out = engine.messages_to_send()
    assert errors(out) == [error]
    received = [o for o in out if o.message.get_type() == "PARAM_VALUE"]
    assert [(o.peer, o.message.param_value) for o in received] == [(None, 1.5)]
    (event,) = engine.events()
    assert isinstance(event, ParameterRefused)
    assert reason in event.reason


def test_a_value_that_the_vehicle_cannot_fly_by_is_refused_before_it_is_answered():
    engine = server(put_in_force=lambda parameter: f"{parameter.name} {parameter.value:g} does not fit")
    engine.receive(set_message("P3", 7.25, REAL32), 0.0, GROUND)
    out = engine.messages_to_send()
    assert errors(out) == [RANGE]
    received = [o for o in out if o.message.get_type() == "PARAM_VALUE"]
    assert [(o.peer, o.message.param_value) for o in received] == [(None, 1.5)]
    assert engine.events() == [ParameterRefused("P3", 7.25, "P3 7.25 does not fit")]


def test_a_value_that_is_in_force_is_not_put_in_force_again():
    asked = []
    engine = server(put_in_force=lambda parameter: asked.append((parameter.name, parameter.value)) or "")
    for value in (1.5, 7.25, 7.25):
        engine.receive(set_message("P3", value, REAL32), 0.0, GROUND)
    assert asked == [("P3", 7.25)]


def test_a_whole_float_is_accepted_for_an_integer_parameter():
    engine = server()
    engine.receive(set_message("MODE", 5.0, REAL32), 0.0, GROUND)
    (received,) = engine.messages_to_send()
    assert (received.message.param_type, decode_value(received.message.param_value, INT32)) == (INT32, 5)
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
def test_a_float_that_does_not_fit_an_integer_is_refused(value, error, reason):
    engine = server()
    engine.receive(set_message("MODE", value, REAL32), 0.0, GROUND)
    assert errors(engine.messages_to_send()) == [error]
    (event,) = engine.events()
    assert reason in event.reason
    assert engine.value("MODE") == -3


def test_setting_an_unknown_parameter_is_only_an_error():
    engine = server()
    engine.receive(set_message("NO_SUCH", 1.0, REAL32), 0.0, GROUND)
    assert errors(engine.messages_to_send()) == [mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST]
    assert engine.events() == []


def test_the_error_numbers_are_the_standard_ones():
    names = ("TYPE_UNSUPPORTED", "TYPE_MISMATCH", "READ_FAIL")
    assert [getattr(mavlink, f"MAV_PARAM_ERROR_{name}") for name in names] == [6, 7, 8]


def test_an_extended_set_is_answered_as_unsupported_to_its_sender():
    engine = server()
    engine.receive(mavlink.MAVLink_param_ext_set_message(1, 1, b"P3", b"5", REAL32), 0.0, GROUND)
    (out,) = engine.messages_to_send()
    assert (out.peer, out.message.get_type()) == (GROUND, "PARAM_EXT_ACK")
    assert out.message.param_result == mavlink.PARAM_ACK_VALUE_UNSUPPORTED
    assert (engine.value("P3"), engine.events()) == (1.5, [ParameterRefused("P3", None, NO_EXTENDED_PARAMETERS)])


@pytest.mark.parametrize(
    ("message", "name"),
    [
        (mavlink.MAVLink_param_ext_request_read_message(1, 1, b"P3", -1), "P3"),
        (mavlink.MAVLink_param_ext_request_read_message(1, 1, b"", 3), "Index 3"),
        (mavlink.MAVLink_param_ext_request_list_message(1, 1), "Parameter list"),
    ],
)
def test_an_extended_read_is_only_reported_to_the_operator(message, name):
    engine, vehicle = server(), Codec(1, 1)
    engine.receive(*vehicle.decode(Codec(255, 190).encode(message)), 0.0, GROUND)
    assert engine.messages_to_send() == []
    assert engine.events() == [ParameterRefused(name, None, NO_EXTENDED_PARAMETERS)]


def test_a_change_by_the_vehicle_is_broadcast():
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


def test_a_list_asked_for_again_from_another_address_begins_anew_and_goes_there_alone():
    engine, request, moved = server(), mavlink.MAVLink_param_request_list_message(1, 1), GROUND._replace(key="moved")
    engine.receive(request, 0.0, GROUND)
    engine.handle_timer(0.0)
    assert {out.peer for out in engine.messages_to_send()} == {GROUND}
    engine.receive(request, 0.005, moved)
    sent = []
    while (now := engine.next_deadline()) < math.inf:
        engine.handle_timer(now)
        sent += engine.messages_to_send()
    assert [(out.peer, out.message.param_index) for out in sent] == [(moved, index) for index in range(12)]
