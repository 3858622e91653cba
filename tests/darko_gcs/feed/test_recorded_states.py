"""The state at any record of a log equals the one after playing there."""

import numpy as np
import pytest

from darko_gcs.feed.recorded_states import KEPT_EVERY, MEASUREMENTS
from darko_gcs.feed.replay_feed import ReplayFeed
from protocol.dialect import mavlink
from protocol.tlog import TlogReader
from tests.support.gcs.globe import home_at, no_fix, on_globe, origin_at
from tests.support.gcs.messages import heartbeat, position
from tests.support.gcs.sample_logs import FORWARD_FLIGHT, hover_log, log_of_messages
from tests.support.gcs.snapshots import values_of
from tests.support.logs import bare, log_of, quadplane_log, unknown_frame
from tests.support.paths import DATA

STOPS = 25  # places of each log
LOCAL_POSITION = mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED


def status(words, severity=6, **sent_by):
    return bare(mavlink.MAVLink_statustext_message(severity, words), **sent_by)


def two_flights():
    """A restart of the vehicle, late messages, another vehicle, and messages with impossible numbers."""
    first = [bare(position(1000 * k, float(k), vx=1.0)) for k in range(1, 30)]
    again = [bare(position(100 * k, float(k), vx=2.0)) for k in range(1, 30)]
    late = bare(position(100, 77.0))
    return [
        bare(position(500, 5.0), system=9), status(b"before"), bare(heartbeat()), *first[:20], late, *first[20:],
        late, late, status(b"x" * 50), bare(heartbeat(armed=True)), unknown_frame(77_000, b"ab"),
        status(b"other", system=9), *again, bare(position(200_000, float("nan"))),
        bare(heartbeat(), system=9), *first[:5], status(b"end", 3),
    ]  # fmt: skip


def late_groups():
    """Groups of messages that come late, a short and a long step back that stay."""
    told = [*range(600, 640), *range(635, 638), *range(640, 660), *range(650, 656), *range(660, 670), *range(665, 740)]
    return [bare(heartbeat()), *(bare(position(1000 * k, float(k), vx=1.0)) for k in (*told, *range(3, 30)))]


def filter_state(flags):
    nan = float("nan")
    return mavlink.MAVLink_estimator_status_message(0, flags, nan, nan, nan, nan, nan, nan, nan, nan)


LOST = filter_state(mavlink.ESTIMATOR_ATTITUDE | mavlink.ESTIMATOR_POS_HORIZ_REL)
AIDED = filter_state(mavlink.ESTIMATOR_ATTITUDE | mavlink.ESTIMATOR_POS_HORIZ_ABS)


def lost_places():
    """A vehicle loses its place, finds it, loses it again, on the globe and in its frame, and restarts while lost."""
    globe = [on_globe(1000 * k, 40.0 + 0.7 * k) for k in range(1, 20)]
    first = [position(20_000 + 1000 * k, float(k)) for k in range(20)]
    again = [position(1000 * k, -float(k)) for k in range(1, 10)]
    messages = [
        heartbeat(), *globe[:7], LOST, *globe[7:12], AIDED, *globe[12:],
        *first[:5], LOST, *first[5:12], AIDED, *first[12:16], LOST, *first[16:], *again,
    ]  # fmt: skip
    return [bare(message) for message in messages]


def flights_on_globe():
    """No fix yet, home and origin told late, a loss of the fix, a restart, and at last a local position."""
    first = [on_globe(1000 * k, 40.0 + 0.7 * k, up=k, speed=0.7, heading=100 * k) for k in range(3, 30)]
    again = [on_globe(100 * k, -20.0, east=1.3 * k) for k in range(1, 30)]
    messages = [
        no_fix(900), heartbeat(), no_fix(1000), no_fix(2000), *first[:15], home_at(20.0), *first[15:20],
        origin_at(0.0), *first[20:], no_fix(30_000), no_fix(31_000), *again, home_at(30.0),
        position(3000, 5.0, vx=1.0), on_globe(3100, 77.0), position(3200, 6.0),
    ]  # fmt: skip
    return [bare(message) for message in messages]


def quadplane_on_globe():
    """The log of another autopilot, without its local positions."""
    whole = TlogReader(quadplane_log())
    return log_of([whole.frame(row) for row in np.flatnonzero(whole.ids != LOCAL_POSITION).tolist()], step=100_000)


LOGS = {
    "globe": lambda: log_of(flights_on_globe(), step=100_000),
    "quadplane on globe": quadplane_on_globe,
    "square": (DATA / "square-flight.tlog").read_bytes,
    "quadplane": quadplane_log,
    "hover": hover_log,
    "forward": lambda: log_of_messages(FORWARD_FLIGHT),
    "restart": lambda: log_of(two_flights(), step=100_000),
    "lost places": lambda: log_of(lost_places(), step=100_000),
    "late groups": lambda: log_of(late_groups(), step=100_000),
    "damaged": lambda: _damaged((DATA / "square-flight.tlog").read_bytes()),
    "without a vehicle": lambda: log_of([status(b"a"), status(b"b")]),
}


def _damaged(whole):
    return whole[:100_000] + b"?" * 500 + whole[150_000:]


def differences(one, other):
    """Names of the fields of two snapshots that differ; which whole metres a hover is near, the way there decides."""
    pairs = ((name, value, values_of(other)[name]) for name, value in values_of(one).items())
    pairs = (pair for pair in pairs if pair[0] != "position.near")
    return [name for name, a, b in pairs if repr(a) != repr(b) and not (isinstance(a, dict) and a == b)]


@pytest.mark.long(after=1)
@pytest.mark.parametrize("name", LOGS)
def test_a_sought_state_equals_a_played_one(name, monkeypatch):
    monkeypatch.setattr("darko_gcs.feed.replay_feed.MAX_PLAYED", 10**9)
    reader = TlogReader(LOGS[name]())
    played, sought = ReplayFeed(reader, "x"), ReplayFeed(reader, "x")
    for stop in range(STOPS + 1):
        time = played.timeline.duration * stop / STOPS
        played.advance(time - played.now) if stop else played.seek(0.0)
        sought.seek(played.now)
        assert sought.timeline.played == played.timeline.played
        assert differences(played.snapshot, sought.snapshot) == []


def test_the_log_with_a_restart_has_one():
    feed = ReplayFeed(TlogReader(LOGS["restart"]()), "x")
    feed.seek(feed.timeline.duration)
    assert feed.snapshot.link.restarts >= 1
    assert "The vehicle restarted" in [line.text for line in feed.snapshot.log.lines]


def test_a_group_of_late_messages_is_no_restart():
    feed = ReplayFeed(TlogReader(quadplane_log()), "x")
    feed.seek(feed.timeline.duration)
    assert feed.snapshot.link.restarts == 0


def test_a_long_track_and_a_long_log_of_texts_are_thinned_as_in_play():
    frames = [bare(heartbeat())]
    for k in range(2500):
        frames.append(bare(position(10 * k, 0.2 * k)))
        if k % 5 == 0:
            frames.append(status(b"text %d" % k))
    reader = TlogReader(log_of(frames, step=1000))
    played, sought = ReplayFeed(reader, "x"), ReplayFeed(reader, "x")
    played.seek(0.0)
    while played.playing:
        played.advance(0.2)
        sought.seek(played.now)
        assert differences(played.snapshot, sought.snapshot) == []
    assert len(played.snapshot.log.lines) == 300
    assert 1000 < len(played.snapshot.position.track) <= 1500


def test_messages_have_their_own_times():
    feed = ReplayFeed(TlogReader(LOGS["restart"]()), "x")
    feed.seek(feed.timeline.duration)
    times = {line.text: line.time for line in feed.snapshot.log.lines}
    assert times["before"] == pytest.approx(0.1)
    assert times["end"] == pytest.approx(feed.timeline.duration)


def test_a_seek_reads_as_few_messages_in_a_long_log_as_in_a_short_one(monkeypatch):
    frames = [bare(heartbeat())] + [frame for k in range(1500) for frame in (bare(position(k, 0.1 * k)), status(b"x"))]
    feed = ReplayFeed(TlogReader(log_of(frames)), "x")
    decoded = []
    message = feed.timeline.message
    monkeypatch.setattr(feed.timeline, "message", lambda row: decoded.append(row) or message(row))
    for share in (0.1, 0.5, 0.999, 0.3):
        decoded.clear()
        feed.seek(share * feed.timeline.duration)
        assert 0 < len(decoded) <= KEPT_EVERY + len(MEASUREMENTS)


def test_where_the_vehicle_has_lost_its_place_no_track_is_drawn():
    feed = ReplayFeed(TlogReader(log_of([bare(m) for m in (heartbeat(), *LOST_FLIGHT)], step=100_000)), "x")
    feed.seek(feed.timeline.duration)
    assert [north for north, _ in feed.snapshot.position.track] == [1.0, 2.0, 5.0]
    assert not feed.snapshot.estimates.is_place_lost


LOST_FLIGHT = (
    position(1000, 1.0), position(2000, 2.0), LOST, position(3000, 3.0), position(4000, 4.0), AIDED, position(5000, 5.0)
)  # fmt: skip
