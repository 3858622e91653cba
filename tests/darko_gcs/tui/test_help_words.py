"""Words and signs of the help: their numbers are the vehicle's own, and a plan's figures say what they leave out."""

import math

import pytest

from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.help_words import SCREEN_WORDS
from darko_gcs.tui.screens.charts_screen import ChartsScreen
from darko_gcs.tui.screens.flight_screen import FlightScreen
from protocol.frames import euler_from_quaternion, hover_attitude, quaternion_from_euler
from sitl.model.airframe_files import load
from sitl.simulation.tuning import Tuning, thresholds
from sitl.supervisor.guards import CALM_WIND, STRONG_HOVER_WIND
from tests.support.gcs.screens import FakeFeed, screen_text, until
from tests.support.gcs.snapshots import FORWARD


def test_the_thresholds_of_v_are_those_of_the_vehicle_as_it_usually_flies():
    usual = thresholds(load("darko").parameters, Tuning())
    hover = next(row for row in SCREEN_WORDS[FlightScreen] if row[0].startswith("hover"))
    assert f"({usual.v_enter:g}/{usual.v_leave:g})" in hover[0]
    assert f"below {usual.v_enter:g}, and gives up above {usual.v_leave:g}" in hover[1]


def test_the_winds_that_indi_keeps_are_those_of_the_vehicle():
    words = dict(SCREEN_WORDS[FlightScreen])["INDI stays"]
    assert f"above {STRONG_HOVER_WIND:g} m/s until it is below {CALM_WIND:g} m/s" in words


def test_the_attitude_of_the_message_is_of_the_frame_that_the_help_of_the_charts_says():
    level_flight, upright = (1.0, 0.0, 0.0, 0.0), quaternion_from_euler(0.0, math.pi / 2.0, 0.0)
    pitches = [round(math.degrees(euler_from_quaternion(hover_attitude(q))[1])) + 0 for q in (level_flight, upright)]
    assert pitches == [-90, 0]
    assert "0 upright, pitch -90 deg in level forward flight" in dict(SCREEN_WORDS[ChartsScreen])["ATTITUDE"]


@pytest.mark.long
async def test_the_help_of_a_plan_says_what_its_predicted_time_leaves_out():
    app = GroundStationApp(FakeFeed(FORWARD))
    async with app.run_test(size=(120, 100)) as pilot:
        await pilot.press("m", "question_mark")
        await until(pilot, lambda: "predicted    of the legs alone: loiters, waits" in screen_text(app))
