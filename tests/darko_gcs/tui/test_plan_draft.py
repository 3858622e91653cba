"""The plan that the operator edits, how it compares with the vehicle's, and the files that were opened lately."""

import json
from dataclasses import replace

import pytest

from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from darko_gcs.tui.plan_draft import MAX_FILES, PlanDraft, RecentFiles
from protocol.errors import FileError
from protocol.frames import Geodetic
from protocol.plans import load, save
from tests.support.gcs.limited_plan import write_limited_plan
from tests.support.gcs.snapshots import snapshot_with
from tests.support.paths import DATA


def made(folder, name):
    path = folder / name
    path.touch()
    return str(path)


def test_the_newest_comes_first_and_once_and_is_known_the_next_time(tmp_path):
    a, b = made(tmp_path, "a.plan"), made(tmp_path, "b.plan")
    recent = RecentFiles(tmp_path / "state" / "recent-plans")
    for path in (a, b, a):
        recent.add(path)
    assert recent.paths == RecentFiles(tmp_path / "state" / "recent-plans").paths == (a, b)


def test_files_that_are_gone_are_left_out(tmp_path):
    recent = RecentFiles()
    recent.add(made(tmp_path, "a.plan"))
    (tmp_path / "a.plan").unlink()
    assert recent.paths == ()


def test_only_so_many_are_kept(tmp_path):
    recent = RecentFiles()
    for number in range(MAX_FILES + 5):
        recent.add(made(tmp_path, f"{number}.plan"))
    assert len(recent.paths) == MAX_FILES


def test_a_file_that_cannot_be_read_or_written_is_no_failure(tmp_path):
    (tmp_path / "recent-plans").write_bytes(b"\xff\xfe")
    recent = RecentFiles(tmp_path / "recent-plans")
    assert recent.paths == ()
    in_the_way = RecentFiles(tmp_path / "recent-plans" / "below")
    in_the_way.add(made(tmp_path, "a.plan"))
    assert in_the_way.paths == (str(tmp_path / "a.plan"),)


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
    draft.follow_vehicle(snapshot_with(EMPTY_SNAPSHOT, plans={"mission": items}))
    draft.vehicle_plans = (items, (), ())
    draft.edit(items[:2])
    assert draft.changed
    assert draft.is_at_risk
    assert draft.undo()
    assert not draft.changed
    assert draft.redo()
    assert draft.changed


def test_an_edit_keeps_the_survey_of_a_file(tmp_path):
    draft = PlanDraft()
    draft.take(load(DATA / "survey.plan"), "survey.plan")
    draft.edit(draft.plan.items[1:])
    save(draft.plan, tmp_path / "edited.plan")
    rows = json.loads((tmp_path / "edited.plan").read_text())["mission"]["items"]
    assert [row.get("complexItemType") for row in rows] == [None, "survey", "vtolLandingPattern"]
    draft.follow_vehicle(snapshot_with(EMPTY_SNAPSHOT, plans={"mission": draft.plan.items[1:], "fence": draft.fence}))
    assert len(draft.plan.complex_items) == 2
    assert len(draft.plan.geo_fence["breachReturn"]) == 3


def test_a_plan_without_a_home_is_saved_with_the_vehicles_for_qgroundcontrol_takes_none_without(tmp_path):
    home, planned = Geodetic(43.5, 1.5, 150.0), Geodetic(44.0, 2.0, 100.0)
    draft = PlanDraft()
    draft.follow_vehicle(snapshot_with(EMPTY_SNAPSHOT, plans={"mission": tuple(load(DATA / "square.plan").items)}))
    save(draft.to_save(snapshot_with(EMPTY_SNAPSHOT, position={"home": home})), tmp_path / "x.plan")
    assert json.loads((tmp_path / "x.plan").read_text())["mission"]["plannedHomePosition"] == [43.5, 1.5, 150.0]
    draft.plan = replace(draft.plan, planned_home=planned)
    assert draft.to_save(snapshot_with(EMPTY_SNAPSHOT, position={"home": home})).planned_home == planned
    assert PlanDraft().to_save(EMPTY_SNAPSHOT).planned_home is None
