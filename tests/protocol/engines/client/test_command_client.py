"""The command client: repetitions, answers, cancelling."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.client.command_client import CommandClient
from protocol.events import CommandDone, CommandProgress

ARM, TAKEOFF = 400, 22


ACCEPTED, DENIED, UNSUPPORTED, IN_PROGRESS, CANCELLED = 0, 2, 3, 5, 6


def long(command=ARM, p1=1.0, confirmation=0, target=(1, 1), rest=math.nan):
    return mavlink.MAVLink_command_long_message(*target, command, confirmation, p1, *[rest] * 6)


def ack(command=ARM, result=ACCEPTED, target=(255, 190), progress=0):
    return mavlink.MAVLink_command_ack_message(command, result, progress, 0, *target)


def test_an_unanswered_command_is_repeated_with_a_counting_confirmation():
    client, sent, now = CommandClient(255, 190, timeout=0.5, retries=3), [], 0.0
    client.send(long(), now)
    while (deadline := client.next_deadline()) < math.inf:
        sent += client.messages_to_send()
        client.handle_timer(now := deadline)
    assert [m.confirmation for m in sent] == [0, 1, 2, 3]
    assert now == 2.0
    assert client.events() == [CommandDone(1, ARM, None, "no answer")]
    assert not client.is_busy


@pytest.mark.parametrize(
    ("result", "name"), [(0, "ACCEPTED"), (2, "DENIED"), (3, "UNSUPPORTED"), (77, "MAV_RESULT 77")]
)
def test_an_answer_ends_the_command_with_its_result(result, name):
    client = CommandClient(255, 190)
    request = client.send(long(), 0.0)
    client.receive(ack(result=result), 0.1)
    assert client.events() == [CommandDone(request, ARM, result, name)]
    assert client.next_deadline() == math.inf


@pytest.mark.parametrize("wrong", [ack(command=TAKEOFF), ack(target=(245, 190)), ack(target=(255, 1)), long()])
def test_answers_to_others_and_to_other_commands_are_ignored(wrong):
    client = CommandClient(255, 190)
    client.send(long(), 0.0)
    client.receive(wrong, 0.1)
    assert client.is_busy
    assert client.events() == []


def test_an_answer_without_target_is_for_everyone():
    client = CommandClient(255, 190)
    client.send(long(), 0.0)
    client.receive(ack(target=(0, 0)), 0.1)
    assert not client.is_busy


def test_a_duplicate_answer_ends_one_command_only():
    client = CommandClient(255, 190)
    client.send(long(), 0.0)
    client.receive(ack(), 0.1)
    client.receive(ack(), 0.2)
    assert len(client.events()) == 1


def test_progress_extends_the_wait_and_a_lost_result_is_requested_again():
    client = CommandClient(255, 190, timeout=0.5)
    client.send(long(), 0.0)
    client.messages_to_send()
    client.receive(ack(result=IN_PROGRESS, progress=40), 0.4)
    assert client.events() == [CommandProgress(1, ARM, 40)]
    assert client.next_deadline() == pytest.approx(3.4)
    client.handle_timer(3.4)
    assert [m.confirmation for m in client.messages_to_send()] == [1]
    client.receive(ack(), 3.5)
    assert client.events() == [CommandDone(1, ARM, 0, "ACCEPTED")]


def test_different_commands_run_side_by_side_and_equal_ones_one_after_the_other():
    client = CommandClient(255, 190)
    first, other, second = client.send(long(), 0.0), client.send(long(TAKEOFF), 0.0), client.send(long(p1=0.0), 0.0)
    assert [(m.command, m.param1) for m in client.messages_to_send()] == [(ARM, 1.0), (TAKEOFF, 1.0)]
    client.receive(ack(), 0.1)
    assert [(m.command, m.param1) for m in client.messages_to_send()] == [(ARM, 0.0)]
    client.receive(ack(result=DENIED), 0.2)
    client.receive(ack(TAKEOFF), 0.3)
    assert [(e.request, e.result) for e in client.events()] == [(first, 0), (second, DENIED), (other, 0)]


def test_cancelling_ends_all_commands():
    client = CommandClient(255, 190)
    client.send(long(), 0.0)
    client.send(long(p1=0.0), 0.0)
    client.cancel("vehicle lost")
    assert [(e.result, e.reason) for e in client.events()] == [(None, "vehicle lost")] * 2
    assert client.next_deadline() == math.inf


def kinds(engine):
    return [m.get_type() for m in engine.messages_to_send()]


def test_cancelling_a_queued_command_sends_nothing():
    client = CommandClient(255, 190)
    client.send(long(), 0.0)
    second = client.send(long(p1=0.0), 0.0)
    client.request_cancel(second, 0.1)
    assert kinds(client) == ["COMMAND_LONG"]
    assert client.events() == [CommandDone(second, ARM, CANCELLED, "CANCELLED")]


@pytest.mark.parametrize("in_progress", [False, True])
@pytest.mark.parametrize(("result", "name"), [(CANCELLED, "CANCELLED"), (ACCEPTED, "ACCEPTED"), (4, "FAILED")])
def test_a_cancel_is_repeated_until_the_command_has_a_result(in_progress, result, name):
    client = CommandClient(255, 190, timeout=0.5, retries=3)
    request = client.send(long(), 0.0)
    if in_progress:
        client.receive(ack(result=IN_PROGRESS, progress=10), 0.1)
    client.messages_to_send(), client.events()
    client.request_cancel(request, 1.0)
    for now in (1.5, 2.0):
        client.handle_timer(now)
    assert kinds(client) == ["COMMAND_CANCEL"] * 3
    client.receive(ack(result=result), 2.1)
    assert client.events() == [CommandDone(request, ARM, result, name)]
    assert client.next_deadline() == math.inf


def test_progress_does_not_stop_or_slow_down_a_cancel():
    client = CommandClient(255, 190, timeout=0.5, retries=1)
    request, now = client.send(long(), 0.0), 0.0
    client.request_cancel(request, 0.0)
    client.messages_to_send()
    for _ in range(20):
        now += 0.25
        client.receive(ack(result=IN_PROGRESS, progress=50), now)
        client.handle_timer(now)
    assert kinds(client) == ["COMMAND_CANCEL"] * 10
    assert client.is_busy


def test_an_unanswered_cancel_times_out():
    client = CommandClient(255, 190, timeout=0.5, retries=3)
    request = client.send(long(), 0.0)
    client.request_cancel(request, 0.0)
    client.request_cancel(request, 0.1)  # once is enough
    while (deadline := client.next_deadline()) < math.inf:
        client.handle_timer(deadline)
    assert kinds(client) == ["COMMAND_LONG", *["COMMAND_CANCEL"] * 4]
    assert client.events() == [CommandDone(request, ARM, None, "no answer")]
    client.request_cancel(request, 9.0)
    assert kinds(client) == []


def test_a_command_is_sent_again_after_seven_tenths_of_a_second():
    client = CommandClient(255, 190)
    client.send(long(), 10.0)
    assert client.next_deadline() == pytest.approx(10.7)
