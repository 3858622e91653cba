"""HEARTBEAT every second, and at once when it changes."""

from protocol.dialect import mavlink
from protocol.engines.heartbeat import HeartbeatSource

VEHICLE = mavlink.MAVLink_heartbeat_message(19, 12, 81, 0, 4, 3)


def armed():
    return mavlink.MAVLink_heartbeat_message(19, 12, 209, 0, 4, 3)


def test_the_first_heartbeat_is_sent_at_once_and_then_every_second():
    source, times = HeartbeatSource(), []
    source.announce(VEHICLE, 10.0)
    for now in (10.0, 10.5, 11.0, 11.9, 12.0, 13.0):
        source.announce(VEHICLE, now)
        source.handle_timer(now)
        times += [now] * len(source.messages_to_send())
    assert times == [10.0, 11.0, 12.0, 13.0]


def test_a_changed_heartbeat_is_sent_at_once_and_restarts_the_period():
    source = HeartbeatSource()
    source.announce(VEHICLE, 0.0)
    source.announce(armed(), 0.4)
    assert [m.base_mode for m in source.messages_to_send()] == [81, 209]
    assert source.next_deadline() == 1.4


def test_missed_heartbeats_are_not_sent_later():
    source = HeartbeatSource()
    source.announce(VEHICLE, 0.0)
    source.handle_timer(7.3)
    assert len(source.messages_to_send()) == 2
    assert source.next_deadline() == 8.0
