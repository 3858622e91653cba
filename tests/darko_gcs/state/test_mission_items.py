"""Mission items as the operator edits them: parameters named by command, text fields, and other frames."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from darko_gcs.state.mission_items import (
    FIELD_HELPS,
    MISSION_COMMANDS,
    PAYLOAD_COMMANDS,
    edited_item,
    field_help,
    in_frame,
    item_fields,
    item_summary,
    mission_command_of,
    new_item,
    place_of,
    shifted,
)
from protocol.dialect import mavlink
from protocol.frames import Geodetic
from protocol.plans import MissionItem, load
from protocol.units import UNKNOWN_INT32
from protocol.wire.codec import Codec
from tests.support.paths import DATA

FRAME_HOME = Geodetic(43.5648, 1.4811, 150.0)
AMSL, NED, RELATIVE, ENU = 0, 1, 3, 4
BODY = mavlink.MAV_FRAME_BODY_FRD
ITEM = MissionItem(
    command=mavlink.MAV_CMD_NAV_WAYPOINT,
    frame=RELATIVE,
    params=(0.0, 0.0, 0.0, math.nan),
    x=435649000,
    y=14812000,
    z=3.0,
)


def test_degrees_become_metres_and_heights_turn_over():
    item = in_frame(ITEM, NED, FRAME_HOME)
    assert item.x / 1e4 == pytest.approx(11.1, abs=0.1)  # 0.0001 deg
    assert item.y / 1e4 == pytest.approx(8.1, abs=0.1)
    assert item.z == pytest.approx(-3.0)
    east_first = in_frame(ITEM, ENU, FRAME_HOME)
    assert (east_first.x, east_first.y, east_first.z) == (item.y, item.x, pytest.approx(3.0))


def test_home_may_lie_beside_the_local_origin():
    here, beside = in_frame(ITEM, NED, FRAME_HOME), in_frame(ITEM, NED, FRAME_HOME, (5.0, -2.0, -1.0))
    assert ((beside.x - here.x) / 1e4, (beside.y - here.y) / 1e4) == (5.0, -2.0)
    assert beside.z - here.z == pytest.approx(-1.0)


@pytest.mark.parametrize("frame", [AMSL, NED, RELATIVE, ENU, 5, 6])
def test_there_and_back_is_the_same_place(frame):
    back = in_frame(in_frame(ITEM, frame, FRAME_HOME, (5.0, -2.0, -1.0)), RELATIVE, FRAME_HOME, (5.0, -2.0, -1.0))
    assert abs(back.x - ITEM.x) <= 12  # a centimetre
    assert abs(back.y - ITEM.y) <= 12
    assert back.z == pytest.approx(3.0, abs=1e-3)


def test_a_height_above_home_becomes_one_above_the_sea():
    assert in_frame(ITEM, AMSL, FRAME_HOME).z == 153.0
    assert math.isnan(in_frame(replace(ITEM, z=math.nan), AMSL, FRAME_HOME).z)


@pytest.mark.parametrize(
    ("item", "frame", "home", "problem"),
    [
        (ITEM, NED, None, "home is not known yet"),
        (replace(ITEM, x=UNKNOWN_INT32), NED, FRAME_HOME, "nothing to convert"),
        (replace(ITEM, z=math.nan), NED, FRAME_HOME, "nothing to convert"),
        (ITEM, BODY, FRAME_HOME, "cannot be converted to MAV_FRAME 12"),
        (replace(ITEM, frame=BODY), RELATIVE, FRAME_HOME, "numbers of MAV_FRAME 12 cannot"),
    ],
)
def test_numbers_that_cannot_be_converted_are_refused(item, frame, home, problem):
    with pytest.raises(ValueError, match=problem):
        in_frame(item, frame, home)


def test_an_edit_of_the_frame_and_a_number_reads_the_number_in_the_old_frame():
    texts = [text for _, text in item_fields(ITEM)]
    texts[1], texts[-1] = str(NED), "20"
    item = edited_item(ITEM, texts, FRAME_HOME)
    assert (item.frame, item.z) == (NED, pytest.approx(-20.0))


@pytest.mark.parametrize("frame", [AMSL, NED, RELATIVE, ENU])
def test_an_item_is_moved_in_its_own_frame(frame):
    item = in_frame(ITEM, frame, FRAME_HOME)
    north, east, down = place_of(item, FRAME_HOME)
    there = shifted(item, (3.0, -4.0, 2.0), FRAME_HOME)
    assert there.frame == frame
    assert place_of(there, FRAME_HOME) == pytest.approx((north + 3.0, east - 4.0, down - 2.0), abs=0.02)


def test_a_level_move_leaves_the_height_as_it_is_to_the_last_bit():
    item = replace(ITEM, z=0.1)
    assert shifted(item, (1.0, 0.0, 0.0), FRAME_HOME).z == item.z


@pytest.mark.parametrize(
    "item",
    [
        replace(ITEM, frame=mavlink.MAV_FRAME_MISSION),
        replace(ITEM, x=UNKNOWN_INT32),
        replace(ITEM, x=0, y=0),
        replace(ITEM, z=math.nan),
        replace(ITEM, frame=BODY),
    ],
)
def test_an_item_without_a_place_of_its_own_cannot_be_moved(item):
    assert place_of(item, FRAME_HOME) is None
    with pytest.raises(ValueError, match="no place of its own"):
        shifted(item, (1.0, 0.0, 0.0), FRAME_HOME)


HOME = (43.5648, 1.4811, 3.0)
WAYPOINT = MissionItem(
    command=mavlink.MAV_CMD_NAV_WAYPOINT,
    frame=mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT,
    params=(2.0, 0.3, 0.0, math.nan),
    x=435648000,
    y=14811000,
    z=3.0,
)


def mission_command(number):
    return next(entry for entry in MISSION_COMMANDS if entry.command == number)


def labels(item):
    return [label for label, _ in item_fields(item)]


def with_texts(item, home=None, **texts):
    """The item after some of its fields were typed over, found by the beginning of their labels."""
    shown = item_fields(item)
    values = [text for _, text in shown]
    for name, text in texts.items():
        values[next(k for k, (label, _) in enumerate(shown) if label.lower().startswith(name))] = text
    return edited_item(item, values, home)


def unedited(item):
    return edited_item(item, [text for _, text in item_fields(item)])


@pytest.mark.parametrize("command", MISSION_COMMANDS, ids=lambda command: command.label)
def test_a_new_item_of_every_command_survives_the_wire_and_the_editor(command):
    item = new_item(command, None, HOME)
    assert unedited(item) == item
    codec = Codec(255, 190)
    (message,) = codec.decode(codec.encode(item.to_message(0, 1, 1)))
    assert MissionItem.from_message(message) == item


numbers = st.one_of(st.floats(width=32, allow_infinity=False), st.just(math.nan))
wire_integers = st.integers(-(2**31), 2**31 - 1)


@given(
    st.sampled_from([*(entry.command for entry in MISSION_COMMANDS), mavlink.MAV_CMD_NAV_SPLINE_WAYPOINT]),
    st.sampled_from([0, 1, 2, 3, 4, 6]), st.tuples(numbers, numbers, numbers, numbers), wire_integers, wire_integers,
    numbers,
)  # fmt: skip
def test_fields_that_are_not_edited_keep_every_bit(command, frame, params, x, y, z):
    item = MissionItem(command=command, frame=frame, params=params, x=x, y=y, z=z)
    assert unedited(item) == item


@pytest.mark.parametrize(
    ("command", "names"),
    [
        ("WAYPOINT", ["Hold [s]", "Acceptance [m], 0 usual", "Pass radius [m]", "Yaw [deg], - as it is"]),
        ("LOITER_TURNS", ["Turns", "Radius [m], - anticlockwise", "Yaw, or exit path (0, 1)"]),
        ("LOITER_TIME", ["Time [s]", "Radius [m], - anticlockwise", "Yaw, or exit path (0, 1)"]),
        ("LOITER_UNLIM", ["Radius [m], - anticlockwise", "Yaw [deg], - as it is"]),
    ],
)
def test_parameters_have_the_names_that_their_command_gives_them(command, names):
    item = new_item(mission_command(getattr(mavlink, f"MAV_CMD_NAV_{command}")), WAYPOINT, None)
    assert labels(item)[2:] == [*names, "Latitude [deg]", "Longitude [deg]", "Altitude [m]"]
    assert (item.x, item.y, item.z) == (WAYPOINT.x, WAYPOINT.y, WAYPOINT.z)


def test_commands_without_a_place_have_no_place_fields():
    for command in (mavlink.MAV_CMD_DO_VTOL_TRANSITION, mavlink.MAV_CMD_DO_CHANGE_SPEED):
        item = new_item(mission_command(command), WAYPOINT, HOME)
        assert item.frame == mavlink.MAV_FRAME_MISSION
        assert not any("Latitude" in label for label in labels(item))


def test_an_unused_parameter_with_a_value_is_not_hidden():
    item = MissionItem(
        command=mavlink.MAV_CMD_DO_VTOL_TRANSITION,
        frame=mavlink.MAV_FRAME_MISSION,
        params=(4.0, 0.0, 7.5, 0.0),
        x=0,
        y=0,
        z=0.0,
    )
    assert "param3" in labels(item)
    assert with_texts(item, param3="0").params == (4.0, 0.0, 0.0, 0.0)


def test_each_field_changes_its_own_value():
    assert with_texts(WAYPOINT, hold="5").params[0] == 5.0
    assert with_texts(WAYPOINT, **{"pass": "-12.5"}).params[2] == -12.5
    assert with_texts(WAYPOINT, yaw="90").params[3] == 90.0
    assert math.isnan(with_texts(with_texts(WAYPOINT, yaw="90"), yaw="-").params[3])
    assert with_texts(WAYPOINT, latitude="43.6").x == 436000000
    assert with_texts(WAYPOINT, longitude="-").y == UNKNOWN_INT32
    assert with_texts(WAYPOINT, altitude="20").z == 20.0


def test_another_command_begins_with_its_own_defaults_at_the_same_place():
    circle = with_texts(WAYPOINT, command="nav loiter turns")
    assert circle.command == mavlink.MAV_CMD_NAV_LOITER_TURNS
    assert circle.params[:3] == (2.0, 0.0, 30.0)
    assert (circle.x, circle.y) == (WAYPOINT.x, WAYPOINT.y)
    transition = with_texts(WAYPOINT, command="MAV_CMD_DO_VTOL_TRANSITION")
    assert (transition.frame, transition.params) == (mavlink.MAV_FRAME_MISSION, (4.0, 0.0, 0.0, 0.0))
    assert with_texts(transition, command="16").frame == mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT


@pytest.mark.parametrize("text", ["global", "Global", "0", "MAV_FRAME_GLOBAL"])
def test_a_frame_is_given_by_name_or_number(text):
    assert dict(item_fields(WAYPOINT))["Frame (name or MAV_FRAME)"] == "global relative alt"
    assert with_texts(WAYPOINT, Geodetic(43.5, 1.4, 100.0), frame=text).frame == mavlink.MAV_FRAME_GLOBAL


@pytest.mark.parametrize(
    ("field", "text", "problem"),
    [
        ("hold", "x", r"Hold \[s\]: 'x' is not a number"),
        ("altitude", "inf", r"Altitude \[m\]: 'inf' is not a number"),
        ("command", "fly away", "'fly away' is neither a MAV_CMD nor its number"),
        ("frame", "rel", "Frame: 'rel' is neither a MAV_FRAME nor its number"),
        ("frame", "99", "Frame: '99' is neither a MAV_FRAME nor its number"),
    ],
)
def test_a_text_that_cannot_be_read_is_reported_with_the_name_of_its_field(field, text, problem):
    with pytest.raises(ValueError, match=problem):
        with_texts(WAYPOINT, **{field: text})


def test_a_value_that_does_not_fit_the_wire_is_refused():
    for field, text in (("latitude", "9999"), ("command", "70000"), ("altitude", "1e39"), ("hold", "-1e39")):
        with pytest.raises(ValueError, match=r"from .* to .*, not "):
            with_texts(WAYPOINT, **{field: text})


def test_a_summary_has_only_the_parameters_that_are_set():
    assert item_summary(WAYPOINT) == "hold 2, acceptance 0.3"
    by_label = {entry.label: item_summary(new_item(entry, WAYPOINT, None)) for entry in MISSION_COMMANDS}
    assert by_label["Transition"] == "to forward flight"
    assert by_label["Change speed"] == "12 m/s airspeed"
    assert by_label["Loiter for turns"] == "turns 2, radius 30"


def test_a_waypoint_needs_a_place_or_a_home():
    without_place = next(entry for entry in MISSION_COMMANDS if not entry.has_place)
    assert new_item(MISSION_COMMANDS[0], None, None) is None
    assert new_item(without_place, None, None) is not None


def test_the_commands_of_a_plan_file_are_known():
    labels_of_file = {mission_command_of(item).label for item in load(DATA / "square.plan").items}
    assert labels_of_file == {"Take off", "Waypoint", "Land"}


def test_every_item_of_a_survey_of_qgroundcontrol_is_named():
    labels = [mission_command_of(entry).label for entry in load(DATA / "survey.plan").items]
    assert labels[:6] == ["Camera mode", "Take off", "Waypoint", "Waypoint", "Images by distance", "Waypoint"]
    assert labels[-5:] == ["Landing begins", "Images by distance", "Stop images", "Circle to a height", "Land"]


def test_the_numbers_of_a_camera_item_are_told_and_kept_when_it_is_edited():
    trigger = load(DATA / "survey.plan").items[4]
    assert item_summary(trigger) == "distance 25, at 1"
    texts = [text for _, text in item_fields(trigger)]
    assert edited_item(trigger, texts) == trigger


@pytest.mark.parametrize(
    "kind", [*MISSION_COMMANDS, *PAYLOAD_COMMANDS], ids=lambda kind: f"{kind.label} {kind.command}"
)
def test_every_field_of_an_item_is_explained_in_a_line(kind):
    labels = [name for name in kind.params if name]
    assert [label for label in labels if label not in FIELD_HELPS] == []
    assert max((len(field_help(label)) for label in labels), default=0) <= 58  # cells of a dialog
