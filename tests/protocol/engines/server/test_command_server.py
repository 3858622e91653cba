"""The command server: every request is executed once and answered each time it arrives."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.engines.server.command_server import CommandServer
from protocol.errors import LocalProtocolError
from protocol.events import CommandCancelRequested, CommandRefused, CommandRequested
from protocol.wire.codec import Codec
from protocol.wire.message import Peer

ARM, TAKEOFF, REPOSITION = 400, 22, 192


ACCEPTED, REJECTED, DENIED, UNSUPPORTED, IN_PROGRESS, CANCELLED = 0, 1, 2, 3, 5, 6


GROUND, OTHER = Peer(255, 190, "ground"), Peer(245, 190, "other")


def long(command=ARM, p1=1.0, confirmation=0, target=(1, 1), rest=math.nan):
    return mavlink.MAVLink_command_long_message(*target, command, confirmation, p1, *[rest] * 6)


def integer(x=435648000, y=14811000, frame=0):
    return mavlink.MAVLink_command_int_message(1, 1, frame, REPOSITION, 0, 0, -1, 1, 0, math.nan, x, y, 160.0)


def cancel(command=ARM, target=(1, 1)):
    return mavlink.MAVLink_command_cancel_message(*target, command)


class Wire:
    """A ground station's codec: messages arrive with real sequence numbers."""

    def __init__(self):
        self._codec = Codec(255, 190)

    def __call__(self, message):
        (received,) = Codec(1, 1).decode(self._codec.encode(message))
        return received


def server(repeatable=()):
    return CommandServer(1, 1, {ARM, TAKEOFF, REPOSITION}, repeatable)


def answers(engine):
    return [(out.peer, out.message.command, out.message.result) for out in engine.messages_to_send()]


def test_the_sender_of_a_command_gets_the_answer():
    engine = server()
    engine.receive(long(), 0.0, GROUND)
    (event,) = engine.events()
    assert (event.command, event.params[0], event.frame, event.peer) == (ARM, 1.0, None, GROUND)
    engine.acknowledge(event.request, ACCEPTED, 0.0)
    (out,) = engine.messages_to_send()
    assert out.peer == GROUND
    assert (out.message.target_system, out.message.target_component) == (255, 190)


def test_an_unknown_command_is_unsupported():
    engine = server()
    engine.receive(long(command=999), 0.0, GROUND)
    assert engine.events() == [CommandRefused(999, UNSUPPORTED, GROUND)]
    assert answers(engine) == [(GROUND, 999, UNSUPPORTED)]


@pytest.mark.parametrize("target", [(2, 1), (1, 100), (2, 0)])
def test_commands_for_others_get_no_answer(target):
    engine = server()
    engine.receive(long(target=target), 0.0, GROUND)
    assert (engine.events(), engine.messages_to_send()) == ([], [])


@pytest.mark.parametrize("target", [(0, 0), (1, 0), (0, 1), (1, 1)])
def test_zero_addresses_everyone(target):
    engine = server()
    engine.receive(long(target=target), 0.0, GROUND)
    assert len(engine.events()) == 1


@pytest.mark.parametrize("left_out", [math.nan, 0.0])
def test_nan_and_zero_both_arrive_as_the_default(left_out):
    engine = server()
    engine.receive(long(TAKEOFF, rest=left_out), 0.0, GROUND)
    (event,) = engine.events()
    assert event.param(7, default=1.5) == 1.5
    assert event.param(1, default=9.0) == 1.0


def test_a_repetition_is_answered_again_and_not_executed_again():
    engine, wire = server(), Wire()
    engine.receive(wire(long()), 0.0, GROUND)
    (event,) = engine.events()
    engine.receive(wire(long(confirmation=1)), 0.5, GROUND)
    assert (engine.events(), engine.messages_to_send()) == ([], [])  # no answer yet: nothing to repeat
    engine.acknowledge(event.request, ACCEPTED, 0.6)
    for confirmation in (2, 3):
        engine.receive(wire(long(confirmation=confirmation)), 0.5 * confirmation, GROUND)
    assert engine.events() == []
    assert answers(engine) == [(GROUND, ARM, ACCEPTED)] * 3


def test_one_frame_delivered_twice_is_executed_once():
    engine, message = server(), Wire()(long())
    for now in (0.0, 0.01):
        engine.receive(message, now, GROUND)
    assert len(engine.events()) == 1


def test_a_late_first_frame_is_not_executed_after_its_repetition():
    engine, wire = server(), Wire()
    first, second = wire(long()), wire(long(confirmation=1))
    for message, now in ((second, 0.0), (first, 0.4)):
        engine.receive(message, now, GROUND)
        for event in engine.events():
            engine.acknowledge(event.request, ACCEPTED, now)
    assert answers(engine) == [(GROUND, ARM, ACCEPTED)] * 2
    assert engine._count == 1


def test_a_new_request_is_executed_again():
    engine, wire = server(), Wire()
    for now, p1 in ((0.0, 1.0), (0.2, 0.0), (0.4, 1.0), (0.6, 1.0)):
        engine.receive(wire(long(p1=p1)), now, GROUND)
        (event,) = engine.events()
        engine.acknowledge(event.request, ACCEPTED, now)
    assert event.request == 4


def test_a_confirmation_long_after_the_answer_is_a_new_request():
    """Its first frame was lost: the answer from ten seconds ago is not valid any more."""
    engine, wire = server(), Wire()
    engine.receive(wire(long()), 0.0, GROUND)
    engine.acknowledge(engine.events()[0].request, DENIED, 0.0)
    engine.receive(wire(long(confirmation=1)), 10.0, GROUND)
    assert len(engine.events()) == 1


def test_requests_of_two_ground_stations_are_two_requests():
    engine = server()
    for peer in (GROUND, OTHER):
        engine.receive(long(), 0.0, peer)
    assert [event.peer for event in engine.events()] == [GROUND, OTHER]


def test_progress_is_acknowledged_before_the_result():
    engine = server()
    engine.receive(long(), 0.0, GROUND)
    (event,) = engine.events()
    engine.acknowledge(event.request, IN_PROGRESS, 0.1, progress=30)
    engine.acknowledge(event.request, ACCEPTED, 5.0)
    assert [(o.message.result, o.message.progress) for o in engine.messages_to_send()] == [(5, 30), (0, 0)]


def test_progress_that_is_not_known_is_255_and_an_answer_at_once_has_none():
    engine = server()
    engine.receive(long(), 0.0, GROUND)
    engine.acknowledge(engine.events()[0].request, IN_PROGRESS, 0.1)
    engine.receive(long(command=999), 0.2, GROUND)
    assert [(o.message.result, o.message.progress) for o in engine.messages_to_send()] == [(5, 255), (3, 0)]


def test_a_command_in_progress_is_never_restarted_by_a_repetition():
    engine, wire = server(), Wire()
    engine.receive(wire(long()), 0.0, GROUND)
    (event,) = engine.events()
    engine.acknowledge(event.request, IN_PROGRESS, 0.0)
    engine.receive(wire(long(confirmation=1)), 20.0, GROUND)
    assert engine.events() == []
    assert answers(engine) == [(GROUND, ARM, IN_PROGRESS)] * 2


def test_a_long_command_is_answered_again_after_its_end():
    engine, wire = server(), Wire()
    engine.receive(wire(long()), 0.0, GROUND)
    (event,) = engine.events()
    engine.acknowledge(event.request, IN_PROGRESS, 0.0)
    engine.acknowledge(event.request, ACCEPTED, 20.0)
    engine.messages_to_send()
    engine.receive(wire(long(confirmation=1)), 21.0, GROUND)
    assert engine.events() == []
    assert answers(engine) == [(GROUND, ARM, ACCEPTED)]


def test_answering_twice_or_without_a_request_raises():
    engine = server()
    engine.receive(long(), 0.0, GROUND)
    engine.acknowledge(1, ACCEPTED, 0.0)
    for number in (1, 2):
        with pytest.raises(LocalProtocolError):
            engine.acknowledge(number, ACCEPTED, 0.0)


def test_command_int_arrives_in_degrees_or_metres():
    engine = server()
    engine.receive(integer(), 0.0, GROUND)
    engine.receive(integer(x=25000, y=-15000, frame=1), 0.0, GROUND)
    engine.receive(integer(x=2**31 - 1, y=2**31 - 1), 0.0, GROUND)
    globally, locally, here = engine.events()
    assert isinstance(globally, CommandRequested)
    assert (globally.frame, globally.params[4:]) == (0, (43.5648, 1.4811, 160.0))
    assert (locally.frame, locally.params[4:6]) == (1, (2.5, -1.5))
    assert all(map(math.isnan, here.params[4:6]))


def test_the_same_command_int_after_another_one_is_executed_again():
    engine, wire = server(), Wire()
    for now, x in ((0.0, 1), (0.3, 2), (0.6, 1)):
        engine.receive(wire(integer(x=x)), now, GROUND)
        engine.acknowledge(engine.events()[0].request, ACCEPTED, now)
    assert engine._count == 3
    engine.receive(
        wire(integer(x=1)), 1.1, GROUND
    )  # soon afterwards, without another command between them: a repetition
    assert engine.events() == []


def test_repeatable_commands_are_executed_each_time():
    engine, wire = server(repeatable={ARM}), Wire()
    for confirmation in (0, 1):
        engine.receive(wire(long(confirmation=confirmation)), 0.5, GROUND)
    assert len(engine.events()) == 2


def test_old_answers_are_forgotten():
    engine = server()
    for n in range(50):
        engine.receive(long(p1=float(n)), 0.0, GROUND)
    for event in engine.events():
        engine.acknowledge(event.request, ACCEPTED, 0.0)
    engine.receive(long(), 100.0, GROUND)
    assert len(engine._records) == 1


def working(peer=GROUND, wire=None):
    """A server with ARM in progress at 30 %, and the number of that request."""
    engine = server()
    engine.receive((wire or Wire())(long()), 0.0, peer)
    (event,) = engine.events()
    engine.acknowledge(event.request, IN_PROGRESS, 0.0, progress=30)
    engine.messages_to_send()
    return engine, event.request


@pytest.mark.parametrize(("peer", "p1"), [(GROUND, 0.0), (OTHER, 1.0), (OTHER, 0.0)])
def test_one_command_runs_at_a_time(peer, p1):
    engine, request = working()
    engine.receive(long(p1=p1), 1.0, peer)
    assert engine.events() == [CommandRefused(ARM, REJECTED, peer)]
    assert answers(engine) == [(peer, ARM, REJECTED)]
    engine.receive(long(TAKEOFF), 1.0, peer)  # another command may run beside it
    assert engine.events()[0].command == TAKEOFF
    engine.acknowledge(request, ACCEPTED, 2.0)
    engine.receive(long(p1=p1), 3.0, peer)
    assert isinstance(engine.events()[0], CommandRequested)


def test_a_repetition_gets_the_latest_progress():
    wire = Wire()
    engine, request = working(wire=wire)
    engine.acknowledge(request, IN_PROGRESS, 1.0, progress=60)
    engine.messages_to_send()
    engine.receive(wire(long(confirmation=1)), 1.1, GROUND)
    (out,) = engine.messages_to_send()
    assert (out.message.result, out.message.progress) == (IN_PROGRESS, 60)


@pytest.mark.parametrize("target", [(1, 1), (1, 0), (0, 0)])
def test_the_sender_cancels_its_command_once(target):
    engine, request = working()
    for now in (1.0, 1.5):
        engine.receive(cancel(target=target), now, GROUND)
    assert engine.events() == [CommandCancelRequested(request, ARM, GROUND)]
    engine.acknowledge(request, CANCELLED, 1.6)
    assert answers(engine) == [(GROUND, ARM, CANCELLED)]


@pytest.mark.parametrize(
    ("message", "peer"),
    [(cancel(), OTHER), (cancel(TAKEOFF), GROUND), (cancel(target=(2, 1)), GROUND), (cancel(target=(1, 100)), GROUND)],
)
def test_a_cancel_by_or_for_another_component_is_ignored(message, peer):
    engine, request = working()
    engine.receive(message, 1.0, peer)
    assert (engine.events(), engine.messages_to_send()) == ([], [])
    engine.acknowledge(request, ACCEPTED, 2.0)


def test_a_cancel_without_a_command_is_ignored():
    engine = server()
    engine.receive(cancel(), 0.0, GROUND)
    engine.receive(long(), 0.0, GROUND)
    engine.acknowledge(engine.events()[0].request, ACCEPTED, 0.0)  # executed at once: there was nothing to cancel
    engine.messages_to_send()
    engine.receive(cancel(), 0.1, GROUND)
    assert (engine.events(), engine.messages_to_send()) == ([], [])


@pytest.mark.parametrize("result", [ACCEPTED, CANCELLED])
def test_a_cancel_after_the_end_gets_the_result_again(result):
    engine, request = working()
    engine.acknowledge(request, result, 1.0)
    engine.messages_to_send()
    engine.receive(cancel(), 1.2, GROUND)
    assert engine.events() == []
    assert answers(engine) == [(GROUND, ARM, result)]


def test_a_command_that_cannot_be_stopped_runs_to_its_end():
    engine, request = working()
    engine.receive(cancel(), 1.0, GROUND)
    engine.acknowledge(request, IN_PROGRESS, 1.1, progress=90)
    engine.acknowledge(request, ACCEPTED, 2.0)
    assert [o.message.result for o in engine.messages_to_send()] == [IN_PROGRESS, ACCEPTED]


def test_the_result_goes_to_the_senders_new_address():
    """The sender changes its link while the command runs."""
    wire = Wire()
    engine, request = working(wire=wire)
    engine.receive(wire(long(confirmation=1)), 5.0, moved := Peer(255, 190, "new link"))
    engine.acknowledge(request, ACCEPTED, 6.0)
    assert [out.peer for out in engine.messages_to_send()] == [moved, moved]


STEPS = st.tuples(
    st.sampled_from(["ask", "ask", "cancel", "progress", "end"]),
    st.sampled_from([GROUND, OTHER]),
    st.sampled_from([ARM, TAKEOFF]),
    st.sampled_from([0.0, 1.0]),
)


@given(st.lists(STEPS, max_size=40))
def test_any_sequence_of_requests_and_cancels_runs_one_command_of_a_kind(steps):
    engine, wire, running, now = server(), Wire(), {}, 0.0
    for step, peer, command, p1 in steps:
        now += 0.3
        if step == "ask":
            engine.receive(wire(long(command, p1=p1)), now, peer)
        elif step == "cancel":
            engine.receive(wire(cancel(command)), now, peer)
        elif command in running:
            result = ACCEPTED if step == "end" else IN_PROGRESS
            engine.acknowledge(running[command], result, now)
            if step == "end":
                del running[command]
        for event in engine.events():
            if isinstance(event, CommandRequested):
                assert event.command not in running
                running[event.command] = event.request
                engine.acknowledge(event.request, IN_PROGRESS, now)
            elif isinstance(event, CommandCancelRequested):
                engine.acknowledge(running.pop(event.command), CANCELLED, now)
        assert sum(record.state != "answered" for record in engine._records.values()) == len(running)
