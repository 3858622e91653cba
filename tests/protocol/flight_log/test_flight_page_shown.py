"""The page of a flight in a browser: the vehicle stands as the log says and moves when it is played, charts follow."""

from dataclasses import replace

import numpy as np
import pytest

from protocol.flight_log.flight_page import flight_page
from protocol.flight_log.flight_series import FlightEvent, Series, flight_series
from protocol.frames import quaternion_from_euler, rotate
from protocol.tlog import read_tlog
from tests.support.browser import SHOWN, needs_browser, shown_page
from tests.support.paths import DATA

pytest.importorskip("plotly")
TIMES = np.arange(0.0, 10.01, 0.05)
PITCHES = np.radians(90.0 - 8.0 * TIMES)  # a front transition in 10 s
HEADING = 0.7


def east_north_up(ned):
    return [ned[1], ned[0], -ned[2]]


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """The file of a page about a transition: it leans over towards the north-east."""
    flown = flight_series(read_tlog(DATA / "square-flight.tlog"), "square")
    path = {"x": TIMES**2 * np.cos(HEADING), "y": TIMES**2 * np.sin(HEADING), "z": np.full_like(TIMES, -20.0)}
    count = len(TIMES)
    flight = replace(
        flown,
        position=Series(TIMES, path),
        target=Series(TIMES, path),
        attitude=Series(TIMES, {"q": np.array([quaternion_from_euler(0.0, p, HEADING) for p in PITCHES])}),
        actuators=Series(
            TIMES,
            {name: flown.actuators.fields[name][:1].repeat(count, axis=0) for name in flown.actuators.fields}
            | {"thrust": np.tile((2.0, 3.0), (count, 1)), "elevon": np.tile((0.3, -0.2), (count, 1))},
        ),
        hybrid=replace(flown.hybrid, times=np.linspace(0.0, 10.0, len(flown.hybrid))),
        events=(FlightEvent(4.0, "jump", "hover to front transition", "front transition"),),
    )
    file = tmp_path_factory.mktemp("page") / "flight.html"
    file.write_text(flight_page(flight, title="A transition"), encoding="utf-8")
    return file.as_uri()


@needs_browser
def test_the_vehicle_stands_as_the_log_says_and_moves_when_it_is_played(page):
    with shown_page(page) as shown:
        shown.evaluate("shownFlight.seek(5)")
        still = shown.evaluate(SHOWN)
        q = quaternion_from_euler(0.0, np.radians(50.0), HEADING)
        assert still["nose"] == pytest.approx(east_north_up(rotate(q, (1.0, 0.0, 0.0))), abs=2e-3)
        assert still["right"] == pytest.approx(east_north_up(rotate(q, (0.0, 1.0, 0.0))), abs=2e-3)
        assert still["place"] == pytest.approx([25.0 * np.sin(HEADING), 25.0 * np.cos(HEADING), 20.0], abs=0.02)
        left, right = still["edges"]
        assert left < -0.01  # nose-up: the trailing edge is above the wing
        assert right > 0.005
        assert still["arrows"][1] / still["arrows"][0] == pytest.approx(1.5)
        assert "nose 50° up" in still["words"]
        assert "2.0 | 3.0 N" in still["words"]
        shown.wait_for_timeout(500)
        before = shown.evaluate(SHOWN)
        shown.click("[data-do=play]")
        shown.wait_for_function("Number(shownFlight.root.dataset.time) > 5.3")
        shown.click("[data-do=play]")
        after = shown.evaluate(SHOWN)
        assert after["place"][0] > before["place"][0] + 1.0
        assert after["nose"][2] < before["nose"][2]  # it leans further over
        assert after["picture"] != before["picture"]
        assert shown.errors == shown.strangers == []


@needs_browser
def test_the_charts_and_the_view_show_one_time(page):
    left = "[...document.querySelectorAll('.cursor')].map((line) => line.getBoundingClientRect().left)"
    with shown_page(page, color_scheme="dark") as shown:
        shown.evaluate("shownFlight.seek(2.5)")
        early = shown.evaluate(left)
        shown.evaluate("shownFlight.seek(7.5)")
        late = shown.evaluate(left)
        assert len(early) >= 3
        assert all(after > before + 20 for before, after in zip(early, late, strict=True))
        chart = shown.locator(".chart .nsewdrag").first
        chart.scroll_into_view_if_needed()
        box = chart.bounding_box()
        shown.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
        shown.wait_for_function("Math.abs(shownFlight.time - 7.5) > 0.5")
        low, high = shown.evaluate("document.querySelector('.chart').layout.xaxis.range")
        assert shown.evaluate("shownFlight.time") == pytest.approx((low + high) / 2, abs=0.2)
        shown.click(".events td.n")
        assert shown.evaluate("shownFlight.time") == pytest.approx(4.0)
        assert shown.evaluate("document.documentElement.scrollWidth <= innerWidth")  # a phone's width is enough
        assert shown.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(20, 23, 26)"
        shown.emulate_media(media="print")
        assert shown.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
        assert shown.errors == shown.strangers == []
