"""Snapshots are changed by making new ones."""

import pytest

from darko_gcs.state.reduce import reduce
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from tests.support.gcs.messages import arrived, heartbeat, position
from tests.support.gcs.snapshots import values_of
from tests.support.vehicle.darko_messages import hybrid_state


def test_neither_a_snapshot_nor_a_part_of_it_changes_in_place():
    for name, part in EMPTY_SNAPSHOT._asdict().items():
        with pytest.raises(AttributeError):
            setattr(EMPTY_SNAPSHOT, name, None)
        for field in getattr(part, "_fields", ()):
            with pytest.raises(AttributeError):
                setattr(part, field, None)


def test_messages_leave_the_snapshot_before_them_as_it_was():
    s = EMPTY_SNAPSHOT
    for message in (heartbeat(), position(1000, 5.0), hybrid_state(1100)):
        s = reduce(s, arrived(message), 1.0)
    assert (s.link.arrivals.keys(), s.position.p) == ({"LOCAL_POSITION_NED", "DARKO_HYBRID_STATE"}, (5.0, 0.0, -3.0))
    assert repr(EMPTY_SNAPSHOT) == repr(Snapshot())
    assert not any(value for value in values_of(EMPTY_SNAPSHOT).values() if isinstance(value, dict))
