"""The laws of the command protocol, asking side and answering side."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.engines.base import Peer
from protocol.engines.command_client import CommandClient
from protocol.engines.command_server import CommandServer
from protocol.errors import LocalProtocolError
from protocol.events import CommandCancelRequested, CommandDone, CommandProgress, CommandRefused, CommandRequested
from tests.support.lossy_pipe import LossyPipe
from tests.support.virtual_clock import VirtualClock

ARM, TAKEOFF, REPOSITION = 400, 22, 192
ACCEPTED, REJECTED, DENIED, UNSUPPORTED, IN_PROGRESS, CANCELLED = 0, 1, 2, 3, 5, 6
GROUND, OTHER = Peer(255, 190, "ground"), Peer(245, 190, "other")


def long(command=ARM, p1=1.0, confirmation=0, target=(1, 1), rest=math.nan):
    return mavlink.MAVLink_command_long_message(*target, command, confirmation, p1, *[rest] * 6)


def integer(x=435648000, y=14811000, frame=0):
    return mavlink.MAVLink_command_int_message(1, 1, frame, REPOSITION, 0, 0, -1, 1, 0, math.nan, x, y, 160.0)


def cancel(command=ARM, target=(1, 1)):
    return mavlink.MAVLink_command_cancel_message(*target, command)


def ack(command=ARM, result=ACCEPTED, target=(255, 190), progress=0):
    return mavlink.MAVLink_command_ack_message(command, result, progress, 0, *target)


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


# Asking


def test_silence_repeats_with_confirmation_counting_up_then_gives_up():
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


def test_an_answer_that_comes_twice_ends_one_command():
    client = CommandClient(255, 190)
    client.send(long(), 0.0)
    client.receive(ack(), 0.1)
    client.receive(ack(), 0.2)
    assert len(client.events()) == 1


def test_progress_extends_the_wait_and_a_lost_end_is_asked_for_again():
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


def test_different_commands_run_side_by_side_and_equal_ones_in_turn():
    client = CommandClient(255, 190)
    first, other, second = client.send(long(), 0.0), client.send(long(TAKEOFF), 0.0), client.send(long(p1=0.0), 0.0)
    assert [(m.command, m.param1) for m in client.messages_to_send()] == [(ARM, 1.0), (TAKEOFF, 1.0)]
    client.receive(ack(), 0.1)
    assert [(m.command, m.param1) for m in client.messages_to_send()] == [(ARM, 0.0)]
    client.receive(ack(result=DENIED), 0.2)
    client.receive(ack(TAKEOFF), 0.3)
    assert [(e.request, e.result) for e in client.events()] == [(first, 0), (second, DENIED), (other, 0)]


def test_cancelling_ends_everything_that_waits():
    client = CommandClient(255, 190)
    client.send(long(), 0.0)
    client.send(long(p1=0.0), 0.0)
    client.cancel("vehicle lost")
    assert [(e.result, e.reason) for e in client.events()] == [(None, "vehicle lost")] * 2
    assert client.next_deadline() == math.inf


def kinds(engine):
    return [m.get_type() for m in engine.messages_to_send()]


def test_cancelling_what_was_not_sent_yet_sends_nothing():
    client = CommandClient(255, 190)
    client.send(long(), 0.0)
    second = client.send(long(p1=0.0), 0.0)
    client.request_cancel(second, 0.1)
    assert kinds(client) == ["COMMAND_LONG"]
    assert client.events() == [CommandDone(second, ARM, CANCELLED, "CANCELLED")]


@pytest.mark.parametrize("in_progress", [False, True])
@pytest.mark.parametrize(("result", "name"), [(CANCELLED, "CANCELLED"), (ACCEPTED, "ACCEPTED"), (4, "FAILED")])
def test_a_cancel_is_repeated_until_the_command_has_its_end_whatever_that_is(in_progress, result, name):
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


def test_progress_neither_stops_nor_slows_the_cancelling():
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


def test_a_cancel_without_an_answer_is_given_up():
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


# Answering


def test_a_request_is_answered_to_the_one_who_asked():
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
    assert (engine.events(), engine.messages_to_send()) == ([], [])  # no answer yet: nothing to say again
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


def test_a_late_first_frame_does_not_repeat_what_its_repetition_did():
    engine, wire = server(), Wire()
    first, second = wire(long()), wire(long(confirmation=1))
    for message, now in ((second, 0.0), (first, 0.4)):
        engine.receive(message, now, GROUND)
        for event in engine.events():
            engine.acknowledge(event.request, ACCEPTED, now)
    assert answers(engine) == [(GROUND, ARM, ACCEPTED)] * 2
    assert engine._count == 1


def test_asking_anew_executes_anew():
    engine, wire = server(), Wire()
    for now, p1 in ((0.0, 1.0), (0.2, 0.0), (0.4, 1.0), (0.6, 1.0)):
        engine.receive(wire(long(p1=p1)), now, GROUND)
        (event,) = engine.events()
        engine.acknowledge(event.request, ACCEPTED, now)
    assert event.request == 4


def test_a_confirmation_long_after_the_answer_is_a_new_request():
    """Its first frame was lost: the vehicle must not answer with what was true ten seconds ago."""
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


def test_work_in_progress_is_told_then_ended():
    engine = server()
    engine.receive(long(), 0.0, GROUND)
    (event,) = engine.events()
    engine.acknowledge(event.request, IN_PROGRESS, 0.1, progress=30)
    engine.acknowledge(event.request, ACCEPTED, 5.0)
    assert [(o.message.result, o.message.progress) for o in engine.messages_to_send()] == [(5, 30), (0, 0)]


def test_a_command_at_work_is_not_begun_again_however_late_it_is_repeated():
    engine, wire = server(), Wire()
    engine.receive(wire(long()), 0.0, GROUND)
    (event,) = engine.events()
    engine.acknowledge(event.request, IN_PROGRESS, 0.0)
    engine.receive(wire(long(confirmation=1)), 20.0, GROUND)
    assert engine.events() == []
    assert answers(engine) == [(GROUND, ARM, IN_PROGRESS)] * 2


def test_a_command_that_took_long_is_answered_again_after_its_end():
    engine, wire = server(), Wire()
    engine.receive(wire(long()), 0.0, GROUND)
    (event,) = engine.events()
    engine.acknowledge(event.request, IN_PROGRESS, 0.0)
    engine.acknowledge(event.request, ACCEPTED, 20.0)
    engine.messages_to_send()
    engine.receive(wire(long(confirmation=1)), 21.0, GROUND)
    assert engine.events() == []
    assert answers(engine) == [(GROUND, ARM, ACCEPTED)]


def test_answering_twice_or_answering_nothing_is_our_own_mistake():
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


def test_going_there_and_back_by_command_int_goes_there_twice():
    engine, wire = server(), Wire()
    for now, x in ((0.0, 1), (0.3, 2), (0.6, 1)):
        engine.receive(wire(integer(x=x)), now, GROUND)
        engine.acknowledge(engine.events()[0].request, ACCEPTED, now)
    assert engine._count == 3
    engine.receive(wire(integer(x=1)), 1.1, GROUND)  # soon after, and nothing between: a repetition
    assert engine.events() == []


def test_what_may_be_repeated_is_executed_whenever_it_comes():
    engine, wire = server(repeatable={ARM}), Wire()
    for confirmation in (0, 1):
        engine.receive(wire(long(confirmation=confirmation)), 0.5, GROUND)
    assert len(engine.events()) == 2


def test_answers_are_forgotten_in_the_end():
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


def test_a_repetition_is_told_the_latest_progress():
    wire = Wire()
    engine, request = working(wire=wire)
    engine.acknowledge(request, IN_PROGRESS, 1.0, progress=60)
    engine.messages_to_send()
    engine.receive(wire(long(confirmation=1)), 1.1, GROUND)
    (out,) = engine.messages_to_send()
    assert (out.message.result, out.message.progress) == (IN_PROGRESS, 60)


@pytest.mark.parametrize("target", [(1, 1), (1, 0), (0, 0)])
def test_its_sender_cancels_a_command_once(target):
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
def test_a_cancel_by_or_for_somebody_else_is_ignored(message, peer):
    engine, request = working()
    engine.receive(message, 1.0, peer)
    assert (engine.events(), engine.messages_to_send()) == ([], [])
    engine.acknowledge(request, ACCEPTED, 2.0)


def test_a_cancel_of_nothing_is_ignored():
    engine = server()
    engine.receive(cancel(), 0.0, GROUND)
    engine.receive(long(), 0.0, GROUND)
    engine.acknowledge(engine.events()[0].request, ACCEPTED, 0.0)  # took no time: there was nothing to cancel
    engine.messages_to_send()
    engine.receive(cancel(), 0.1, GROUND)
    assert (engine.events(), engine.messages_to_send()) == ([], [])


@pytest.mark.parametrize("result", [ACCEPTED, CANCELLED])
def test_a_cancel_after_the_end_stops_nothing_and_hears_the_end_again(result):
    engine, request = working()
    engine.acknowledge(request, result, 1.0)
    engine.messages_to_send()
    engine.receive(cancel(), 1.2, GROUND)
    assert engine.events() == []
    assert answers(engine) == [(GROUND, ARM, result)]


def test_what_cannot_be_stopped_goes_on_to_its_end():
    engine, request = working()
    engine.receive(cancel(), 1.0, GROUND)
    engine.acknowledge(request, IN_PROGRESS, 1.1, progress=90)
    engine.acknowledge(request, ACCEPTED, 2.0)
    assert [o.message.result for o in engine.messages_to_send()] == [IN_PROGRESS, ACCEPTED]


def test_the_end_follows_its_sender_to_a_new_address():
    """The sender's link went away while the command ran; it comes back by another one."""
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
def test_whatever_is_asked_and_cancelled_one_of_a_kind_runs_and_has_one_end(steps):
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


class Flight:
    """Both engines on a lossy link, and an owner whose commands take three seconds."""

    TAKES = 3.0

    def __init__(self, seed, **losses):
        self.clock, self.client, self.server = VirtualClock(), CommandClient(255, 190), server()
        self.up, self.down = LossyPipe(seed, **losses), LossyPipe(seed + 1000, **losses)
        self.ground, self.vehicle = Codec(255, 190), Codec(1, 1)
        self.begun, self.running, self.ends, self.done = 0, {}, [], []
        self.next_progress = 0.0

    def run(self, until):
        while not self.done and self.clock.now < until:
            self.clock.advance_to(self.clock.now + 0.05)
            self._step(self.clock.now)

    def _step(self, now):
        for message in self._through(self.up, self.vehicle, now):
            self.server.receive(message, now, GROUND)
        self._fly(now)
        for out in self.server.messages_to_send():
            self.down.send(self.vehicle.encode(out.message), now)
        for message in self._through(self.down, self.ground, now):
            self.client.receive(message, now)
        self.client.handle_timer(now)
        for message in self.client.messages_to_send():
            self.up.send(self.ground.encode(message), now)
        self.done += [event for event in self.client.events() if isinstance(event, CommandDone)]

    def _through(self, pipe, codec, now):
        return [message for data in pipe.receive(now) for message in codec.decode(data)]

    def _fly(self, now):
        for event in self.server.events():
            if isinstance(event, CommandRequested):
                self.begun += 1
                self.running[event.request] = now + self.TAKES
            elif isinstance(event, CommandCancelRequested):
                self._end(event.request, CANCELLED, now)
        for request, end in list(self.running.items()):
            if now >= end:
                self._end(request, ACCEPTED, now)
            elif now >= self.next_progress:
                self.next_progress = now + 0.5
                self.server.acknowledge(request, IN_PROGRESS, now, progress=50)

    def _end(self, request, result, now):
        del self.running[request]
        self.ends.append(result)
        self.server.acknowledge(request, result, now)


@pytest.mark.parametrize("seed", range(20))
def test_on_a_bad_link_a_long_command_runs_once_and_both_ends_agree_how_it_ended(seed):
    flight = Flight(seed, drop=0.3, duplicate=0.2, reorder=0.3, delay=0.1)
    flight.client.send(long(), 0.0)
    flight.run(until=30.0)
    assert (flight.begun, flight.ends) == (1, [ACCEPTED])
    assert [event.result for event in flight.done] == [ACCEPTED]


@pytest.mark.parametrize("seed", range(20))
def test_on_a_bad_link_a_cancel_stops_it_and_both_ends_agree_how_it_ended(seed):
    flight = Flight(seed, drop=0.3, duplicate=0.2, reorder=0.3, delay=0.1)
    request = flight.client.send(long(), 0.0)
    flight.run(until=1.5)
    flight.client.request_cancel(request, flight.clock.now)
    flight.run(until=30.0)
    assert flight.begun == 1
    assert [event.result for event in flight.done] == flight.ends
