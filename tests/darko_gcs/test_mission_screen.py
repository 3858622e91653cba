"""The mission screen, driven by keys."""

from dataclasses import replace

import pytest
from textual.widgets import Input, OptionList

from darko_gcs.app import GroundStation
from darko_gcs.screens.dialogs import ConfirmScreen
from darko_gcs.screens.mission import Draft, MissionScreen
from protocol.plans import load
from tests.darko_gcs.screens import FLYING, FakeFeed, screen_text, until
from tests.support.paths import DATA


@pytest.fixture
def feed():
    return FakeFeed(FLYING)


async def test_a_mission_is_opened_edited_saved_and_uploaded(feed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.plan").write_bytes((DATA / "square.plan").read_bytes())
    feed.snapshot = feed.station.snapshot = replace(FLYING, mission=())
    app = GroundStation(feed)
    async with app.run_test(size=(100, 30)) as pilot:
        await pilot.press("m")
        screen = app.screen
        assert isinstance(screen, MissionScreen)
        await pilot.press("o")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("enter")
        await until(pilot, lambda: len(screen.draft.plan.items) == 6 and app.screen is screen)
        await pilot.press("down", "x")
        assert len(screen.draft.plan.items) == 5
        await pilot.press("i")
        await until(pilot, lambda: isinstance(app.focused, OptionList))
        await pilot.press("enter")
        await until(pilot, lambda: len(screen.draft.plan.items) == 6 and app.screen is screen)
        await pilot.press("shift+down", "u")
        sent = ("upload", screen.draft.plan.items, ("fence", ()), ("rally", ()))
        await until(pilot, lambda: feed.station.asked == [sent])
        await pilot.press("w")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("enter")
        await until(pilot, lambda: app.screen is screen)
        assert load(tmp_path / "a.plan").items == screen.draft.plan.items


async def test_a_bad_edit_is_refused_with_the_fields_name(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(100, 40)) as pilot:
        await pilot.press("m")
        screen = app.screen
        await until(pilot, lambda: len(screen.draft.plan.items) == 6)
        before = screen.draft.plan.items
        await pilot.press("e")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("x", "enter")
        await until(pilot, lambda: "'x' is neither a MAV_CMD nor its number" in screen_text(app))
        await pilot.press("escape")
        await until(pilot, lambda: app.screen is screen)
        assert screen.draft.plan.items == before


async def test_the_help_says_first_what_keys_do_here(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen))
        await pilot.press("question_mark")
        await until(pilot, lambda: "Fetch the vehicle's plans" in screen_text(app))
        assert "Move home to where" not in screen_text(app)  # after them
        assert "Cancel the transition" not in screen_text(app)  # x removes an item here


async def test_a_parameter_is_edited_in_its_own_field(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        screen = app.screen
        await until(pilot, lambda: len(screen.draft.plan.items) == 6)
        await pilot.press("down", "e")
        await until(pilot, lambda: isinstance(app.focused, Input) and "Pass radius [m]" in screen_text(app))
        await pilot.press("tab", "tab", "tab", "tab", "8", "enter")
        await until(pilot, lambda: screen.draft.plan.items[1].params[2] == 8.0)
        await until(pilot, lambda: "pass 8" in screen_text(app))


async def test_another_command_opens_its_own_fields(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        screen = app.screen
        await until(pilot, lambda: len(screen.draft.plan.items) == 6)
        await pilot.press("down", "e")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press(*"18", "enter")
        await until(pilot, lambda: "Item 1: Loiter for turns" in screen_text(app))
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("tab", "tab", "3", "enter")
        await until(pilot, lambda: screen.draft.plan.items[1].params[:3] == (3.0, 0.0, 30.0))


async def test_an_unsent_plan_is_kept_when_its_screen_is_closed(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: len(app.screen.draft.plan.items) == 6)
        await pilot.press("x", "escape")
        await until(pilot, lambda: "The plan is not on the" in screen_text(app))
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen) and app.screen.table.row_count == 5)
        assert len(app.draft.plan.items) == 5
        assert app.draft.is_at_risk


async def test_nothing_replaces_an_unsent_plan_without_asking(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: len(app.screen.draft.plan.items) == 6)
        await pilot.press("x")
        for key in ("f", "o", "q"):
            await pilot.press(key)
            await until(pilot, lambda: isinstance(app.screen, ConfirmScreen))
            await pilot.press("n")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen))
        assert feed.station.asked == []
        assert len(app.draft.plan.items) == 5
        await pilot.press("f", "y")
        await until(pilot, lambda: feed.station.asked == [("download",)])


async def test_a_plan_that_the_vehicle_took_is_at_no_risk(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: len(app.screen.draft.plan.items) == 6)
        await pilot.press("x", "u")
        assert app.draft.is_at_risk
        feed.snapshot = replace(FLYING, mission=app.draft.plan.items)
        await until(pilot, lambda: not app.draft.is_at_risk)


async def test_a_snapshot_that_comes_before_the_table_has_columns_is_not_lost(feed):
    class Early(MissionScreen):
        def compose(self):
            self.snapshot = FLYING  # as the app's pull may do, in any turn between push and mount
            yield from super().compose()

    app = GroundStation(feed)
    async with app.run_test(size=(80, 24)):
        app.pull = lambda: None
        screen = Early(feed.station, lambda: 0.0, Draft())
        await app.push_screen(screen)
        assert screen.draft.plan.items == FLYING.mission
        assert [screen.table.get_cell_at((row, 0)) for row in range(3)] == ["✓", "✓", "▶"]


async def test_an_unreadable_file_is_said_by_name(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(100, 30)) as pilot:
        await pilot.press("m", "o")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("ctrl+u", *"nowhere.plan", "enter")
        await until(pilot, lambda: "nowhere.plan" in screen_text(app) and "No such file" in screen_text(app))


async def test_a_mission_is_followed_in_the_table(feed):
    app = GroundStation(feed)
    async with app.run_test(size=(100, 30)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: len(app.screen.draft.plan.items) == 6 and app.screen.snapshot.reached)
        marks = [app.screen.table.get_cell_at((row, 0)) for row in range(6)]
        assert marks == ["✓", "✓", "▶", " ", " ", " "]


async def test_a_plan_named_on_the_command_line_waits_to_be_sent(feed):
    feed.snapshot = feed.station.snapshot = replace(FLYING, mission=())
    app = GroundStation(feed)
    app.draft = Draft(load(DATA / "square.plan"), "square.plan", changed=True)
    async with app.run_test(size=(100, 30)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen) and app.screen.table.row_count == 6)
        await until(pilot, lambda: "square.plan: 6 items, not on the vehicle" in screen_text(app))
