"""The plan being edited."""

from dataclasses import replace

import pytest

from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from darko_gcs.tui.plan_draft import PlanDraft
from protocol.errors import FileError
from protocol.plans import load
from tests.support.gcs.limited_plan import write_limited_plan
from tests.support.paths import DATA


def test_a_plan_with_a_bad_fence_is_refused_and_changes_nothing(tmp_path):
    draft = PlanDraft()
    bad_fence = {"version": 2, "circles": [], "polygons": [{"polygon": [[1, 2]]}]}
    bad = write_limited_plan(tmp_path, geoFence=bad_fence)
    with pytest.raises(FileError, match=r"geoFence\.polygons\[0\].*1 corners are too few for a polygon"):
        draft.take(load(bad), str(bad))
    assert draft == PlanDraft()


def test_a_plan_whose_edits_are_taken_back_is_the_vehicles_again():
    items = tuple(load(DATA / "square.plan").items)
    draft = PlanDraft()
    draft.follow_vehicle(replace(EMPTY_SNAPSHOT, mission=items))
    draft.vehicle_plans = (items, (), ())
    draft.edit(items[:2])
    assert draft.changed
    assert draft.is_at_risk
    assert draft.undo()
    assert not draft.changed
    assert draft.redo()
    assert draft.changed
