"""Playing and seeking in a recorded flight."""

from darko_gcs.feed.replay_feed import ReplayFeed
from protocol.tlog import TlogReader, read_tlog
from tests.support.paths import DATA

FLIGHT = DATA / "square-flight.tlog"


def test_playing_past_damage_reports_what_was_skipped():
    whole = FLIGHT.read_bytes()
    feed = ReplayFeed(TlogReader(whole[:100_000] + b"?" * 500 + whole[150_000:]), "damaged")
    feed.seek(0.0)
    for _ in range(400):
        feed.advance(0.01)
    assert any("bytes damaged" in line.text for line in feed.snapshot.messages)
    assert feed.snapshot.reached >= {4, 5}


def test_playing_and_seeking_reach_the_same_state():
    played = ReplayFeed(read_tlog(FLIGHT), "x")
    played.seek(0.0)
    for _ in range(400):
        played.advance(0.01)
    sought = ReplayFeed(read_tlog(FLIGHT), "x")
    sought.seek(4.0)
    fields = ("mode", "armed", "p", "q", "hybrid", "reached", "jumps", "energy", "mission", "landed_state", "v_history")
    for field in (*fields, "saturated_at", "parameters"):
        assert repr(getattr(played.snapshot, field)) == repr(getattr(sought.snapshot, field)), field
    assert not played.playing
    played.toggle()
    assert played.timeline.position == 0.0
