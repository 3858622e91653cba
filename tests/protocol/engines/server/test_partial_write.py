"""Partial writes replace some items of a plan."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.server.mission_server import MissionServer
from protocol.events import MissionReceived
from protocol.plans.plan import Refusal
from tests.support.links.link import plan
from tests.support.links.mission_server import OLD, OTHER, count, feed, item, received, server

ACCEPTED, UNSUPPORTED, INVALID_SEQUENCE, DENIED, CANCELLED = 0, 3, 13, 14, 15


def partial(first, last):
    return mavlink.MAVLink_mission_write_partial_list_message(1, 1, first, last)


@pytest.mark.parametrize(("first", "last"), [(0, 0), (1, 2), (0, 3), (3, 3)])
def test_a_partial_write_replaces_only_its_items(first, last):
    old, new = plan(4), plan(4, 900)
    engine = server(old)
    feed(engine, partial(first, last))
    for seq in range(first, last + 1):
        assert received(engine) == [("REQUEST", seq)]
        assert engine.items == old
        feed(engine, new[seq].to_message(seq, 1, 1))
    assert received(engine) == [("ACK", ACCEPTED)]
    assert engine.items == (*old[:first], *new[first : last + 1], *old[last + 1 :])
    assert engine.events() == [MissionReceived(engine.items, is_partial=True)]


def test_an_end_index_one_behind_the_last_item_means_the_last():
    old, new = plan(4), plan(4, 900)
    engine = server(old)
    feed(engine, partial(3, 4), new[3].to_message(3, 1, 1))
    assert received(engine) == [("REQUEST", 3), ("ACK", ACCEPTED)]
    assert engine.items == (*old[:3], new[3])


@pytest.mark.parametrize(("first", "last"), [(2, 2), (1, 3), (1, 0), (-1, 0), (0, -1), (30000, 30000)])
def test_a_partial_write_of_missing_items_is_refused(first, last):
    engine = server()
    feed(engine, partial(first, last), item(0))
    assert received(engine) == [("ACK", INVALID_SEQUENCE)]
    assert engine.items == OLD


def test_a_partial_write_without_a_plan_is_refused():
    engine = server(())
    feed(engine, partial(0, 0), item(0))
    assert received(engine) == [("ACK", INVALID_SEQUENCE)]


def test_a_partial_write_is_validated_as_a_whole_plan():
    seen = []
    engine = MissionServer(1, 1, OLD, validate=lambda items: seen.append(tuple(items)) or Refusal("no", UNSUPPORTED))
    feed(engine, partial(1, 1), item(1))
    assert received(engine)[-1] == ("ACK", UNSUPPORTED)
    assert seen == [(OLD[0], plan(20)[1])]
    assert engine.items == OLD


def test_a_partial_write_without_items_times_out_and_requests_no_earlier_item():
    engine = server(plan(6))
    feed(engine, partial(4, 5))
    while (deadline := engine.next_deadline()) < math.inf:
        engine.handle_timer(deadline)
    asked = received(engine)
    assert set(asked) == {("REQUEST", 4), ("ACK", CANCELLED)}
    assert asked[-1] == ("ACK", CANCELLED)
    assert engine.items == plan(6)


def test_a_partial_write_during_another_peers_upload_is_denied():
    engine = server()
    feed(engine, count(2))
    received(engine)
    feed(engine, partial(0, 0), peer=OTHER)
    assert received(engine, OTHER) == [("ACK", DENIED)]
