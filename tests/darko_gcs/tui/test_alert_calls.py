"""Alerts on the screen: the bell, the notice, the pilot's own command, and that they were seen."""

import sys

import pytest
from textual.widgets import Input

from darko_gcs.state.values import Alert
from darko_gcs.tui.app import GroundStationApp
from tests.support.gcs.screens import FakeFeed, notices, screen_text, until
from tests.support.gcs.snapshots import FORWARD, snapshot_with

LOST = snapshot_with(FORWARD, session={"alerts": (Alert("battery", "battery low: 12 % left", 5.0),)})


@pytest.fixture
def rings(monkeypatch):
    counted = []
    monkeypatch.setattr(GroundStationApp, "bell", lambda _app: counted.append(1))
    return counted


async def test_an_alert_rings_once_and_stays_in_the_first_line_until_it_was_seen(rings):
    feed = FakeFeed(FORWARD)
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await pilot.pause(0.3)
        assert not rings
        feed.snapshot = LOST
        await until(pilot, lambda: "!battery" in screen_text(app).splitlines()[0])
        await until(pilot, lambda: "battery low: 12 % left (A: seen)" in notices(app))
        app.pull()
        assert len(rings) == 1
        await pilot.press("A")
        await until(pilot, lambda: ("acknowledge",) in feed.requests and not notices(app))


async def test_a_notice_tells_how_to_leave_a_field_that_would_take_the_letter(rings):
    feed = FakeFeed(FORWARD)
    app = GroundStationApp(feed)
    async with app.run_test(size=(120, 40), notifications=True) as pilot:
        await pilot.press("p")
        await until(pilot, lambda: isinstance(app.focused, Input))
        feed.snapshot = LOST
        await until(pilot, lambda: "battery low: 12 % left (Esc, then A: seen)" in notices(app))
        await pilot.press("escape", "A")
        await until(pilot, lambda: ("acknowledge",) in feed.requests)
    assert rings


async def test_the_pilot_s_command_has_the_words_and_the_kind(rings, tmp_path):
    told = tmp_path / "told"
    program = f"import os, sys; open({str(told)!r}, 'w').write(os.environ['DARKO_ALERT'] + ': ' + sys.argv[1])"
    app = GroundStationApp(FakeFeed(LOST), on_alert=(sys.executable, "-c", program))
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await until(pilot, lambda: told.exists() and told.read_text() == "battery: Vehicle 1: battery low: 12 % left")
    assert rings


async def test_a_command_that_fails_is_told(rings):
    app = GroundStationApp(FakeFeed(LOST), on_alert=(sys.executable, "-c", "raise SystemExit(3)"))
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await until(pilot, lambda: "ended with exit code 3" in notices(app))
    assert rings


async def test_a_command_that_is_not_there_is_told(rings):
    app = GroundStationApp(FakeFeed(LOST), on_alert=("/no/such/program",))
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await until(pilot, lambda: "cannot be run" in notices(app))
    assert rings


async def test_alerts_are_seen_on_every_screen(rings):
    feed = FakeFeed(LOST)
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await pilot.press("e")
        await until(pilot, lambda: "!battery" in screen_text(app).splitlines()[0])
        await pilot.press("A")
        await until(pilot, lambda: ("acknowledge",) in feed.requests)
    assert rings
