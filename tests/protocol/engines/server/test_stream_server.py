"""Message rates of all links: what peers ask for, and what is due (https://mavlink.io/en/services/message_interval.html)."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.engines.server.stream_server import DATA_STREAM_GROUPS, STREAM_OFF, StreamScheduler, StreamServer
from protocol.errors import LocalProtocolError
from protocol.events import CommandRequested
from protocol.wire.message import Peer

ACCEPTED, DENIED, UNSUPPORTED = 0, 2, 3


DUE_ATTITUDE, DUE_POSITION, DUE_HOME = 30, 32, 242


def scheduler():
    return StreamScheduler({DUE_ATTITUDE: 20_000, DUE_POSITION: 100_000, DUE_HOME: STREAM_OFF})


def count(streams, number, ticks, tick):
    return sum(number in streams.due(k * tick) for k in range(ticks))


@settings(max_examples=60, deadline=None)
@given(interval=st.integers(1, 200_000), tick=st.integers(1, 20_000), ticks=st.integers(1, 400))
def test_a_message_is_due_at_the_first_tick_of_each_of_its_intervals(interval, tick, ticks):
    streams = StreamScheduler({DUE_ATTITUDE: interval})
    times = [k * tick for k in range(ticks) if streams.due(k * tick)]
    assert times == [k * tick for k in range(ticks) if k == 0 or (k * tick) // interval > ((k - 1) * tick) // interval]


def test_messages_due_together_are_ordered_by_id():
    assert scheduler().due(0) == [DUE_ATTITUDE, DUE_POSITION]


def test_missed_messages_are_not_sent_later():
    streams = scheduler()
    streams.due(0)
    assert streams.due(1_000_000) == [DUE_ATTITUDE, DUE_POSITION]
    assert streams.due(1_000_000) == []
    assert streams.next_due() == 1_020_000


def test_a_new_rate_is_in_force_at_once():
    streams = scheduler()
    streams.due(7_000)
    assert streams.set_interval(DUE_ATTITUDE, 50_000.0) == ACCEPTED
    assert [t for t in range(7_000, 207_000, 1_000) if DUE_ATTITUDE in streams.due(t)] == [
        7_000,
        57_000,
        107_000,
        157_000,
    ]
    assert streams.interval(DUE_ATTITUDE) == 50_000


def test_the_same_interval_again_does_not_shift_the_phase():
    streams = scheduler()
    beats = []
    for time in range(0, 100_000, 1_000):
        beats += [time] if DUE_ATTITUDE in streams.due(time) else []
        streams.set_interval(DUE_ATTITUDE, 20_000.0)
    assert beats == [0, 20_000, 40_000, 60_000, 80_000]


@pytest.mark.parametrize("default", [0.0, math.nan])
def test_zero_and_nan_restore_the_default_and_minus_one_stops(default):
    streams = scheduler()
    assert streams.set_interval(DUE_ATTITUDE, -1.0) == ACCEPTED
    assert count(streams, DUE_ATTITUDE, 100, 10_000) == 0
    assert streams.interval(DUE_ATTITUDE) == -1
    assert streams.set_interval(DUE_ATTITUDE, default) == ACCEPTED
    assert streams.interval(DUE_ATTITUDE) == 20_000
    assert streams.is_default


def test_a_stream_that_is_off_by_default_can_be_switched_on():
    streams = scheduler()
    assert streams.set_interval(DUE_HOME, 1e6) == ACCEPTED
    assert streams.due(0) == [DUE_ATTITUDE, DUE_POSITION, DUE_HOME]


@pytest.mark.parametrize("interval", [-2.0, 0.3, math.inf, 1e12])
def test_invalid_intervals_are_denied_and_change_nothing(interval):
    streams = scheduler()
    assert streams.set_interval(DUE_ATTITUDE, interval) == DENIED
    assert streams.interval(DUE_ATTITUDE) == 20_000


def test_an_unknown_stream_is_unsupported():
    streams = scheduler()
    assert streams.set_interval(999, 1e6) == UNSUPPORTED
    assert streams.interval(999) == 0


def test_all_off_means_never():
    assert StreamScheduler({DUE_ATTITUDE: -1}).next_due() == math.inf


@pytest.mark.parametrize("interval", [0, -2, 2**31])
def test_an_invalid_default_interval_raises(interval):
    with pytest.raises(LocalProtocolError):
        StreamScheduler({DUE_ATTITUDE: interval})


@pytest.mark.parametrize("interval", [1, 2**31 - 1])
def test_the_shortest_and_the_longest_interval_are_accepted(interval):
    streams = scheduler()
    assert streams.set_interval(DUE_ATTITUDE, interval) == ACCEPTED
    assert streams.interval(DUE_ATTITUDE) == interval


ATTITUDE, POSITION, HUD, HOME, PRIVATE = 30, 32, 74, 242, 53001


SET, GET, REQUEST = 511, 510, 512


NAN = math.nan


DEFAULTS = {ATTITUDE: 50_000, POSITION: 100_000, HUD: 200_000, HOME: STREAM_OFF, PRIVATE: 50_000}


class Streams:
    """A server with its links, and the messages each link gets."""

    def __init__(self, *links, shared=False):
        self.links = dict.fromkeys(links)
        self.server = StreamServer(
            1, 1, DEFAULTS, (148, 300, 435), numbered={435: 3}, links=None if shared else self.links.keys()
        )
        self.now_us = 0

    def ask(self, key, command, *params):
        seven = (*params, *(NAN,) * (7 - len(params)))
        return self.server.serve(
            CommandRequested(request=1, command=command, params=seven, frame=None, peer=Peer(255, 190, key)),
            self.now_us / 1e6,
        )

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
        self.run(0.5)  # past the first message after the change
        return {key: {n: len(t) / seconds for n, t in got.items()} for key, got in self.run(seconds).items()}


NORMAL = {ATTITUDE: 20, POSITION: 10, HUD: 5, PRIVATE: 20}


@pytest.mark.parametrize("how", ["interval", "group"])
def test_a_request_of_one_link_does_not_change_the_others(how):
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
def test_message_interval_reports_the_rate_of_the_asking_link(how):
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


def test_links_that_cannot_be_distinguished_share_one_schedule():
    streams = Streams(None, shared=True)
    assert streams.ask("a", SET, ATTITUDE, 250_000.0) == ACCEPTED
    assert streams.server.intervals == {None: DEFAULTS | {ATTITUDE: 250_000}}
    assert streams.rates()[None] == NORMAL | {ATTITUDE: 4}


def test_a_message_due_on_many_links_is_built_once():
    streams = Streams(*range(16))
    assert set(streams.server.due(0).values()) == {None}  # everyone: no link has its own schedule
    streams.ask(3, SET, ATTITUDE, 1e6)
    streams.ask(5, SET, HOME, 1e6)
    due = streams.server.due(1_000_000)
    assert list(due) == sorted(due)
    assert {number: sorted(audience) for number, audience in due.items()} == {
        **{number: list(range(16)) for number in NORMAL},
        HOME: [5],
    }


def test_the_rates_of_a_removed_link_are_dropped():
    streams = Streams("a", "b")
    streams.ask("a", SET, ATTITUDE, 1e6)
    streams.run(0.1)
    del streams.links["a"]
    streams.run(0.1)
    assert set(streams.server.intervals) == {None}
    streams.links["a"] = None
    assert streams.rates()["a"] == NORMAL


def test_unknown_peers_leave_no_schedules_behind():
    streams = Streams("a")
    streams.ask("a", SET, ATTITUDE, 1e6)
    for port in range(1000):
        streams.ask(port, SET, ATTITUDE, 1.0)  # never among the links
    assert set(streams.server.intervals) == {None, "a"}


def test_a_link_with_default_rates_again_shares_the_schedule():
    streams = Streams("a", "b")
    streams.ask("a", SET, ATTITUDE, 250_000.0)
    streams.ask("a", SET, ATTITUDE, 0.0)
    assert set(streams.server.intervals) == {None}
    heard = streams.run(1.0)
    assert heard["a"] == heard["b"]


def test_a_refused_request_does_not_change_the_link():
    streams = Streams("a")
    assert streams.ask("a", SET, ATTITUDE, math.inf) == DENIED
    assert streams.ask("a", SET, 999, 1e6) == UNSUPPORTED
    assert streams.ask("a", SET, NAN, 1e6) == UNSUPPORTED
    assert set(streams.server.intervals) == {None}


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
        number
        for group, numbers in DATA_STREAM_GROUPS.items()
        if group != mavlink.MAV_DATA_STREAM_ALL
        for number in numbers
    ]
    assert len(set(members)) == len(members)
    assert set(DATA_STREAM_GROUPS[mavlink.MAV_DATA_STREAM_ALL]) == set(members)
    assert max(members) < 53000  # no group contains private messages
    assert set(DATA_STREAM_GROUPS) == {0, 1, 2, 3, 4, 6, 10, 11, 12}


def test_a_group_stops_and_starts_again_at_its_defaults():
    streams = Streams("a")
    streams.stream("a", mavlink.MAV_DATA_STREAM_ALL, 4, start=0)
    assert streams.rates()["a"] == {PRIVATE: 20}
    streams.stream("a", mavlink.MAV_DATA_STREAM_ALL, 0)
    assert streams.rates()["a"] == NORMAL


def test_a_repeated_request_does_not_shift_the_phase():
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
def test_requests_for_other_components_are_ignored(to, taken):
    streams = Streams("a")
    streams.stream("a", 0, 4, to=to)
    assert ("a" in streams.server.intervals) == taken


def test_a_start_stop_value_other_than_0_or_1_changes_nothing():
    streams = Streams("a")
    streams.stream("a", 0, 4, start=2)
    assert set(streams.server.intervals) == {None}


def test_the_highest_rate_means_every_tick():
    streams = Streams("a")
    streams.stream("a", mavlink.MAV_DATA_STREAM_EXTRA2, 65535)
    assert streams.rates()["a"] == NORMAL | {HUD: 100}


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
        ((-1,), UNSUPPORTED, []),
        ((1 << 24,), UNSUPPORTED, []),
    ],
)
def test_a_single_message_is_requested_or_refused(params, result, events):
    streams = Streams("a")
    assert streams.ask("a", REQUEST, *params) == result
    assert requested(streams) == events


OLDER = {
    mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: 148,
    mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION: 300,
    mavlink.MAV_CMD_GET_HOME_POSITION: HOME,
}


@pytest.mark.parametrize("command", OLDER)
def test_older_commands_request_one_message(command):
    streams = Streams("a")
    for first in (1.0, 0.0, NAN):
        assert streams.ask("a", command, first) == ACCEPTED
    assert requested(streams) == [(OLDER[command], 0.0, "a")] * 3


@pytest.mark.parametrize("command", [519, 520])
def test_older_commands_with_an_invalid_flag_are_denied(command):
    streams = Streams("a")
    assert streams.ask("a", command, 7.0) == DENIED
    assert requested(streams) == []


REJECTED = mavlink.MAV_RESULT_TEMPORARILY_REJECTED


MANY = dict.fromkeys(range(60), STREAM_OFF)


def wide(*links):
    streams = Streams(*links)
    streams.server = StreamServer(1, 1, MANY, (435,), numbered={435: 3}, links=streams.links.keys())
    return streams


def grab(streams, key, share=range(60)):
    """The number of messages a link gets every tick if it requests all of them at the shortest interval."""
    return sum(streams.ask(key, SET, number, 1.0) == ACCEPTED for number in share)


def test_a_link_cannot_exceed_its_rate_and_keeps_its_present_one():
    streams = wide("a", "b")
    assert grab(streams, "a") == 20
    assert sum(len(times) for times in streams.run(1.0)["a"].values()) == 2000
    assert {event.result for event in streams.server.events()} == {REJECTED}
    assert streams.ask("a", SET, 59, 1e6) == REJECTED
    assert streams.ask("a", SET, 0, 20_000.0) == ACCEPTED  # fewer
    assert streams.ask("a", SET, 59, 1e6) == ACCEPTED


def test_all_links_together_cannot_exceed_the_total_rate():
    streams = wide(*range(16))
    assert [grab(streams, key) for key in range(16)] == [20, 20, 20] + [0] * 13
    assert streams.ask(0, SET, 0, -1.0) == ACCEPTED
    assert grab(streams, 15) == 1


def test_a_group_beyond_the_rate_is_refused_and_reported():
    streams = wide("a")
    assert grab(streams, "a", range(17)) == 17
    streams.server.events()
    before = streams.server.intervals
    streams.stream("a", mavlink.MAV_DATA_STREAM_ALL, 65535)
    assert streams.server.intervals == before
    ((command, result),) = [(event.command, event.result) for event in streams.server.events()]
    assert (command, result) == (SET, REJECTED)


def test_single_messages_are_limited_by_a_token_bucket_per_link():
    streams = wide("a", "b")
    results = [streams.ask("a", REQUEST, 0) for _ in range(300)]
    assert results == [ACCEPTED] * 200 + [REJECTED] * 100
    assert streams.ask("b", REQUEST, 0) == ACCEPTED
    streams.now_us += 1_000_000
    assert [streams.ask("a", REQUEST, 0) for _ in range(101)].count(ACCEPTED) == 100


def test_a_message_for_everyone_costs_one_token_while_nobody_is_there():
    streams = wide()
    for_everyone = (0, 0, 0, 0, 0, 0, 2)
    assert [streams.ask("a", REQUEST, *for_everyone) for _ in range(201)].count(ACCEPTED) == 200


def test_a_message_with_several_instances_or_receivers_costs_several_tokens():
    streams = wide(*range(10))
    results = [streams.ask(0, REQUEST, 435, 0, 0, 0, 0, 0, 2) for _ in range(10)]
    assert results.count(ACCEPTED) == 6  # three each, for ten links
    assert [streams.ask(1, REQUEST, 435) for _ in range(100)].count(ACCEPTED) == 66
    assert [streams.ask(2, REQUEST, 435, 3) for _ in range(201)].count(ACCEPTED) == 200  # one instance alone


def test_changing_ports_share_the_total_bucket():
    streams = wide()
    assert sum(streams.ask(port, REQUEST, 0) == ACCEPTED for port in range(1000)) == 600


@pytest.mark.parametrize("number", [0, 0xFFFF])
def test_the_interval_of_any_number_that_fits_is_told(number):
    streams = Streams("a")
    assert streams.ask("a", GET, number) == ACCEPTED
    ((_, message),) = streams.server.messages_to_send()
    assert (message.message_id, message.interval_us) == (number, 0)
