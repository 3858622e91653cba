"""Playing and seeking in a recorded flight."""

import pytest

from darko_gcs.feed.player import MarkKind
from darko_gcs.feed.replay_feed import ReplayFeed
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, Reason
from protocol.tlog import TlogReader, read_tlog
from tests.support.gcs.messages import heartbeat
from tests.support.logs import T0, bare, log_of, record
from tests.support.paths import DATA

FLIGHT = DATA / "square-flight.tlog"


def test_playing_past_damage_reports_what_was_skipped():
    whole = FLIGHT.read_bytes()
    feed = ReplayFeed(TlogReader(whole[:100_000] + b"?" * 500 + whole[150_000:]), "damaged")
    feed.seek(0.0)
    for _ in range(400):
        feed.advance(0.01)
    assert any("bytes damaged" in line.text for line in feed.snapshot.log.lines)
    assert feed.snapshot.mission.reached >= {4, 5}


def test_at_its_end_it_stops_begins_anew_or_plays_back():
    feed = ReplayFeed(read_tlog(FLIGHT), "x")
    feed.seek(3.0)
    feed.advance(10.0)
    assert (feed.playing, feed.now) == (False, feed.timeline.duration)
    feed.toggle()
    assert feed.now == 0.0
    feed.looping = True
    feed.advance(10.0)
    assert (feed.playing, feed.now) == (True, 0.0)
    feed.backwards = True
    feed.advance(1.0)
    assert feed.now == feed.timeline.duration
    feed.looping = False
    feed.advance(1.0)
    assert feed.now == feed.timeline.duration - 1.0


def test_it_steps_from_message_to_message():
    feed = ReplayFeed(read_tlog(FLIGHT), "x")
    feed.seek(1.0)
    before = feed.timeline.played
    feed.step(1)
    assert (feed.timeline.played, feed.playing) == (before + 1, False)
    feed.step(-2)
    assert feed.timeline.played == before - 1


def test_the_flight_has_a_clock_of_its_own():
    feed = ReplayFeed(read_tlog(FLIGHT), "x")
    feed.seek(feed.timeline.duration)
    assert feed.flight_time == pytest.approx(10 * feed.timeline.duration, rel=0.1)  # recorded at ten times real time


def test_marks_tell_what_happened():
    feed = ReplayFeed(read_tlog(FLIGHT), "x")
    texts = {mark.text for mark in feed.marks}
    assert {"item 0 reached", "item 5 reached", "jump to hover linear"} <= texts
    assert list(feed.marks) == sorted(feed.marks, key=lambda mark: mark.time)
    mark = feed.seek_mark(MarkKind.WAYPOINT, 1)
    assert (mark.text, feed.now) == ("item 0 reached", mark.time)
    assert feed.seek_mark(MarkKind.WAYPOINT, -1) is None


def test_a_jump_into_a_transition_is_marked_by_the_name_of_the_transition():
    def jump(number, law):
        return bare(mavlink.MAVLink_darko_jump_message(1_000_000 * number, number, 1.0, 0, law, Reason.SPEED, b"x"))

    frames = [bare(heartbeat()), jump(1, Law.TO_FORWARD), jump(2, Law.TO_HOVER)]
    marks = ReplayFeed(TlogReader(log_of(frames)), "x").marks
    assert [mark.text for mark in marks] == ["jump to front transition", "jump to back transition"]


def test_silence_and_damage_are_gaps_and_warnings_and_modes_are_marked():
    def text(severity, words):
        return bare(mavlink.MAVLink_statustext_message(severity, words))

    frames = [
        bare(heartbeat(mode=1)),
        bare(heartbeat(mode=1)),
        text(4, b"low"),
        text(6, b"fine"),
        bare(heartbeat(mode=2)),
    ]
    data = b"".join(record(T0 + 5_000_000 * (k > 0) + k, frame) for k, frame in enumerate(frames)) + b"junk"
    marks = ReplayFeed(TlogReader(data), "x").marks
    kinds = [(mark.kind.value, mark.text) for mark in marks]
    assert ("gap", "no message for 5.0 s") in kinds
    assert ("warning", "low") in kinds
    assert [kind for kind, _ in kinds].count("mode") == 1
    assert [kind for kind, _ in kinds].count("gap") == 2
    assert ("warning", "fine") not in kinds
