"""Plan files: a round trip loses nothing, and every error names its place."""

import json
import math
from contextlib import suppress
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.frames import Geodetic
from protocol.plans import MissionItem, Plan, load, save
from tests.support.paths import DATA

SQUARE = json.loads((DATA / "square.plan").read_text())

FLOAT32 = st.floats(width=32, allow_infinity=False, allow_nan=False) | st.just(math.nan)
GLOBAL = st.sampled_from([0, 3, 5, 6, 10, 11])
LOCAL = st.sampled_from([1, 2, 4, 7, 8, 9, 12, 20])
LATITUDE = st.integers(-900_000_000, 900_000_000)
LONGITUDE = st.integers(-1_800_000_000, 1_800_000_000)
INT32 = st.integers(-(2**31), 2**31 - 1)
PARAMS = st.tuples(FLOAT32, FLOAT32, FLOAT32, FLOAT32)
FREE_COMMANDS = st.sampled_from([20, 21, 22, 93, 178, 3000, 65535])


def item(command=16, frame=3, params=(0.0, 0.0, 0.0, math.nan), x=435648000, y=14811000, z=3.0, **others):
    return MissionItem(command=command, frame=frame, params=params, x=x, y=y, z=z, **others)


ITEMS = (
    st.builds(
        MissionItem,
        command=FREE_COMMANDS,
        frame=GLOBAL,
        params=PARAMS,
        x=LATITUDE,
        y=LONGITUDE,
        z=FLOAT32,
        autocontinue=st.booleans(),
        current=st.booleans(),
    )
    | st.builds(
        MissionItem,
        command=FREE_COMMANDS,
        frame=LOCAL,
        params=PARAMS,
        x=INT32,
        y=INT32,
        z=FLOAT32,
        autocontinue=st.booleans(),
    )
    | st.builds(
        item, st.just(16), GLOBAL, PARAMS, LATITUDE, LONGITUDE, FLOAT32.filter(math.isfinite), current=st.booleans()
    )
)
HOMES = st.builds(Geodetic, st.floats(-90, 90), st.floats(-180, 180), st.floats(-1e4, 1e5).map(lambda alt: alt or 1.0))
MISSIONS = st.builds(Plan, items=st.lists(ITEMS, max_size=6).map(tuple), planned_home=st.none() | HOMES)


def with_jump(plan, target):
    jump = item(mavlink.MAV_CMD_DO_JUMP, 2, (float(target), 3.0, 0.0, 0.0), 0, 0, 0.0)
    return replace(plan, items=(*plan.items, jump))


def saved(plan, folder, suffix):
    path = folder / f"mission{suffix}"
    save(plan, path)
    return path


@pytest.mark.long
@pytest.mark.parametrize("suffix", [".plan", ".waypoints"])
@given(plan=MISSIONS, target=st.integers(0, 6))
@settings(max_examples=60, deadline=None)
def test_a_saved_plan_is_loaded_unchanged(tmp_path_factory, suffix, plan, target):
    plan = with_jump(plan, min(target, len(plan.items)))
    path = saved(plan, tmp_path_factory.getbasetemp(), suffix)
    assert load(path) == plan
    assert load(path).source == path


JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-1000, 1000) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=8,
)
FREE_KEYS = st.dictionaries(st.sampled_from(["remark", "AltitudeMode", "planVersion"]), JSON, max_size=2)


@pytest.mark.long
@given(
    plan=MISSIONS,
    fence=FREE_KEYS,
    rally=FREE_KEYS,
    aside=st.tuples(FREE_KEYS, FREE_KEYS),
    speeds=st.tuples(st.floats(0, 100), st.floats(0, 100)),
    ids=st.permutations(range(1, 8)),
)
@settings(max_examples=60, deadline=None)
def test_uninterpreted_content_is_saved_unchanged(tmp_path_factory, plan, fence, rally, aside, speeds, ids):
    plan = replace(
        with_jump(plan, 0),
        geo_fence=fence,
        rally_points=rally,
        file_keys=aside[0],
        mission_keys=aside[1],
        cruise_speed=speeds[0],
        hover_speed=speeds[1],
    )
    count = len(plan.items)
    strange = [{"doJumpId": ids[k] + 100, "Altitude": k} for k in range(count)]
    plan = replace(plan, item_keys=tuple(strange))
    assert load(saved(plan, tmp_path_factory.getbasetemp(), ".plan")) == plan


def test_both_square_files_are_the_same_plan():
    plan, waypoints = load(DATA / "square.plan"), load(DATA / "square.waypoints")
    assert plan == waypoints
    assert plan.planned_home == Geodetic(43.5648, 1.4811, 150.0)
    assert [entry.command for entry in plan.items] == [22, 16, 16, 16, 16, 21]
    assert {entry.frame for entry in plan.items} == {3}


@pytest.mark.parametrize("name", ["square.plan", "square.waypoints"])
def test_a_file_in_our_own_format_is_saved_byte_for_byte(tmp_path, name):
    path = tmp_path / name
    save(load(DATA / name), path)
    assert path.read_text() == (DATA / name).read_text()


def test_the_content_chooses_the_reader_not_the_suffix(tmp_path):
    path = tmp_path / "misnamed.waypoints"
    path.write_text((DATA / "square.plan").read_text())
    assert load(path) == load(DATA / "square.plan")


def test_a_plan_without_items_is_a_plan(tmp_path):
    for suffix in (".plan", ".waypoints"):
        assert load(saved(Plan(), tmp_path, suffix)) == Plan()
    (tmp_path / "bare.txt").write_text("QGC WPL 110\n")
    assert load(tmp_path / "bare.txt") == Plan()


def test_positions_are_rounded_to_the_nearest_step(tmp_path):
    path = tmp_path / "mission.waypoints"
    home = "0\t1\t0\t16\t0\t0\t0\t0\t1\t1\t1\t1"
    path.write_text(f"QGC WPL 110\n{home}\n1\t0\t3\t16\t0\t0\t0\t0\t43.56480006\t-1.48110006\t3\t1\n")
    (only,) = load(path).items
    assert (only.x, only.y) == (435648001, -14811001)


def test_an_open_position_is_null_in_the_file_and_int32_max_on_the_wire(tmp_path):
    plan = Plan(items=(item(22, x=2**31 - 1, y=2**31 - 1),))
    path = saved(plan, tmp_path, ".plan")
    assert json.loads(path.read_text())["mission"]["items"][0]["params"][3:6] == [None, None, None]
    assert load(path) == plan


def test_jumps_follow_the_ids_of_the_file(tmp_path):
    plan = with_jump(Plan(items=(item(), item(z=4.0))), 1)
    plan = replace(plan, item_keys=({"doJumpId": 40}, {"doJumpId": 7}, {"doJumpId": 1}))
    path = saved(plan, tmp_path, ".plan")
    assert json.loads(path.read_text())["mission"]["items"][2]["params"][0] == 7
    assert load(path).items[2].params[0] == 1.0
    assert saved(plan, tmp_path, ".waypoints").read_text().splitlines()[-1].split("\t")[4] == "2.00000000"


def test_comments_blank_lines_and_other_line_ends_are_accepted(tmp_path):
    path = tmp_path / "mission.txt"
    text = (DATA / "square.waypoints").read_text().replace("\n", "\r\n# a remark\r\n\r\n")
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert load(path) == load(DATA / "square.waypoints")


def edited(where, value):
    """The square with one value changed, at a path such as ``mission.items.0.params.4``."""
    root = json.loads(json.dumps(SQUARE))
    *way, last = [int(step) if step.isdigit() else step for step in where.split(".")]
    target = root
    for step in way:
        target = target[step]
    target[last] = value
    return json.dumps(root)


COMPLEX = {"type": "ComplexItem", "complexItemType": "survey"}


@pytest.mark.parametrize(
    ("where", "value", "complaint"),
    [
        ("fileType", "Parameters", r'fileType: "Parameters" where \'Plan\' was expected'),
        ("version", 2, "version: 2 where 1 was expected"),
        ("mission", [], "mission: a list is not an object"),
        ("mission.version", 1, "mission.version: 1 where 2 was expected"),
        ("mission.items", None, "mission.items: null is not a list"),
        ("mission.items.3", 5, r"mission.items\[3\]: 5 is not an object"),
        ("mission.items.3", COMPLEX, r"mission.items\[3\].complexItemType: 'survey' carries no items: save the plan"),
        ("mission.items.3", {"type": "Other"}, r"mission.items\[3\].type: 'Other' is neither a SimpleItem nor"),
        ("mission.items.3.command", "16", r"mission.items\[3\].command: \"16\" is not a whole number"),
        ("mission.items.3.frame", 99, r"mission.items\[3\]: frame 99 is not a MAV_FRAME"),
        ("mission.items.3.params", [1, 2], r"mission.items\[3\].params: 2 numbers where 7 were expected"),
        ("mission.items.3.params.1", "x", r"mission.items\[3\].params\[1\]: \"x\" is not a number"),
        ("mission.items.3.params.1", 1e39, r"mission.items\[3\]: .* does not fit the wire"),
        ("mission.items.3.params.4", None, r"mission.items\[3\]: latitude is missing, but command 16"),
        ("mission.items.3.params.4", 90.1, r"mission.items\[3\]: latitude 90.1 is not in -90..90 deg"),
        ("mission.items.3.params.5", -200, r"mission.items\[3\]: longitude -200.0 is not in -180..180 deg"),
        ("mission.items.3.autoContinue", "yes", r"mission.items\[3\].autoContinue: \"yes\" is neither true nor false"),
        ("mission.items.3.doJumpId", 1, r"mission.items\[3\].doJumpId: 1 is also that of item 0"),
        ("mission.items.3.command", 177, r"mission.items\[3\].params\[0\]: no item has the doJumpId 2"),
        ("mission.cruiseSpeed", None, "mission.cruiseSpeed: null is not a number"),
        ("mission.plannedHomePosition", [1, 2], "mission.plannedHomePosition: 2 numbers where 3"),
        ("mission.plannedHomePosition", [100, 2, 3], "mission.plannedHomePosition: 100, 2, 3 is not on the globe"),
        ("geoFence", 3, "geoFence: 3 is not an object"),
    ],
)
def test_a_refused_plan_names_file_place_and_value(tmp_path, where, value, complaint):
    path = tmp_path / "bad.plan"
    text = edited(where, value)
    if "no item has the doJumpId" in complaint:
        text = text.replace('"doJumpId": 2', '"doJumpId": 200')
    path.write_text(text)
    with pytest.raises(FileError, match=r"bad\.plan: " + complaint):
        load(path)


HOME_ROW = "0 1 0 16 0 0 0 0 43.5 1.4 150 1"


@pytest.mark.parametrize(
    ("rows", "complaint"),
    [
        (["0 1 0 22 0 0 0 0 43.5 1.4 150 1"], "2: row 0 is the home position, .* not command 22"),
        (["0 1 0 16 0 0 0 0 99 1.4 150 1"], "2: home 99, 1.4, 150 is not on the globe"),
        (["1 1 0 16 0 0 0 0 43.5 1.4 150 1"], "2: index 1 where 0 was expected"),
        ([HOME_ROW, "1 0 3 16 0 0 0 0 43.5 1.4 3"], "3: 11 columns, not 12"),
        ([HOME_ROW, "2 0 3 16 0 0 0 0 43.5 1.4 3 1"], "3: index 2 where 1 was expected"),
        ([HOME_ROW, "1 0 3 16 0 0 0 x 43.5 1.4 3 1"], "3: param4 is 'x', not a number"),
        ([HOME_ROW, "1 0 3 16.5 0 0 0 0 43.5 1.4 3 1"], "3: command is 16.5, not a whole number"),
        ([HOME_ROW, "1 0 77 16 0 0 0 0 43.5 1.4 3 1"], "3: frame 77 is not a MAV_FRAME"),
        ([HOME_ROW, "1 0 nan 16 0 0 0 0 43.5 1.4 3 1"], "3: frame is nan, not a whole number"),
        ([HOME_ROW, "1 0 3 16 0 0 0 0 nan 1.4 3 1"], "3: latitude is missing"),
        ([HOME_ROW, "1 0 3 16 inf 0 0 0 43 1.4 3 1"], "3: param1 is infinite"),
        ([HOME_ROW, "1 0 2 178 0 0 0 0 0.5 0 3 1"], "3: 0.5 is not a whole"),
        ([HOME_ROW, "1 0 2 177 2 0 0 0 0 0 3 1"], r"3: jumps to row 2; the items are rows 1\.\.1"),
    ],
)
def test_a_refused_waypoint_file_names_line_and_value(tmp_path, rows, complaint):
    path = tmp_path / "bad.waypoints"
    path.write_text("\n".join(["QGC WPL 110", *(row.replace(" ", "\t") for row in rows)]))
    with pytest.raises(FileError, match=r"bad\.waypoints:" + complaint):
        load(path)


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"QGC WPL 100\n", "'QGC WPL 100' is not 'QGC WPL 110' or 'QGC WPL 120'"),
        (b"", "neither a .plan"),
        (b"<xml/>", "neither a .plan"),
        (b"\xff\xfe\x00", "not a text file"),
        (b'{"fileType": NaN}', "not JSON: NaN is not a JSON number"),
        (b'{"fileType": ', "not JSON"),
        (b'{"a":' + b"[" * 100_000, "not JSON"),
    ],
)
def test_a_file_that_is_not_a_plan_is_refused(tmp_path, content, complaint):
    path = tmp_path / "bad"
    path.write_bytes(content)
    with pytest.raises(FileError, match=complaint):
        load(path)


@given(
    text=st.text(max_size=60), head=st.sampled_from(["", "QGC WPL 110\n", "{", '{"fileType": "Plan", "version": 1,'])
)
@settings(max_examples=100, deadline=None)
def test_any_text_is_a_plan_or_a_file_error(tmp_path_factory, text, head):
    path = tmp_path_factory.getbasetemp() / "any"
    path.write_text(head + text, encoding="utf-8", errors="replace")
    with suppress(FileError):
        assert isinstance(load(path), Plan)


def test_version_120_has_no_home_and_begins_with_the_first_item(tmp_path):
    path = tmp_path / "old.txt"
    rows = ["0 1 3 22 0 0 0 0 43.5 1.4 5 1", "1 0 3 16 0 0 0 0 43.5001 1.4 5 1", "2 0 2 177 1 3 0 0 0 0 0 1"]
    path.write_text("\n".join(["QGC WPL 120", *(row.replace(" ", "\t") for row in rows)]))
    plan = load(path)
    assert plan.planned_home is None
    assert [entry.command for entry in plan.items] == [22, 16, 177]
    assert plan.items[2].params[:2] == (1.0, 3.0)
    save(plan, tmp_path / "new.waypoints")
    assert load(tmp_path / "new.waypoints") == plan


def test_a_jump_out_of_a_file_of_version_120_is_refused(tmp_path):
    path = tmp_path / "old.txt"
    path.write_text("QGC WPL 120\n0\t1\t2\t177\t1\t3\t0\t0\t0\t0\t0\t1\n")
    with pytest.raises(FileError, match=r"2: jumps to row 1; the items are rows 0\.\.0"):
        load(path)


def test_a_missing_file_and_a_missing_folder_are_file_errors(tmp_path):
    with pytest.raises(FileError, match="cannot be read: No such file"):
        load(tmp_path / "none.plan")
    with pytest.raises(FileError, match="cannot be written: No such file"):
        save(Plan(), tmp_path / "none" / "mission.plan")
    with pytest.raises(FileError, match=r"the suffix of a plan is \.plan, \.waypoints, \.txt"):
        save(Plan(), tmp_path / "mission.doc")


@pytest.mark.parametrize("suffix", [".plan", ".waypoints"])
@pytest.mark.parametrize(
    ("bad", "complaint"),
    [
        (item(x=2**31 - 1), "item 0: latitude is missing"),
        (item(x=910_000_000), "item 0: latitude 91.0 is not in"),
        (item(frame=200), "item 0: frame 200 is not a MAV_FRAME"),
        (item(params=(math.inf, 0.0, 0.0, 0.0)), "item 0: param1 is infinite"),
        (item(177, 2, (1.0, 0.0, 0.0, 0.0), 0, 0), "item 0: jumps to item 1 of 1"),
    ],
)
def test_a_plan_that_could_not_be_loaded_is_not_saved(tmp_path, suffix, bad, complaint):
    path = saved(Plan(), tmp_path, suffix)
    before = path.read_bytes()
    with pytest.raises(FileError, match=complaint):
        save(Plan(items=(bad,)), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_plan_with_a_fence_is_not_saved_as_a_waypoint_file(tmp_path):
    plan = Plan(geo_fence={"circles": [{"radius": 4}], "polygons": [], "version": 2})
    with pytest.raises(FileError, match="cannot carry the plan's fence"):
        save(plan, tmp_path / "mission.waypoints")


def test_no_item_of_a_plan_file_is_the_current_one():
    assert {item.current for item in load(DATA / "square.plan").items} == {False}
