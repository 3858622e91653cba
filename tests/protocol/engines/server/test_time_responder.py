"""TIMESYNC and PING are answered once; answers are not."""

from protocol.dialect import mavlink
from tests.support.links.link import frame
from tests.support.links.vehicle_endpoint import ask, endpoint, heard


def test_time_and_ping_are_answered_once_and_answers_are_not():
    vehicle = endpoint()
    vehicle.receive_datagram(frame(mavlink.MAVLink_timesync_message(0, 77)), "ground", 2.5)
    ((_, answer),) = heard(vehicle)
    assert (answer.tc1, answer.ts1) == (2_500_000_000, 77)
    ((_, pong),) = ask(vehicle, mavlink.MAVLink_ping_message(5, 6, 0, 0))
    assert (pong.time_usec, pong.seq, pong.target_system, pong.target_component) == (5, 6, 255, 190)
    for message in (answer, mavlink.MAVLink_ping_message(5, 6, 1, 1)):
        assert ask(vehicle, message) == []


def test_a_ping_from_ids_0_0_is_not_answered():
    vehicle = endpoint()
    vehicle.receive_datagram(frame(mavlink.MAVLink_ping_message(5, 6, 0, 0), 0, 0), "ground", 0.0)
    assert [message for _, message in heard(vehicle) if message.get_type() == "PING"] == []


def test_an_answer_at_time_zero_does_not_look_like_a_request():
    vehicle = endpoint()
    ((_, answer),) = ask(vehicle, mavlink.MAVLink_timesync_message(0, 77))
    assert answer.tc1 != 0
