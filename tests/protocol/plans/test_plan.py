"""Plans: mission, fence and rally points as items, and why one is refused."""

import copy
import json
import math
from contextlib import suppress
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.errors import FileError, LocalProtocolError
from protocol.frames import LocalFrame
from protocol.plans import load, save
from protocol.plans.plan import MissionItem
from protocol.wire.codec import Codec
from tests.support.links.link import frame
from tests.support.paths import DATA


def test_items_are_equal_when_their_bits_on_the_wire_are():
    one = MissionItem(command=16, frame=3, params=(0.1, math.nan, 0.0, 0.0), x=1, y=2, z=3.0)
    assert one == MissionItem.from_message(Codec(1, 1).decode(frame(one.to_message(0, 1, 1)))[0])
    assert one == MissionItem(command=16, frame=3, params=(0.1, math.nan, 0.0, 0.0), x=1, y=2, z=3.0, current=True)
    assert len({one, MissionItem(command=16, frame=3, params=(0.1, math.nan, -0.0, 0.0), x=1, y=2, z=3.0)}) == 2


@pytest.mark.parametrize("change", [{"command": 70_000}, {"x": 2**31}, {"z": 1e39}, {"params": (0.0, 0.0, 0.0)}])
def test_an_item_that_does_not_fit_the_wire_raises(change):
    fields = {"command": 16, "frame": 3, "params": (0.0, 0.0, 0.0, 0.0), "x": 0, "y": 0, "z": 0.0}
    with pytest.raises(LocalProtocolError):
        MissionItem(**fields | change)


SURVEY = json.loads((DATA / "survey.plan").read_text())
SURVEY_COMMANDS = [16, 16, 206, 16, 206, 16]  # of one line: before it, along it with the camera on, after it
LANDING_COMMANDS = [189, 206, 2001, 31, 85]
HOME = SURVEY["mission"]["plannedHomePosition"]


def written(folder, edit):
    root = copy.deepcopy(SURVEY)
    edit(root["mission"]["items"])
    path = folder / "edited.plan"
    path.write_text(json.dumps(root))
    return path


def rows_of(path):
    return json.loads(path.read_text())["mission"]["items"]


def test_a_survey_and_a_landing_pattern_are_read_by_their_items():
    plan = load(DATA / "survey.plan")
    assert [item.command for item in plan.items] == [530, 84, *SURVEY_COMMANDS * 4, *LANDING_COMMANDS]
    circle, landing = plan.items[-2:]
    assert (circle.frame, circle.params, circle.z) == (3, (1.0, 40.0, 0.0, 1.0), 30.0)
    assert (landing.frame, landing.x, landing.z) == (3, round(HOME[0] * 1e7), 0.0)
    assert math.isnan(landing.params[3])


def test_complex_items_are_saved_as_they_were(tmp_path):
    save(load(DATA / "survey.plan"), tmp_path / "again.plan")
    assert rows_of(tmp_path / "again.plan") == rows_of(DATA / "survey.plan")
    assert load(tmp_path / "again.plan") == load(DATA / "survey.plan")


@pytest.mark.parametrize("kind", ["CorridorScan", "StructureScan", "anything"])
def test_whatever_carries_its_items_is_read_by_them(tmp_path, kind):
    path = written(tmp_path, lambda rows: rows[2].update(complexItemType=kind))
    assert load(path).items == load(DATA / "survey.plan").items


def test_an_edit_before_a_survey_keeps_it_and_its_ids_stay_unique(tmp_path):
    plan = load(DATA / "survey.plan")
    save(plan.with_items((plan.items[1], *plan.items[1:])), tmp_path / "edited.plan")
    rows = rows_of(tmp_path / "edited.plan")
    assert [row["type"] for row in rows] == ["SimpleItem"] * 2 + ["ComplexItem"] * 2
    assert [row["Altitude"] for row in rows[:2] if "Altitude" in row] == [30]  # what the file told of the old one
    inner = rows[2]["TransectStyleComplexItem"]["Items"]
    assert [row["doJumpId"] for row in (*rows[:2], *inner)] == list(range(1, 27))
    assert load(tmp_path / "edited.plan").items[1:] == plan.items[1:]


def test_a_survey_that_was_edited_is_saved_by_its_items(tmp_path):
    plan = load(DATA / "survey.plan")
    higher = replace(plan.items[5], z=45.0)
    save(plan.with_items((*plan.items[:5], higher, *plan.items[6:])), tmp_path / "edited.plan")
    rows = rows_of(tmp_path / "edited.plan")
    assert [row["type"] for row in rows] == ["SimpleItem"] * 26 + ["ComplexItem"]
    assert load(tmp_path / "edited.plan").items[5] == higher


def test_jumps_lead_into_a_survey_by_the_ids_of_its_items(tmp_path):
    def jump(rows):
        inner = rows[2]["TransectStyleComplexItem"]["Items"]
        params = [inner[3]["doJumpId"], 2, 0, 0, 0, 0, 0]
        rows.insert(3, {"type": "SimpleItem", "command": 177, "frame": 2, "params": params, "doJumpId": 900})

    plan = load(written(tmp_path, jump))
    assert plan.items[26].params[0] == 5.0
    save(plan, tmp_path / "again.plan")
    assert load(tmp_path / "again.plan") == plan


def test_a_fixed_wing_landing_pattern_of_the_first_version_is_read(tmp_path):
    def older(rows):
        pattern = rows[3]
        pattern |= {"complexItemType": "fwLandingPattern", "loiterCoordinate": pattern.pop("landingApproachCoordinate")}
        pattern |= {"loiterAltitudeRelative": False, "landAltitudeRelative": False, "loiterClockwise": False}
        del pattern["altitudesAreRelative"], pattern["stopTakingPhotos"]

    start, circle, landing = load(written(tmp_path, older)).items[-3:]
    assert (start.command, circle.command, landing.command) == (189, 31, 21)
    assert (circle.frame, circle.params[1], landing.frame, landing.params[3]) == (0, -40.0, 0, 0.0)


def test_a_landing_pattern_may_begin_with_a_waypoint_and_a_speed(tmp_path):
    path = written(tmp_path, lambda rows: rows[3].update(useLoiterToAlt=False, useDoChangeSpeed=True))
    start, speed, *_, approach, _landing = load(path).items[-6:]
    assert (start.command, speed.command, approach.command) == (189, 178, 16)
    assert speed.params[:3] == (0.0, 15.0, -1.0)


def structure(rows):
    camera = {"AdjustedFootprintSide": 10, "AdjustedFootprintFrontal": 8, "DistanceToSurface": 20}
    lat, lon = HOME[:2]
    rows[2] = {
        "type": "ComplexItem", "complexItemType": "StructureScan", "version": 3, "CameraCalc": camera, "Layers": 2,
        "EntranceAltitude": 50, "ScanBottomAlt": 6, "StructureHeight": 22, "GimbalPitch": -10, "StartFromTop": False,
        "polygon": [[lat, lon], [lat + 2e-4, lon], [lat + 2e-4, lon + 2e-4], [lat, lon + 2e-4]],
    }  # fmt: skip


def test_a_structure_scan_is_made_as_qgroundcontrol_makes_it(tmp_path):
    path = written(tmp_path, structure)
    plan = load(path)
    scan = plan.items[2:-5]
    layer = [16, 206, 16, 16, 16, 16, 206]
    assert [item.command for item in scan] == [16, 196, *layer * 2, 197, 16]
    assert [item.z for item in scan if item.command == 16] == [50.0, *[10.0] * 5, *[18.0] * 5, 50.0]
    assert (scan[1].x, scan[1].z, scan[3].params[0], scan[8].params[0]) == (-10, 90.0, 10.0, 0.0)
    frame = LocalFrame(plan.planned_home)
    here = frame.to_ned(replace(plan.planned_home, lat_deg=scan[0].x / 1e7, lon_deg=scan[0].y / 1e7))
    assert here[:2] == pytest.approx((-20.0, -20.0), abs=0.02)  # outside of the first corner
    save(plan, tmp_path / "again.plan")
    assert rows_of(tmp_path / "again.plan") == rows_of(path)


def test_the_order_of_a_structures_corners_does_not_matter(tmp_path):
    def turned(rows):
        structure(rows)
        rows[2]["polygon"] = [rows[2]["polygon"][0], *rows[2]["polygon"][:0:-1]]

    first, second = load(written(tmp_path, structure)).items, load(written(tmp_path, turned)).items
    assert {(item.x, item.y) for item in first} == {(item.x, item.y) for item in second}


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (
            lambda rows: rows[2].pop("TransectStyleComplexItem"),
            r"items\[2\]\.complexItemType: 'survey' carries no items",
        ),
        (lambda rows: rows[2]["TransectStyleComplexItem"].update(Items=[]), r"Items: 'survey' carries no items"),
        (lambda rows: rows[3].pop("landCoordinate"), r"items\[3\]\.landCoordinate: null is not a list"),
        (lambda rows: rows[3].update(loiterRadius=None), r"items\[3\]\.loiterRadius: null is not a number"),
        (lambda rows: rows[3].update(landCoordinate=[99, 1, 0]), r"items\[3\]: latitude 99.0 is not in"),
        (
            lambda rows: rows[2]["TransectStyleComplexItem"]["Items"][1].update(command="x"),
            r"items\[2\]\.TransectStyleComplexItem\.Items\[1\]\.command",
        ),
        (
            lambda rows: (structure(rows), rows[2].update(Layers=1e6)),
            r"items\[2\]\.Layers: 1e\+06 is not a number of layers",
        ),
        (
            lambda rows: (structure(rows), rows[2].update(polygon=[[1, 2], [1, 2], [1, 2]])),
            r"items\[2\]\.polygon: corners at one place",
        ),
        (
            lambda rows: (structure(rows), rows[2].update(polygon=[[1, 2], [3, "x"], [4, 5]])),
            r"items\[2\]\.polygon\[1\]\[1\]: \"x\" is not a number",
        ),
    ],
)
def test_a_complex_item_that_cannot_be_read_is_refused_by_name(tmp_path, edit, said):
    with pytest.raises(FileError, match=said):
        load(written(tmp_path, edit))


LEAVES = st.sampled_from([None, True, 0, -1, 1e9, 1e300, 91.0, "x", [], {}, [1, 2], [43.5, 1.4, 1e39]])


def places_of(value, way=()):
    """The way to every value of a JSON document."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [*([way] if way else []), *(place for key, part in inner for place in places_of(part, (*way, key)))]


@pytest.mark.long
@given(scan=st.booleans(), data=st.data())
@settings(max_examples=200, deadline=None)
def test_whatever_a_value_of_a_complex_item_becomes_it_is_read_or_refused(tmp_path_factory, scan, data):
    def spoil(rows):
        if scan:
            structure(rows)
        part = rows[data.draw(st.sampled_from([2, 3]))]
        *way, last = data.draw(st.sampled_from(places_of(part)))
        for key in way:
            part = part[key]
        part[last] = data.draw(LEAVES)

    with suppress(FileError):
        plan = load(written(tmp_path_factory.getbasetemp(), spoil))
        assert plan.complex_items[0].items == plan.items[2 : 2 + len(plan.complex_items[0].items)]


def test_items_of_a_landing_pattern_are_those_of_the_dialect():
    names = [mavlink.enums["MAV_CMD"][number].name for number in LANDING_COMMANDS]
    assert names[0] == "MAV_CMD_DO_LAND_START"
