"""Panels of numbers: the flight, hover or forward flight on the current leg, and the estimate against the truth."""

import math

import pytest
from textual.app import App

from darko_gcs.state.reduce import reduce
from darko_gcs.state.values import Doubt, Truth
from darko_gcs.tui.map_content import flight_content
from darko_gcs.tui.widgets.flight_panel import DecisionPanel, FlightPanel, TruthPanel, decision_summary, paged
from darko_gcs.tui.widgets.panel import PANEL_STYLES
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason
from protocol.frames import multiply, quaternion_from_euler
from tests.support.gcs.messages import arrived
from tests.support.gcs.screens import panel_text, styled_text
from tests.support.gcs.snapshots import FORWARD, HOVERING, snapshot_with

ACTIVE, PAUSED = mavlink.MISSION_STATE_ACTIVE, mavlink.MISSION_STATE_PAUSED


@pytest.mark.parametrize(("state", "current", "is_past"), [(ACTIVE, 3, False), (ACTIVE, 4, True), (PAUSED, 3, True)])
def test_a_decision_on_a_leg_that_is_over_says_so(state, current, is_past):
    s = snapshot_with(
        FORWARD, mission={"state": state, "current": current}, link={"boot": FORWARD.guidance.decision.time + 12.0}
    )
    text = panel_text(DecisionPanel("", id="x"), s)
    assert "decided 12 s ago" in text
    assert ("a past leg" in text) == is_past
    assert decision_summary(s, 80).startswith("past leg to 3" if is_past else "leg to 3")


def test_the_decision_is_shortened_to_the_room_there_is():
    s = snapshot_with(FORWARD, mission={"state": ACTIVE, "current": 3})
    texts = {width: decision_summary(s, width) for width in (60, 36, 30, 20)}
    assert texts[60] == "leg to 3: forward, less energy, saves 65 %"
    assert texts[36] == texts[30] == "leg to 3: forward, less energy"
    assert texts[20] == "leg to 3: forward"


def test_no_line_of_the_decision_is_cut_in_the_panel_of_120_columns():
    longest = max(DecisionReason, key=lambda reason: len(reason.label))
    decision = FORWARD.guidance.decision._replace(reason=longest)
    s = snapshot_with(FORWARD, guidance={"decision": decision}, mission={"state": PAUSED}, link={"boot": 1e4})
    text = panel_text(DecisionPanel("", id="x"), s, width=37)
    assert longest.label in text
    assert max(map(len, text.split("\n"))) <= 37


def test_a_past_decision_is_not_in_the_colour_of_what_holds():
    s = snapshot_with(FORWARD, mission={"state": PAUSED, "current": 3})
    assert styled_text(DecisionPanel("", id="x").draw(s, 40, 9), "good") == ""
    assert "FORWARD" not in panel_text(DecisionPanel("", id="x"), s)
    active = snapshot_with(s, mission={"state": ACTIVE})
    assert "forward" in styled_text(DecisionPanel("", id="x").draw(active, 40, 9), "good")


TRUE = Truth(
    time=60.0,
    p=HOVERING.position.p,
    v=HOVERING.position.v,
    q=HOVERING.attitude.q,
    rates=(0.0,) * 3,
    wind=(0.0, 2.0, 0.0),
)
EQUAL = snapshot_with(
    HOVERING,
    estimates={"truth": TRUE, "doubt": Doubt((0.1, 0.1, 0.2), 0.05, 0.01)},
    position={"time": 60.0},
    attitude={"time": 60.0},
)


def error(text, label):
    """The first number of a line."""
    (line,) = [line for line in text.splitlines() if line.startswith(label)]
    return float(line.removeprefix(label).split()[0])


def panel():
    return TruthPanel("", id="x")


def test_an_estimate_equal_to_the_truth_has_no_error():
    text = panel_text(panel(), EQUAL)
    for label in ("north", "east", "height", "velocity north", "climb", "attitude"):
        assert error(text, label) == 0.0


def test_errors_have_signs_and_many_deviations_a_mark():
    true = TRUE._replace(p=(2.5, 0.8, -3.1), q=multiply(TRUE.q, quaternion_from_euler(0.0, 0.1, 0.0)))
    text = panel_text(panel(), snapshot_with(EQUAL, estimates={"truth": true}))
    assert error(text, "north") == -0.5
    assert error(text, "height") == pytest.approx(-0.1)
    assert error(text, "attitude") == pytest.approx(math.degrees(0.1), abs=0.01)
    lines = {line.split()[0]: line for line in text.splitlines()}
    assert lines["north"].endswith("5.0 > 3")
    assert lines["height"].endswith("0.5")


class PanelApp(App[None]):
    COMPONENT_CLASSES = {f"panel--{name}" for name in PANEL_STYLES}  # noqa: RUF012 - declared so by Textual

    def compose(self):
        yield panel()


async def test_in_a_turn_both_are_compared_at_the_time_of_the_estimate():
    """At 15 m/s along a circle of 20 m the position moves by 1.5 m from truth to truth, the velocity by 1.1 m/s."""

    def at(time):
        angle = 15.0 / 20.0 * time
        p = (20.0 * math.sin(angle), 20.0 * (1.0 - math.cos(angle)), -3.0)
        return p, (15.0 * math.cos(angle), 15.0 * math.sin(angle), 0.0)

    def told(time):
        p, v = at(time)
        return TRUE._replace(time=time, p=p, v=v)

    p, v = at(10.15)
    app = PanelApp()
    async with app.run_test(size=(60, 16)):
        shown = app.query_one(TruthPanel)
        shown.show_snapshot(snapshot_with(EQUAL, estimates={"truth": told(10.0)}), 10.0, is_due=False)
        here = {"p": p, "v": v, "time": 10.15}
        shown.show_snapshot(snapshot_with(EQUAL, estimates={"truth": told(10.1)}, position=here), 10.1)
        text = "\n".join("".join(part for part, _ in line) for line in shown.draw(shown.snapshot, 60, 16))
    for label in ("north", "east"):
        assert abs(error(text, label)) <= 0.03
    for label in ("velocity north", "velocity east"):
        assert abs(error(text, label)) <= 0.1


def test_a_truth_of_another_time_is_not_compared():
    assert "north                 --" in panel_text(panel(), snapshot_with(EQUAL, position={"time": 70.0}))


def test_the_filters_deviations_are_the_roots_of_its_variances():
    pose, velocity = [0.0] * 21, [0.0] * 21
    pose[0], pose[6], pose[11], pose[15], pose[18], pose[20] = 0.04, 0.09, 0.16, 1e-4, 4e-4, 9e-4
    velocity[0] = velocity[6] = 0.25
    message = mavlink.MAVLink_odometry_message(
        0, 1, 8, 0, 0, 0, [1.0, 0, 0, 0], 0, 0, 0, 0, 0, 0, pose, velocity, 0, mavlink.MAV_ESTIMATOR_TYPE_AUTOPILOT, 100
    )
    s = reduce(HOVERING, arrived(message), 1.0)
    assert s.estimates.doubt.p == pytest.approx((0.2, 0.3, 0.4))
    assert (s.estimates.doubt.v, s.estimates.doubt.attitude) == pytest.approx((0.5, 0.03))
    message.estimator_type = mavlink.MAV_ESTIMATOR_TYPE_NAIVE
    assert reduce(s, arrived(message), 1.0).estimates.doubt is None


def test_a_leg_without_a_number_is_over_in_modes_that_have_none_of_their_own():
    going = snapshot_with(
        HOVERING, status={"mode": "RTL"}, guidance={"decision": FORWARD.guidance.decision._replace(seq=None)}
    )
    landed = {"landed_state": mavlink.MAV_LANDED_STATE_ON_GROUND}
    assert not decision_summary(going, 60).startswith("past")
    for status in ({"mode": "POSCTL"}, {"mode": "TAKEOFF"}, {"mode": "LAND"}, {"mode": "MISSION"}, landed):
        assert decision_summary(snapshot_with(going, status=status), 60).startswith("past leg")


def decision_text(**changes):
    decision = FORWARD.guidance.decision._replace(**changes)
    s = snapshot_with(FORWARD, guidance={"decision": decision}, mission={"state": ACTIVE, "current": 3})
    return panel_text(DecisionPanel("", id="x"), s), decision_summary(s, 80)


def test_the_difference_is_told_only_where_there_was_a_choice_and_a_difference():
    assert "65 % less energy, 59 % less time" in decision_text()[0]
    costly = decision_text(reason=DecisionReason.COMMAND, hover_energy=1000.0, hover_time=12.1)
    assert "76 % more energy\n" in costly[0]
    assert "saves" not in costly[1]
    forced = decision_text(reason=DecisionReason.TOO_SHORT)
    assert "%" not in "".join(forced)


def test_a_wind_that_the_vehicle_hardly_knows_is_called_unobserved_without_a_direction():
    panel = FlightPanel("", id="x")
    known = snapshot_with(HOVERING, estimates={"wind_deviation": 0.4})
    assert "2.0 ±0.4 m/s from 270°" in panel_text(panel, known, width=37, height=30)
    landed = snapshot_with(known, status={"landed_state": mavlink.MAV_LANDED_STATE_ON_GROUND})
    assert "2.0 ±0.4 m/s unobserved" in panel_text(panel, landed, width=37, height=30)  # nothing tells it there
    assert flight_content(landed).wind is None
    guessed = panel_text(panel, snapshot_with(HOVERING, estimates={"wind_deviation": 3.0}), width=37, height=30)
    assert "2.0 ±3.0 m/s unobserved" in guessed
    assert max(map(len, guessed.split("\n"))) <= 37


def test_an_airspeed_that_nothing_measures_is_marked_as_an_estimate():
    s = snapshot_with(HOVERING, estimates={"airspeed": 11.5}, status={"has_measured_air": False})
    lines = panel_text(FlightPanel("", id="x"), s, width=37, height=30).split("\n")
    assert lines[2].rstrip().endswith("air   ~11.5 est")
    assert len(lines[2].rstrip()) <= 37
    assert "~11.5" in panel_text(FlightPanel("", id="x"), s, width=28, height=30)
    for measured in (True, None):
        told = snapshot_with(s, status={"has_measured_air": measured})
        assert "~" not in panel_text(FlightPanel("", id="x"), told, width=37, height=30)


@pytest.mark.parametrize(
    ("sizes", "height", "pages"),
    [
        ((6, 3), 8, (6, 3)),  # the heading is not left alone
        ((6, 1), 7, (7,)),
        ((6, 2), 8, (8,)),
        ((9,), 8, (7, 2)),  # no line alone
        ((8, 0, 1), 8, (8, 1)),  # nothing to join it with
        ((5, 12), 8, (8, 7, 2)),
        ((7, 12), 8, (7, 8, 4)),
        ((), 8, (0,)),
        ((4,), 1, (1, 1, 1, 1)),
    ],
)
def test_what_belongs_together_stays_on_one_page_where_it_fits(sizes, height, pages):
    groups = [[[(f"{group}.{line}", "")] for line in range(size)] for group, size in enumerate(sizes)]
    found = paged(groups, height)
    assert tuple(map(len, found)) == pages
    assert [line for page in found for line in page] == [line for group in groups for line in group]


@pytest.mark.parametrize(("width", "mark"), [(20, "?"), (28, "(lost)"), (37, "(lost)")])
def test_a_place_that_nothing_tells_is_marked_and_the_height_is_not(width, mark):
    def marked(s):
        lines = panel_text(FlightPanel("", id="x"), s, width=width, height=30).split("\n")
        return [line.split()[0] for line in lines if mark in line]

    lost = snapshot_with(HOVERING, estimates={"is_place_lost": True})
    assert marked(lost) == (["spd", "N", "E"] if width == 20 else ["N", "E"] if width == 28 else ["north", "east"])
    assert marked(HOVERING) == []
    assert flight_content(lost, name="1").name == "1 lost"
    assert flight_content(HOVERING, name="1").name == "1"


@pytest.mark.parametrize("width", [28, 37])
def test_the_speed_in_force_stands_behind_the_one_that_it_is_about(width):
    values = {"DRK_HOV_VMAX": 5.0, "DRK_FWD_SPEED": 15.0}
    for flight, line in ((HOVERING, 1), (FORWARD, 2)):
        s = snapshot_with(flight, parameters={"values": values}, mission={"state": PAUSED})
        drawn = panel_text(FlightPanel("", id="x"), s, width=width, height=30).split("\n")[line]
        assert ("→5" if line == 1 else "→15") in drawn
        assert width == 28 or len(drawn) <= 37
