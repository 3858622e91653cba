"""Snapshots are changed by making new ones."""

from dataclasses import FrozenInstanceError, replace

import pytest

from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, updated


def test_a_changed_snapshot_is_a_new_one_as_dataclasses_make_it():
    changed = updated(EMPTY_SNAPSHOT, armed=True, mode="HOLD")
    assert changed == replace(EMPTY_SNAPSHOT, armed=True, mode="HOLD") != EMPTY_SNAPSHOT
    assert EMPTY_SNAPSHOT.mode is None
    with pytest.raises(FrozenInstanceError):
        changed.mode = "LAND"


def test_a_field_that_no_snapshot_has_is_an_error():
    with pytest.raises(TypeError, match="has no altitude, colour"):
        updated(EMPTY_SNAPSHOT, colour=1, armed=True, altitude=2.0)
