"""Mission items as fields and back."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from darko_gcs.mission_items import KINDS, edited, fields, kind_of, made, words
from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.errors import LocalProtocolError
from protocol.plans import MissionItem, load
from protocol.units import UNKNOWN_INT32
from tests.support.paths import DATA

HOME = (43.5648, 1.4811)
WAYPOINT = MissionItem(mavlink.MAV_CMD_NAV_WAYPOINT, 3, (2.0, 0.3, 0.0, math.nan), 435648000, 14811000, 3.0)


def labels(item):
    return [label for label, _ in fields(item)]


def changed(item, **texts):
    """The item after some of its fields were typed over, found by the beginning of their labels."""
    shown = fields(item)
    values = [text for _, text in shown]
    for name, text in texts.items():
        values[next(k for k, (label, _) in enumerate(shown) if label.lower().startswith(name))] = text
    return edited(item, values)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.label)
def test_a_new_item_of_every_kind_goes_over_the_wire_and_through_the_editor_unchanged(kind):
    item = made(kind, None, HOME)
    assert edited(item, [text for _, text in fields(item)]) == item
    codec = Codec(255, 190)
    (message,) = codec.decode(codec.encode(item.to_message(0, 1, 1)))
    assert MissionItem.from_message(message) == item


numbers = st.one_of(st.floats(width=32, allow_infinity=False), st.just(math.nan))
wire = st.integers(-(2**31), 2**31 - 1)


@given(
    st.sampled_from([*(kind.command for kind in KINDS), mavlink.MAV_CMD_NAV_SPLINE_WAYPOINT]),
    st.sampled_from([0, 1, 2, 3, 4, 6]), st.tuples(numbers, numbers, numbers, numbers), wire, wire, numbers,
)  # fmt: skip
def test_what_is_not_touched_stays_to_the_last_bit(command, frame, params, x, y, z):
    item = MissionItem(command, frame, params, x, y, z)
    assert edited(item, [text for _, text in fields(item)]) == item


@pytest.mark.parametrize(
    ("command", "names"),
    [
        ("WAYPOINT", ["Hold [s]", "Acceptance radius [m]", "Pass radius [m]", "Yaw [deg]"]),
        ("LOITER_TURNS", ["Turns", "Radius [m], - anticlockwise", "Yaw, or leave from (0, 1)"]),
        ("LOITER_TIME", ["Time [s]", "Radius [m], - anticlockwise", "Yaw, or leave from (0, 1)"]),
        ("LOITER_UNLIM", ["Radius [m], - anticlockwise", "Yaw [deg]"]),
    ],
)
def test_parameters_are_named_as_the_command_names_them(command, names):
    kind = next(kind for kind in KINDS if kind.command == getattr(mavlink, f"MAV_CMD_NAV_{command}"))
    item = made(kind, WAYPOINT, None)
    assert labels(item)[2:] == [*names, "Latitude [deg]", "Longitude [deg]", "Altitude [m]"]
    assert (item.x, item.y, item.z) == (WAYPOINT.x, WAYPOINT.y, WAYPOINT.z)


def test_commands_without_a_place_show_none():
    for command in (mavlink.MAV_CMD_DO_VTOL_TRANSITION, mavlink.MAV_CMD_DO_CHANGE_SPEED):
        item = made(next(kind for kind in KINDS if kind.command == command), WAYPOINT, HOME)
        assert item.frame == mavlink.MAV_FRAME_MISSION
        assert not any("Latitude" in label for label in labels(item))


def test_an_unused_parameter_that_holds_something_is_not_hidden():
    item = MissionItem(mavlink.MAV_CMD_DO_VTOL_TRANSITION, 2, (4.0, 0.0, 7.5, 0.0), 0, 0, 0.0)
    assert "param3" in labels(item)
    assert changed(item, param3="0").params == (4.0, 0.0, 0.0, 0.0)


def test_each_field_changes_its_own_value():
    assert changed(WAYPOINT, hold="5").params[0] == 5.0
    assert changed(WAYPOINT, **{"pass": "-12.5"}).params[2] == -12.5
    assert changed(WAYPOINT, yaw="90").params[3] == 90.0
    assert math.isnan(changed(changed(WAYPOINT, yaw="90"), yaw="-").params[3])
    assert changed(WAYPOINT, latitude="43.6").x == 436000000
    assert changed(WAYPOINT, longitude="-").y == UNKNOWN_INT32
    assert changed(WAYPOINT, altitude="20").z == 20.0


def test_another_command_begins_with_its_own_parameters_at_the_same_place():
    circle = changed(WAYPOINT, command="nav loiter turns")
    assert circle.command == mavlink.MAV_CMD_NAV_LOITER_TURNS
    assert circle.params[:3] == (2.0, 0.0, 30.0)
    assert (circle.x, circle.y) == (WAYPOINT.x, WAYPOINT.y)
    transition = changed(WAYPOINT, command="MAV_CMD_DO_VTOL_TRANSITION")
    assert (transition.frame, transition.params) == (mavlink.MAV_FRAME_MISSION, (4.0, 0.0, 0.0, 0.0))
    assert changed(transition, command="16").frame == mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT


@pytest.mark.parametrize(
    ("field", "text", "words_of_it"),
    [
        ("hold", "x", r"Hold \[s\]: 'x' is not a number"),
        ("altitude", "inf", r"Altitude \[m\]: 'inf' is not a number"),
        ("command", "fly away", "'fly away' is neither a MAV_CMD nor its number"),
        ("frame", "rel", "Frame: 'rel' is not a whole number"),
        ("frame", "99", "there is no MAV_FRAME 99"),
    ],
)
def test_what_cannot_be_read_is_said_by_the_fields_name(field, text, words_of_it):
    with pytest.raises(ValueError, match=words_of_it):
        changed(WAYPOINT, **{field: text})


def test_what_does_not_fit_the_wire_is_refused():
    for field, text in (("latitude", "9999"), ("command", "70000")):
        with pytest.raises(LocalProtocolError):
            changed(WAYPOINT, **{field: text})


def test_items_are_told_in_few_words():
    assert words(WAYPOINT) == "hold 2, acceptance 0.3"
    by_label = {kind.label: words(made(kind, WAYPOINT, None)) for kind in KINDS}
    assert by_label["Transition"] == "to forward"
    assert by_label["Change speed"] == "12 m/s in the air"
    assert by_label["Loiter for turns"] == "turns 2, radius 30"


def test_without_a_place_or_a_home_no_waypoint_is_made():
    assert made(KINDS[0], None, None) is None
    assert made(next(kind for kind in KINDS if not kind.is_placed), None, None) is not None


def test_commands_of_a_file_are_known():
    assert {kind_of(item).label for item in load(DATA / "square.plan").items} == {"Take off", "Waypoint", "Land"}
