"""Whole flights of both ends over links that lose, delay, repeat and reorder datagrams."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.engines.base import MAX_TIMEOUT, SILENCE_LIMIT
from protocol.events import (
    CommandDone,
    MissionCleared,
    MissionDownloaded,
    MissionFailed,
    MissionUploaded,
    ParameterConfirmed,
    ParameterFailed,
    ParametersComplete,
    VehicleFound,
)
from tests.support.links.link import ARM, START, TAKEOFF, Link, plan
from tests.support.links.transfers import HOSTILE, ITEMS, TRANSFERS, CountingPipe, Rig, plain, seeds
from tests.support.links.transfers import fly as transfer

ROUGH = HOSTILE
ENDS = (MissionUploaded, MissionDownloaded, MissionCleared, MissionFailed)


def fly(link: Link, count: int) -> None:
    """Upload, arm, take off, start, arrive, download, clear, and the parameters; all must succeed."""
    link.wait_for(VehicleFound)
    items = plan(count)
    link.ground.upload_mission(items, now=link.now)
    assert link.wait_for(MissionUploaded, MissionFailed) == MissionUploaded(count)
    assert link.vehicle.plan == items
    for command in (ARM, TAKEOFF, START):
        request = link.ground.command(command, 1.0, now=link.now)
        assert link.wait_for(CommandDone) == CommandDone(request, command, 0, "ACCEPTED")
    assert link.vehicle.executed == [ARM, TAKEOFF, START]
    assert link.run(lambda: link.vehicle.next_item == float("inf"))
    link.ground.download_mission(link.now)
    done = link.wait_for(MissionDownloaded, MissionFailed)
    assert done == MissionDownloaded(items)
    link.ground.request_parameters(link.now)
    assert link.wait_for(ParametersComplete, ParameterFailed) == ParametersComplete(12)
    link.ground.set_parameter("N_MAX", 9, link.now)
    assert link.wait_for(ParameterConfirmed, ParameterFailed) == ParameterConfirmed("N_MAX", 9)
    link.ground.clear_mission(link.now)
    assert link.wait_for(MissionCleared, MissionFailed) == MissionCleared()
    assert link.vehicle.plan == ()
    assert not link.ground.is_busy


def test_a_clean_link_flies_the_whole_mission():
    link = Link()
    fly(link, 8)
    reached = [m.seq for m in link.messages if m.get_type() == "MISSION_ITEM_REACHED"]
    assert reached == list(range(8))
    assert link.ground.codec.statistics.sources[1, 1].lost == 0


@pytest.mark.parametrize("seed", range(6))
def test_a_link_that_loses_a_tenth_and_repeats_and_reorders_flies_the_whole_mission(seed):
    fly(Link(seed, drop=0.1, delay=0.05, duplicate=0.1, reorder=0.2), 6)


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 2**32),
    drop=st.floats(0.0, 0.6),
    delay=st.floats(0.0, 0.5),
    duplicate=st.floats(0.0, 0.5),
    reorder=st.floats(0.0, 0.5),
    count=st.integers(0, 12),
)
def test_an_upload_ends_in_bounded_time_with_the_new_plan_or_the_old_one(seed, drop, delay, duplicate, reorder, count):
    old, new = plan(3, offset=1000), plan(count)
    link = Link(seed, items=old, drop=drop, delay=delay, duplicate=duplicate, reorder=reorder)
    link.wait_for(VehicleFound, limit=120.0)
    link.ground.upload_mission(new, now=link.now)
    assert link.run(lambda: not link.ground.is_busy, limit=120.0)
    assert link.run(lambda: not link.vehicle.endpoint._mission.is_receiving, limit=30.0)
    assert link.vehicle.plan in (old, new)
    if any(isinstance(event, MissionUploaded) for event in link.events):
        assert link.vehicle.plan == new


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32))
def test_every_operation_ends_cleanly_at_30_percent_loss_and_half_a_second_delay(seed):
    """30 % loss, duplication, reordering and 0.5 s of delay each way: a success is a real one."""
    link = Link(seed, **ROUGH)
    link.wait_for(VehicleFound)
    items = plan(5)
    link.ground.upload_mission(items, now=link.now)
    request = link.ground.command(ARM, 1.0, now=link.now)
    link.ground.request_parameters(link.now)
    link.ground.set_parameter("K_3", 42.0, link.now)
    assert link.run(lambda: not link.ground.is_busy, limit=180.0)
    outcome = {type(event): event for event in link.events}
    if MissionUploaded in outcome:
        assert link.vehicle.plan == items
    if ParameterConfirmed in outcome:
        assert {p.name: p.value for p in link.vehicle.endpoint.parameters}["K_3"] == 42.0
    done = outcome[CommandDone]
    assert done.request == request
    if done.result == 0:
        assert link.vehicle.executed == [ARM]
    assert link.vehicle.executed in ([], [ARM])
    link.ground.download_mission(link.now)
    assert link.run(lambda: not link.ground.is_busy, limit=180.0)
    fetched = [event.items for event in link.events if isinstance(event, MissionDownloaded)]
    assert fetched in ([], [link.vehicle.plan])


@pytest.mark.long(after=1)
@pytest.mark.parametrize("name", TRANSFERS)
def test_every_transfer_succeeds_over_a_hostile_link(name):
    """The first ten of the three hundred seeds of ``scripts/bench/lossy.py``."""
    outcomes = [transfer(TRANSFERS[name], seed, **HOSTILE) for seed in seeds(name, 10)]
    assert [outcome.is_success for outcome in outcomes] == [True] * 10


def test_without_loss_a_transfer_repeats_nothing():
    frames = {name: transfer(TRANSFERS[name], 0).frames for name in TRANSFERS}
    assert frames["mission upload"] == 2 * ITEMS + 2
    assert frames["mission download"] == 2 * ITEMS + 3
    assert frames["clear"] == 2


def test_a_known_delay_causes_no_repetition():
    outcome = transfer(TRANSFERS["mission upload"], 0, delay=0.4)
    assert outcome.frames <= 2 * ITEMS + 2 + 8


@pytest.mark.parametrize("name", TRANSFERS)
def test_every_transfer_succeeds_if_answers_take_longer_than_any_timeout(name):
    assert transfer(TRANSFERS[name], 0, delay=2.5, drop=0.1).is_success


def test_the_plain_protocol_fails_on_the_same_link():
    outcomes = [plain(TRANSFERS["mission download"].waits, seed, **HOSTILE) for seed in range(10)]
    assert sum(outcome.is_success for outcome in outcomes) <= 1


def work(rig, draw):
    """One random operation on the flight plan; returns its result and the expected one."""
    items, known = plan(draw.choice((1, 1, 2, 3)), draw.choice((10, 20))), len(rig.events)
    operation = draw.choice(("upload", "upload", "download", "clear"))
    if operation == "upload":
        rig.ground.upload_mission(items, now=rig.now)
    elif operation == "download":
        rig.ground.download_mission(rig.now)
    else:
        rig.ground.clear_mission(rig.now)
    assert rig.run(lambda: not rig.ground.is_busy, limit=200.0)
    present = rig.vehicle.endpoint.mission
    expected = {
        "upload": (MissionUploaded(len(items)), items),
        "download": (MissionDownloaded(present), present),
        "clear": (MissionCleared(), ()),
    }
    return (next(e for e in reversed(rig.events[known:]) if isinstance(e, ENDS)), present), expected[operation]


@pytest.mark.parametrize("seed", range(8))
def test_short_transfers_in_a_row_ignore_late_frames_of_earlier_ones(seed):
    rig, draw = Rig(seed, **HOSTILE), random.Random(seed)
    for _ in range(12):
        ended, expected = work(rig, draw)
        assert ended == expected


def cut(rig):
    """Stop all datagrams."""
    rig.up, rig.down = CountingPipe(0, drop=1.0), CountingPipe(0, drop=1.0)


@pytest.mark.parametrize("name", TRANSFERS)
def test_a_dead_link_is_detected_in_every_transfer_and_the_next_one_works(name):
    rig = Rig(3, delay=0.1)
    TRANSFERS[name].begin(rig.ground, rig.now)
    rig.run(limit=0.35)
    working, start = (rig.up, rig.down), rig.now
    cut(rig)
    if rig.ground.is_busy:
        assert rig.run(lambda: not rig.ground.is_busy, limit=60.0)
        assert rig.now - start < SILENCE_LIMIT + MAX_TIMEOUT + 0.2
    rig.run(limit=20.0)
    assert not rig.vehicle.endpoint._mission.is_receiving
    rig.up, rig.down = working
    rig.run(limit=3.0)
    TRANSFERS[name].begin(rig.ground, rig.now)
    known = len(rig.events)
    assert rig.run(lambda: any(TRANSFERS[name].expected(e) is True for e in rig.events[known:]), limit=30.0)


@pytest.mark.parametrize("name", ["mission upload", "mission download", "fence upload", "rally download"])
@pytest.mark.parametrize("away", [3.0, 8.0])
def test_every_transfer_resumes_after_a_link_outage(name, away):
    rig = Rig(3, delay=0.1)
    TRANSFERS[name].begin(rig.ground, rig.now)
    rig.run(limit=1.0)
    working, sent = (rig.up, rig.down), rig.frames
    cut(rig)
    rig.run(limit=away)
    assert rig.ground.is_busy
    rig.up, rig.down = working
    known = len(rig.events)
    assert rig.run(lambda: any(TRANSFERS[name].expected(e) is True for e in rig.events[known:]), limit=30.0)
    assert rig.frames < sent + 2 * ITEMS + 10  # it resumed instead of starting anew


def test_one_seed_is_one_flight():
    first, second = Link(7, **ROUGH), Link(7, **ROUGH)
    for link in (first, second):
        link.wait_for(VehicleFound)
        link.ground.upload_mission(plan(4), now=link.now)
        link.run(lambda link=link: not link.ground.is_busy)
    assert first.events == second.events
    assert first.now == second.now
