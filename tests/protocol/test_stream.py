"""Message rates: exact, bounded, told, and each link's own."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.engines.base import Peer
from protocol.engines.stream import GROUPS, OFF, StreamScheduler, StreamServer
from protocol.errors import LocalProtocolError
from protocol.events import CommandRequested

ACCEPTED, DENIED, UNSUPPORTED = 0, 2, 3
ATTITUDE, POSITION, HUD, HOME, PRIVATE = 30, 32, 74, 242, 53001
SET, GET, REQUEST = 511, 510, 512
NAN = math.nan


def scheduler():
    return StreamScheduler({ATTITUDE: 20_000, POSITION: 100_000, HOME: OFF})


def count(streams, number, ticks, tick):
    return sum(number in streams.due(k * tick) for k in range(ticks))


@settings(max_examples=60, deadline=None)
@given(interval=st.integers(1, 200_000), tick=st.integers(1, 20_000), ticks=st.integers(1, 400))
def test_a_message_is_due_at_the_first_tick_of_each_of_its_intervals(interval, tick, ticks):
    streams = StreamScheduler({ATTITUDE: interval})
    times = [k * tick for k in range(ticks) if streams.due(k * tick)]
    assert times == [k * tick for k in range(ticks) if k == 0 or (k * tick) // interval > ((k - 1) * tick) // interval]


def test_messages_of_one_instant_come_in_the_order_of_their_ids():
    assert scheduler().due(0) == [ATTITUDE, POSITION]


def test_beats_that_were_missed_stay_missed():
    streams = scheduler()
    streams.due(0)
    assert streams.due(1_000_000) == [ATTITUDE, POSITION]
    assert streams.due(1_000_000) == []
    assert streams.next_due() == 1_020_000


def test_a_rate_change_holds_from_now_on():
    streams = scheduler()
    streams.due(7_000)
    assert streams.set_interval(ATTITUDE, 50_000.0) == ACCEPTED
    assert [t for t in range(7_000, 207_000, 1_000) if ATTITUDE in streams.due(t)] == [7_000, 57_000, 107_000, 157_000]
    assert streams.interval(ATTITUDE) == 50_000


def test_the_interval_in_force_asked_for_again_shifts_no_beat():
    streams = scheduler()
    beats = []
    for time in range(0, 100_000, 1_000):
        beats += [time] if ATTITUDE in streams.due(time) else []
        streams.set_interval(ATTITUDE, 20_000.0)
    assert beats == [0, 20_000, 40_000, 60_000, 80_000]


@pytest.mark.parametrize("default", [0.0, math.nan])
def test_zero_and_nan_bring_the_default_back_and_minus_one_stops(default):
    streams = scheduler()
    assert streams.set_interval(ATTITUDE, -1.0) == ACCEPTED
    assert count(streams, ATTITUDE, 100, 10_000) == 0
    assert streams.interval(ATTITUDE) == -1
    assert streams.set_interval(ATTITUDE, default) == ACCEPTED
    assert streams.interval(ATTITUDE) == 20_000
    assert streams.is_default


def test_a_stream_that_is_off_by_default_can_be_switched_on():
    streams = scheduler()
    assert streams.set_interval(HOME, 1e6) == ACCEPTED
    assert streams.due(0) == [ATTITUDE, POSITION, HOME]


@pytest.mark.parametrize("interval", [-2.0, 0.3, math.inf, 1e12])
def test_intervals_that_mean_nothing_are_denied_and_change_nothing(interval):
    streams = scheduler()
    assert streams.set_interval(ATTITUDE, interval) == DENIED
    assert streams.interval(ATTITUDE) == 20_000


def test_what_does_not_exist_is_unsupported():
    streams = scheduler()
    assert streams.set_interval(999, 1e6) == UNSUPPORTED
    assert streams.interval(999) == 0


def test_all_off_means_never():
    assert StreamScheduler({ATTITUDE: -1}).next_due() == math.inf


@pytest.mark.parametrize("interval", [0, -2, 2**31])
def test_a_default_that_is_no_interval_is_our_own_mistake(interval):
    with pytest.raises(LocalProtocolError):
        StreamScheduler({ATTITUDE: interval})


# The server: a schedule per link

DEFAULTS = {ATTITUDE: 50_000, POSITION: 100_000, HUD: 200_000, HOME: OFF, PRIVATE: 50_000}


class Streams:
    """A server, who is there, and how often each got which message."""

    def __init__(self, *links, shared=False):
        self.links = dict.fromkeys(links)
        self.server = StreamServer(
            1, 1, DEFAULTS, (148, 300, 435), numbered={435: 3}, links=None if shared else self.links.keys()
        )
        self.now_us = 0

    def ask(self, key, command, *params):
        seven = (*params, *(NAN,) * (7 - len(params)))
        return self.server.serve(CommandRequested(1, command, seven, None, Peer(255, 190, key)), self.now_us / 1e6)

    def stream(self, key, group, rate, start=1, *, to=(1, 1)):
        message = mavlink.MAVLink_request_data_stream_message(*to, group, rate, start)
        self.server.receive(message, 0.0, Peer(255, 190, key))

    def run(self, seconds, tick=10_000):
        """Times [us] at which each link got each message: {key: {id: [...]}}."""
        heard = {key: {} for key in self.links}
        for _ in range(round(seconds * 1e6 / tick)):
            for number, audience in self.server.due(self.now_us).items():
                for key in self.links if audience is None else audience:
                    heard[key].setdefault(number, []).append(self.now_us)
            self.now_us += tick
        return heard

    def rates(self, seconds=2.0):
        self.run(0.5)  # past the first beat of what has just changed
        return {key: {n: len(t) / seconds for n, t in got.items()} for key, got in self.run(seconds).items()}


NORMAL = {ATTITUDE: 20, POSITION: 10, HUD: 5, PRIVATE: 20}


@pytest.mark.parametrize("how", ["interval", "group"])
def test_what_one_link_asks_for_changes_nothing_for_the_others(how):
    streams = Streams("a", "b", "c")
    undisturbed = Streams("b").run(3.0)["b"]
    if how == "interval":
        assert streams.ask("a", SET, ATTITUDE, 250_000.0) == ACCEPTED
    else:
        streams.stream("a", mavlink.MAV_DATA_STREAM_EXTRA1, 4)
    heard = streams.run(3.0)
    assert heard["b"] == heard["c"] == undisturbed
    assert heard["a"] == undisturbed | {ATTITUDE: list(range(0, 3_000_000, 250_000))}


@pytest.mark.parametrize("how", [(GET,), (REQUEST, 244)])
def test_intervals_are_told_to_each_link_as_they_are_for_it(how):
    streams = Streams("a", "b")
    streams.ask("a", SET, ATTITUDE, 250_000.0)
    told = {}
    for key in ("a", "b"):
        assert streams.ask(key, *how, ATTITUDE) == ACCEPTED
        ((peer, message),) = streams.server.messages_to_send()
        told[peer.key] = (message.message_id, message.interval_us)
    assert told == {"a": (ATTITUDE, 250_000), "b": (ATTITUDE, 50_000)}
    for nonsense in (70_000.0, NAN, -1.0, 30.5, math.inf):
        assert streams.ask("a", *how, nonsense) == DENIED
    assert streams.server.messages_to_send() == []


def test_links_that_cannot_be_told_apart_share_one_schedule():
    streams = Streams(None, shared=True)
    assert streams.ask("a", SET, ATTITUDE, 250_000.0) == ACCEPTED
    assert streams.server.intervals == {None: DEFAULTS | {ATTITUDE: 250_000}}
    assert streams.rates()[None] == NORMAL | {ATTITUDE: 4}


def test_a_message_for_many_links_is_asked_for_once():
    streams = Streams(*range(16))
    assert set(streams.server.due(0).values()) == {None}  # everyone: nobody has a schedule of their own
    streams.ask(3, SET, ATTITUDE, 1e6)
    streams.ask(5, SET, HOME, 1e6)
    due = streams.server.due(1_000_000)
    assert list(due) == sorted(due)
    assert {number: sorted(audience) for number, audience in due.items()} == {
        **{number: list(range(16)) for number in NORMAL},
        HOME: [5],
    }


def test_a_link_that_is_gone_takes_its_rates_with_it():
    streams = Streams("a", "b")
    streams.ask("a", SET, ATTITUDE, 1e6)
    streams.run(0.1)
    del streams.links["a"]
    streams.run(0.1)
    assert set(streams.server.intervals) == {None}
    streams.links["a"] = None
    assert streams.rates()["a"] == NORMAL


def test_strangers_that_come_and_go_leave_nothing_behind():
    streams = Streams("a")
    streams.ask("a", SET, ATTITUDE, 1e6)
    for port in range(1000):
        streams.ask(port, SET, ATTITUDE, 1.0)  # never among the links
    assert set(streams.server.intervals) == {None, "a"}


def test_who_goes_back_to_the_defaults_shares_them_again():
    streams = Streams("a", "b")
    streams.ask("a", SET, ATTITUDE, 250_000.0)
    streams.ask("a", SET, ATTITUDE, 0.0)
    assert set(streams.server.intervals) == {None}
    heard = streams.run(1.0)
    assert heard["a"] == heard["b"]


def test_a_request_that_is_refused_leaves_the_link_where_it_was():
    streams = Streams("a")
    assert streams.ask("a", SET, ATTITUDE, math.inf) == DENIED
    assert streams.ask("a", SET, 999, 1e6) == UNSUPPORTED
    assert streams.ask("a", SET, NAN, 1e6) == UNSUPPORTED
    assert set(streams.server.intervals) == {None}


# REQUEST_DATA_STREAM


@pytest.mark.parametrize(
    ("group", "slowed"),
    [
        (mavlink.MAV_DATA_STREAM_ALL, {ATTITUDE, POSITION, HUD}),
        (mavlink.MAV_DATA_STREAM_RAW_SENSORS, set()),
        (mavlink.MAV_DATA_STREAM_EXTENDED_STATUS, set()),
        (mavlink.MAV_DATA_STREAM_POSITION, {POSITION}),
        (mavlink.MAV_DATA_STREAM_EXTRA1, {ATTITUDE}),
        (mavlink.MAV_DATA_STREAM_EXTRA2, {HUD}),
        (mavlink.MAV_DATA_STREAM_EXTRA3, set()),
        (5, set()),
        (99, set()),
    ],
)
def test_a_group_gets_its_rate_and_nothing_else_changes(group, slowed):
    streams = Streams("a")
    streams.stream("a", group, 4)
    assert streams.rates()["a"] == NORMAL | dict.fromkeys(slowed, 4)


def test_the_groups_are_disjoint_and_all_is_all_of_them():
    members = [
        number for group, numbers in GROUPS.items() if group != mavlink.MAV_DATA_STREAM_ALL for number in numbers
    ]
    assert len(set(members)) == len(members)
    assert set(GROUPS[mavlink.MAV_DATA_STREAM_ALL]) == set(members)
    assert max(members) < 53000  # private messages are in none
    assert set(GROUPS) == {0, 1, 2, 3, 4, 6, 10, 11, 12}


def test_a_group_stops_and_starts_again_at_its_defaults():
    streams = Streams("a")
    streams.stream("a", mavlink.MAV_DATA_STREAM_ALL, 4, start=0)
    assert streams.rates()["a"] == {PRIVATE: 20}
    streams.stream("a", mavlink.MAV_DATA_STREAM_ALL, 0)
    assert streams.rates()["a"] == NORMAL


def test_a_request_repeated_every_15_seconds_shifts_no_beat():
    steady, repeated = Streams("a"), Streams("a")
    steady.stream("a", 0, 4)
    repeated.stream("a", 0, 4)
    expected, heard = steady.run(6.3), {}
    for _ in range(9):
        for number, times in repeated.run(0.7)["a"].items():
            heard.setdefault(number, []).extend(times)
        repeated.stream("a", 0, 4)
    assert heard == expected["a"]


@pytest.mark.parametrize(
    ("to", "taken"), [((1, 1), True), ((1, 0), True), ((0, 0), True), ((2, 1), False), ((1, 9), False)]
)
def test_only_what_is_for_us_counts(to, taken):
    streams = Streams("a")
    streams.stream("a", 0, 4, to=to)
    assert ("a" in streams.server.intervals) == taken


def test_an_order_that_is_neither_start_nor_stop_changes_nothing():
    streams = Streams("a")
    streams.stream("a", 0, 4, start=2)
    assert set(streams.server.intervals) == {None}


def test_the_fastest_rate_there_is_means_every_tick():
    streams = Streams("a")
    streams.stream("a", mavlink.MAV_DATA_STREAM_EXTRA2, 65535)
    assert streams.rates()["a"] == NORMAL | {HUD: 100}


# Single messages


def requested(streams):
    return [(event.message_id, event.index, event.peer and event.peer.key) for event in streams.server.events()]


@pytest.mark.parametrize(
    ("params", "result", "events"),
    [
        ((ATTITUDE,), ACCEPTED, [(ATTITUDE, 0.0, "a")]),
        ((148, 0, 0, 0, 0, 0, 2), ACCEPTED, [(148, 0.0, None)]),
        ((435,), ACCEPTED, [(435, 0.0, "a")]),
        ((435, 3), ACCEPTED, [(435, 3.0, "a")]),
        ((435, 4), DENIED, []),
        ((435, -1), DENIED, []),
        ((435, 1.5), DENIED, []),
        ((435, math.inf), DENIED, []),
        ((259,), UNSUPPORTED, []),
        ((NAN,), UNSUPPORTED, []),
        ((math.inf,), UNSUPPORTED, []),
    ],
)
def test_a_single_message_is_asked_for_or_refused(params, result, events):
    streams = Streams("a")
    assert streams.ask("a", REQUEST, *params) == result
    assert requested(streams) == events


OLDER = {
    mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: 148,
    mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION: 300,
    mavlink.MAV_CMD_GET_HOME_POSITION: HOME,
}


@pytest.mark.parametrize("command", OLDER)
def test_older_commands_ask_for_one_message(command):
    streams = Streams("a")
    for first in (1.0, 0.0, NAN):
        assert streams.ask("a", command, first) == ACCEPTED
    assert requested(streams) == [(OLDER[command], 0.0, "a")] * 3


@pytest.mark.parametrize("command", [519, 520])
def test_older_commands_with_a_flag_that_is_none_are_denied(command):
    streams = Streams("a")
    assert streams.ask("a", command, 7.0) == DENIED
    assert requested(streams) == []


# What links may ask for


REJECTED = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
MANY = dict.fromkeys(range(60), OFF)


def wide(*links):
    streams = Streams(*links)
    streams.server = StreamServer(1, 1, MANY, (435,), numbered={435: 3}, links=streams.links.keys())
    return streams


def grab(streams, key, share=range(60)):
    """How many messages a link gets every tick when it asks for all of them at the shortest interval."""
    return sum(streams.ask(key, SET, number, 1.0) == ACCEPTED for number in share)


def test_a_link_cannot_have_more_than_its_share_and_keeps_what_it_has():
    streams = wide("a", "b")
    assert grab(streams, "a") == 20
    assert sum(len(times) for times in streams.run(1.0)["a"].values()) == 2000
    assert {event.result for event in streams.server.events()} == {REJECTED}
    assert streams.ask("a", SET, 59, 1e6) == REJECTED
    assert streams.ask("a", SET, 0, 20_000.0) == ACCEPTED  # fewer
    assert streams.ask("a", SET, 59, 1e6) == ACCEPTED


def test_all_links_together_cannot_have_more_than_the_vehicle_can_send():
    streams = wide(*range(16))
    assert [grab(streams, key) for key in range(16)] == [20, 20, 20] + [0] * 13
    assert streams.ask(0, SET, 0, -1.0) == ACCEPTED
    assert grab(streams, 15) == 1


def test_a_group_that_is_too_much_changes_nothing_and_is_said():
    streams = wide("a")
    assert grab(streams, "a", range(17)) == 17
    streams.server.events()
    before = streams.server.intervals
    streams.stream("a", mavlink.MAV_DATA_STREAM_ALL, 65535)
    assert streams.server.intervals == before
    ((command, result),) = [(event.command, event.result) for event in streams.server.events()]
    assert (command, result) == (SET, REJECTED)


def test_single_messages_have_a_budget_for_each_link_that_time_fills():
    streams = wide("a", "b")
    results = [streams.ask("a", REQUEST, 0) for _ in range(300)]
    assert results == [ACCEPTED] * 200 + [REJECTED] * 100
    assert streams.ask("b", REQUEST, 0) == ACCEPTED
    streams.now_us += 1_000_000
    assert [streams.ask("a", REQUEST, 0) for _ in range(101)].count(ACCEPTED) == 100


def test_a_message_with_many_parts_or_readers_costs_as_many():
    streams = wide(*range(10))
    results = [streams.ask(0, REQUEST, 435, 0, 0, 0, 0, 0, 2) for _ in range(10)]
    assert results.count(ACCEPTED) == 6  # three each, to ten
    assert [streams.ask(1, REQUEST, 435) for _ in range(100)].count(ACCEPTED) == 66


def test_ports_that_change_with_every_question_share_one_budget():
    streams = wide()
    assert sum(streams.ask(port, REQUEST, 0) == ACCEPTED for port in range(1000)) == 600
