"""The mission screen and the vehicle: what is sent after which question, and what differs from it and from a file."""

from dataclasses import replace

import pytest
from textual.widgets import Input, OptionList

from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.plan_draft import PlanDraft
from darko_gcs.tui.screens.mission_screen import MissionScreen
from protocol.dialect import mavlink
from protocol.plans import load
from tests.support.gcs.screens import FakeFeed, confirm, screen_text, until
from tests.support.gcs.snapshots import HOVERING, snapshot_with
from tests.support.paths import DATA


@pytest.fixture
def feed():
    return FakeFeed(HOVERING)


async def opened(pilot, app):
    await pilot.press("m")
    await until(pilot, lambda: isinstance(app.screen, MissionScreen) and app.screen.table.row_count == 6)
    return app.screen


async def test_flying_from_an_item_asks_first(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app)
        await pilot.press("down", "down", "down", "S")
        await until(pilot, lambda: "Fly the mission from item 3? Items 0 to 2 are skipped." in screen_text(app))
        assert "interrupts item 2." in screen_text(app)
        await pilot.press("n")
        assert feed.requests == []
        await confirm(pilot, "S")
        await until(pilot, lambda: feed.requests == [("plans.start_mission", ("first", 3), ("arm", False))])


@pytest.mark.long(after=1)
@pytest.mark.parametrize(
    ("current", "state", "words"),
    [
        (0, mavlink.MISSION_STATE_NOT_STARTED, "Fly the mission?"),
        (2, mavlink.MISSION_STATE_NOT_STARTED, "Fly the mission from item 2?"),
        (2, mavlink.MISSION_STATE_PAUSED, "Resume the mission from item 2?"),
    ],
)
async def test_wherever_the_cursor_is_the_mission_is_begun_at_its_current_item(feed, current, state, words):
    feed.snapshot = snapshot_with(HOVERING, mission={"current": current, "state": state})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app)
        await pilot.press("down", "down", "down", "s")
        await until(pilot, lambda: words in screen_text(app))
        await pilot.press("y")
        await until(pilot, lambda: feed.requests == [("plans.start_mission", ("arm", False))])


async def test_a_plan_that_the_vehicle_does_not_have_is_not_flown(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app)
        await pilot.press("x")
        for key in ("s", "j"):
            await pilot.press(key)
            await until(pilot, lambda: "The vehicle does not have this plan" in screen_text(app))
        assert feed.requests == []


async def test_nothing_is_sent_to_a_silent_vehicle(feed):
    feed.snapshot = snapshot_with(HOVERING, link={"lost": True})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app)
        for key in ("s", "j", "u", "f", "c"):
            await pilot.press(key)
            await until(pilot, lambda: "The vehicle is silent: nothing was sent" in screen_text(app))
            assert isinstance(app.screen, MissionScreen)
        assert feed.requests == []


async def test_of_a_mission_that_is_flown_only_the_changed_items_are_sent_after_a_question(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        screen = await opened(pilot, app)
        await pilot.press("down", "down", "tab")
        await until(pilot, lambda: app.focused is screen.map)
        await pilot.press("right", "u")
        await until(pilot, lambda: "Change item 2 of the mission that is being flown?" in screen_text(app))
        assert "turns there at once" in screen_text(app)
        assert feed.requests == []
        await pilot.press("y")
        await until(pilot, lambda: feed.requests == [("plans.replace_items", app.draft.plan.items, range(2, 3))])


async def test_a_flown_mission_of_another_length_is_replaced_and_goes_on_where_it_was(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app)
        await pilot.press("down", "x")
        await confirm(pilot, "u")
        sent = ("plans.upload", app.draft.plan.items, ("fence", ()), ("rally", ()), ("verify", True), ("current", 1))
        await until(pilot, lambda: feed.requests == [sent])


async def test_a_plan_that_the_vehicle_flies_already_is_not_sent_again(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app)
        await pilot.press("u")
        await until(pilot, lambda: "The vehicle has this plan already" in screen_text(app))
        assert feed.requests == []


@pytest.mark.long
async def test_the_draft_stays_when_the_vehicle_holds_something_else_after_an_upload(feed):
    feed.snapshot = snapshot_with(HOVERING, mission={"state": mavlink.MISSION_STATE_NOT_STARTED})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app)
        await pilot.press("x")
        await confirm(pilot, "u")
        await until(pilot, lambda: feed.requests and not app.screen.is_modal)
        own = app.draft.plan.items
        feed.snapshot = snapshot_with(feed.snapshot, plans={"mission": (replace(own[0], z=9.0), *own[1:])})
        await until(pilot, lambda: app.screen.snapshot.plans.mission[0].z == 9.0)
        assert app.draft.plan.items == own
        assert "not on the vehicle" in screen_text(app)
        await pilot.press("equals_sign")
        await until(pilot, lambda: "~ 0  alt 9 -> 3" in screen_text(app))


async def test_edits_can_be_taken_back_after_an_upload(feed):
    feed.snapshot = snapshot_with(HOVERING, mission={"state": mavlink.MISSION_STATE_NOT_STARTED})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app)
        await pilot.press("x")
        await confirm(pilot, "u")
        await until(pilot, lambda: feed.requests and not app.screen.is_modal)
        feed.snapshot = snapshot_with(feed.snapshot, plans={"mission": app.draft.plan.items})
        await until(pilot, lambda: "as on the vehicle" in screen_text(app))
        await pilot.press("z")
        assert len(app.draft.plan.items) == 6


@pytest.mark.long
async def test_differences_from_vehicle_and_file_are_told_by_item_and_field(feed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    app = GroundStationApp(feed)
    app.draft = PlanDraft(plan=load(DATA / "square.plan"), path=str(DATA / "square.plan"))
    async with app.run_test(size=(120, 40)) as pilot:
        await opened(pilot, app)
        await pilot.press("down", "x", "equals_sign")
        await until(pilot, lambda: "From the vehicle's mission to this plan" in screen_text(app))
        text = screen_text(app)
        assert text.count("- 1  Waypoint hold 2, acceptance 0.3 lat 43.5648360") == 2
        assert "From the file" in text
        await pilot.press("escape")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen))
        await pilot.press("z", "equals_sign")
        await until(pilot, lambda: "the same" in screen_text(app))
        assert feed.requests == []


async def test_without_vehicle_and_file_there_is_nothing_to_compare_with():
    app = GroundStationApp(FakeFeed(EMPTY_SNAPSHOT))
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m", "equals_sign")
        await until(pilot, lambda: "There is nothing to compare with" in screen_text(app))


@pytest.mark.long
async def test_a_path_completes_itself_and_a_recent_file_is_chosen_from_the_list(tmp_path, monkeypatch):
    folder = tmp_path / "somewhere"
    folder.mkdir()
    (folder / "square.plan").write_bytes((DATA / "square.plan").read_bytes())
    (tmp_path / "recent.plan").write_bytes((DATA / "square100.plan").read_bytes())
    monkeypatch.chdir(tmp_path)
    feed = FakeFeed(snapshot_with(HOVERING, plans={"mission": ()}))
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m", "o")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("ctrl+u", "s", "o", "tab", "tab", "enter")
        await until(pilot, lambda: "square.plan: 6 items" in screen_text(app))
        assert app.draft.path == "somewhere/square.plan"
        app.draft.recent.add("recent.plan")
        app.draft.saved = True
        await pilot.press("o")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("down")
        await until(pilot, lambda: isinstance(app.focused, OptionList))
        await pilot.press("enter")
        await until(pilot, lambda: "recent.plan: 7 items" in screen_text(app))
