"""The reason why the vehicle stays with its law, in plain words."""

import pytest

from darko_gcs.state import law_reason as words
from darko_gcs.state.law_reason import law_reason, why_not_linear
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from sitl.supervisor import guards
from tests.support.gcs.snapshots import FORWARD, HOVERING, HYBRID_HOVER, snapshot_with

HOVER = mavlink.MAV_VTOL_STATE_MC
ON_GROUND = mavlink.MAV_LANDED_STATE_ON_GROUND
INDI = HYBRID_HOVER._replace(law=Law.INDI, v_hover=60.0)
STILL = snapshot_with(
    HOVERING, hybrid={"state": INDI}, status={"vtol_state": HOVER}, estimates={"wind": (0.0, 1.0, 0.0)}
)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"estimates": {"wind": (0.0, 4.6, 0.0)}}, "wind estimate 4.6 m/s: INDI stays"),
        ({"status": {"landed_state": mavlink.MAV_LANDED_STATE_LANDING}}, "landing: INDI stays"),
        ({"status": {"vtol_state": mavlink.MAV_VTOL_STATE_FW}}, "forward: INDI stays"),
        ({"position": {"v": (3.0, 0.0, 0.0)}}, "moving: INDI stays"),
        ({}, "V 60 not below 50: INDI stays"),
        ({"hybrid": {"state": INDI._replace(v_hover=1.0)}}, ""),
        ({"status": {"landed_state": ON_GROUND}}, ""),
    ],
)
def test_it_says_what_keeps_indi_what_matters_most_first(changes, reason):
    assert law_reason(snapshot_with(STILL, **changes)) == reason


def test_a_linear_law_stays_as_long_as_v_is_below_its_threshold():
    assert law_reason(HOVERING) == "V 0.8 below 100: the law stays"
    assert law_reason(FORWARD) == "V 12 below 60: the law stays"
    assert why_not_linear(HOVERING) == ""


def test_the_limits_are_those_of_the_vehicles_guards():
    assert (words.CALM_WIND, words.STANDING_SPEED) == (guards.CALM_WIND, guards.STANDING_SPEED)


@pytest.mark.parametrize("law", Law)
def test_no_reason_is_wider_than_the_panel_of_120_columns(law):
    for wind in (0.0, 12.5):
        s = snapshot_with(
            STILL, hybrid={"state": INDI._replace(law=law, v_hover=9.9e5)}, estimates={"wind": (0.0, wind, 0.0)}
        )
        assert len(law_reason(s)) <= 37
