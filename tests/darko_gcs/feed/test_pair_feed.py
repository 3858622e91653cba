"""Two recordings on one clock: each stands where it stands alone at its own time."""

import numpy as np
import pytest

from darko_gcs.errors import GroundError
from darko_gcs.feed.pair_feed import Alignment, PairFeed, Place
from darko_gcs.feed.player import MarkKind
from darko_gcs.feed.recorded_states import height_series, take_off_row, v_series
from darko_gcs.feed.replay_feed import ReplayFeed
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.tlog import TlogReader
from tests.support.gcs.messages import heartbeat, position
from tests.support.logs import T0, bare, log_of
from tests.support.vehicle.darko_messages import hybrid_state

SECOND = 1_000_000  # [us]


def flight_log(waiting, *, rate=1.0, start=T0, height=2.0):
    """A vehicle that stands for some seconds, then climbs by ``height`` a second for ten; ``rate`` s of it a second."""
    climb = (position(1000 * second, 0.0, z=-height * max(0, second - waiting)) for second in range(waiting + 10))
    messages = [heartbeat(armed=True), *climb]
    return TlogReader(log_of(map(bare, messages), step=int(SECOND / rate), start=start))


def replay(reader):
    return ReplayFeed(reader, "x")


@pytest.fixture
def pair():
    """The second one waits longer, and its simulation runs twice as fast."""
    return PairFeed(replay(flight_log(5)), replay(flight_log(8, rate=2.0)))


def heights(pair):
    return [-flight.feed.snapshot.position.p[2] for flight in pair.flights]


async def test_take_offs_are_at_the_same_time_on_the_vehicles_clocks(pair):
    await pair.open()
    for seconds in (0.0, 1.0, 5.0, 8.0):
        pair.seek(seconds - pair.common + pair.now)
        assert pair.common == pytest.approx(seconds)
        assert heights(pair) == pytest.approx([2.0 + 2.0 * seconds] * 2)


def test_recordings_are_aligned_by_their_beginnings_and_by_the_date(pair):
    pair.next_alignment()
    assert pair.alignment is Alignment.START
    assert pair.flights[1].common_time(0.0) == 0.0
    later = PairFeed(replay(flight_log(5)), replay(flight_log(5, start=T0 + 7 * SECOND)), alignment=Alignment.CLOCK)
    assert later.flights[1].common_time(0.0) == pytest.approx(7.0)
    assert later.duration == pytest.approx(7.0 + 15.0)


@pytest.mark.parametrize("alignment", list(Alignment))
def test_each_flight_is_as_it_is_alone_at_its_own_time(alignment):
    readers = flight_log(5), flight_log(8, rate=2.0, height=3.0)
    pair = PairFeed(*map(replay, readers), alignment=alignment, shift=1.5)
    for time in np.linspace(0.0, pair.duration, 23).tolist():
        pair.seek(time)
        for reader, flight in zip(readers, pair.flights, strict=True):
            alone = replay(reader)
            alone.seek(flight.feed.now)
            assert flight.feed.snapshot == alone.snapshot
            assert flight.feed.timeline.played == np.count_nonzero(flight.clock <= pair.common + 1e-6) or (
                flight.place is Place.BEFORE
            )
    assert pair.snapshot is pair.flights[0].feed.snapshot


async def test_a_long_wait_before_one_take_off_is_not_played_alone():
    pair = PairFeed(replay(flight_log(5)), replay(flight_log(845)))
    await pair.open()
    assert pair.common == pytest.approx(-7.0)
    assert [flight.place for flight in pair.flights] == [Place.INSIDE, Place.INSIDE]
    pair.seek(0.0)
    assert pair.common == pytest.approx(-847.0)
    told = PairFeed(replay(flight_log(5)), replay(flight_log(845)), begin=10.0)
    await told.open()
    assert told.now == 10.0


def test_recordings_that_share_no_time_are_not_aligned_by_the_date():
    feeds = replay(flight_log(5)), replay(flight_log(5, start=T0 + 10**6 * SECOND))
    pair = PairFeed(*feeds)
    for rule in (Alignment.START, Alignment.TAKE_OFF):
        pair.next_alignment()
        assert pair.alignment is rule
    with pytest.raises(GroundError, match="x and x share no time by the date"):
        PairFeed(*feeds, alignment=Alignment.CLOCK)


def test_a_shift_moves_the_second_flight_and_leaves_the_first_where_it_is(pair):
    pair.seek(8.0)
    first, second = (flight.feed.now for flight in pair.flights)
    pair.move_second(1.0)
    assert pair.shift == 1.0
    assert pair.flights[0].feed.now == pytest.approx(first)
    assert pair.flights[1].feed.now == pytest.approx(second - 0.5)  # of a recording at twice the speed
    pair.next_alignment()
    assert pair.shift == 0.0


def test_a_step_goes_to_the_next_record_of_either(pair):
    pair.next_alignment()  # by the beginnings: one record a second, and two
    pair.seek(4.0)
    times = []
    for records in (1, 1, 1, -1, -1):
        pair.step(records)
        times.append(pair.now)
    assert times == [4.5, 5.0, 5.5, 5.0, 4.5]
    assert not pair.playing


def test_the_first_one_s_screens_have_its_own_clock():
    """On the common clock its last heartbeat would be old: it plays twice as fast as it was recorded."""
    pair = PairFeed(replay(flight_log(8, rate=2.0)), replay(flight_log(5)))
    pair.seek(pair.duration - 1.0)
    first = pair.flights[0].feed
    assert pair.snapshot_now == first.now
    assert pair.now > pair.snapshot_now + 3.0
    assert first.snapshot_now == first.now


def test_marks_tell_whose_they_are_and_are_sought(pair):
    text = mavlink.MAVLink_statustext_message(mavlink.MAV_SEVERITY_WARNING, b"low")
    log = TlogReader(log_of([bare(heartbeat(armed=True)), bare(text)], step=3 * SECOND))
    pair = PairFeed(replay(log), replay(flight_log(5)), alignment=Alignment.START)
    (mark,) = (mark for mark in pair.marks if mark.kind is MarkKind.WARNING)
    assert (mark.text, mark.time) == ("A: low", 3.0)
    pair.seek(0.0)
    assert pair.seek_mark(MarkKind.WARNING, 1) is mark
    assert pair.now == 3.0


def test_it_says_when_a_recording_has_not_begun_or_has_ended():
    pair = PairFeed(replay(flight_log(1)), replay(flight_log(1)), alignment=Alignment.START, shift=5.0)
    pair.seek(1.0)
    assert [flight.place for flight in pair.flights] == [Place.INSIDE, Place.BEFORE]
    pair.seek(pair.duration)
    assert [flight.place for flight in pair.flights] == [Place.BEHIND, Place.INSIDE]


async def test_it_plays_to_its_end(pair):
    await pair.open()
    pair.speed = 4.0
    for _ in range(100):
        pair.advance(0.1)
    assert not pair.playing
    assert pair.now == pair.duration


def test_a_take_off_is_told_or_seen():
    stands, flies = (mavlink.MAVLink_extended_sys_state_message(0, state) for state in (1, 2))
    told = TlogReader(log_of(map(bare, [heartbeat(armed=True), stands, position(0, 0.0, z=-9.0), flies])))
    assert take_off_row(told, (1, 1)) == 3
    seen = flight_log(4, height=0.6)
    assert take_off_row(seen, (1, 1)) == 1 + 4 + 2
    assert take_off_row(TlogReader(log_of([bare(heartbeat(armed=True))])), (1, 1)) == 0


def test_v_is_that_of_the_law_in_force():
    values = {"v_hover": 3.0, "v_forward": 0.25}
    laws = [hybrid_state(0, Law.HOVER_LINEAR, **values), hybrid_state(100, Law.FORWARD_LINEAR, **values)]
    assert v_series(TlogReader(log_of(map(bare, laws))), (1, 1)).values.tolist() == [3.0, 0.25]


def test_a_height_without_a_local_frame_is_that_above_home():
    place = mavlink.MAVLink_global_position_int_message(0, 435649000, 14810000, 150_000, 12_500, 0, 0, 0, 0)
    assert height_series(TlogReader(log_of([bare(place)])), (1, 1)).values.tolist() == [12.5]
