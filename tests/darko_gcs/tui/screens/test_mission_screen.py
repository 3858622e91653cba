"""The mission screen, driven by keys."""

import pytest
from textual.widgets import Input, OptionList
from textual.widgets._toast import Toast

from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.plan_draft import PlanDraft
from darko_gcs.tui.screens.dialogs import ConfirmScreen
from darko_gcs.tui.screens.mission_screen import MissionScreen
from protocol.dialect import mavlink
from protocol.frames import Geodetic
from protocol.plans import load
from protocol.plans.fence_rally import fence_items, rally_items
from tests.support.gcs.limited_plan import write_limited_plan
from tests.support.gcs.screens import FakeFeed, confirm, screen_text, settled, until
from tests.support.gcs.snapshots import HOVERING, snapshot_with
from tests.support.paths import DATA

READ_BACK = (("verify", True), ("current", None))


@pytest.fixture
def feed():
    return FakeFeed(HOVERING)


@pytest.mark.long
async def test_a_mission_is_opened_edited_saved_and_uploaded(feed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.plan").write_bytes((DATA / "square.plan").read_bytes())
    feed.snapshot = feed.station.snapshot = snapshot_with(HOVERING, plans={"mission": ()})
    app = GroundStationApp(feed)
    async with app.run_test(size=(100, 30)) as pilot:
        await pilot.press("m")
        screen = app.screen
        assert isinstance(screen, MissionScreen)
        await until(pilot, lambda: "no plan: o opens a file" in screen_text(app))
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
        await until(pilot, lambda: "A mission is being flown. Replace it?" in screen_text(app))
        await pilot.press("y")
        sent = ("plans.upload", screen.draft.plan.items, ("fence", ()), ("rally", ()), *READ_BACK)
        await until(pilot, lambda: feed.requests == [sent])
        await pilot.press("w")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("enter")
        await until(pilot, lambda: app.screen is screen)
        assert load(tmp_path / "a.plan").items == screen.draft.plan.items


async def test_a_bad_edit_is_refused_with_the_name_of_the_field(feed):
    app = GroundStationApp(feed)
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


async def test_an_edit_is_taken_back(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        screen = app.screen
        await until(pilot, lambda: len(screen.draft.plan.items) == 6)
        before = screen.draft.plan.items
        await pilot.press("down", "x", "x")
        await until(pilot, lambda: len(screen.draft.plan.items) == 4)
        await pilot.press("z", "z")
        await until(pilot, lambda: screen.draft.plan.items == before)
        await pilot.press("z")
        await until(pilot, lambda: "Nothing to undo" in screen_text(app))


async def test_home_and_end_go_to_the_first_and_the_last_item(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: len(app.screen.draft.plan.items) == 6)
        await pilot.press("end")
        await until(pilot, lambda: app.screen.table.cursor_row == 5)
        await pilot.press("home")
        await until(pilot, lambda: app.screen.table.cursor_row == 0)


async def test_jumping_to_an_item_asks_first(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: len(app.screen.draft.plan.items) == 6)
        await pilot.press("down", "j")
        await until(pilot, lambda: "Continue the mission at item 1?" in screen_text(app))
        assert feed.requests == []
        await pilot.press("y")
        await until(pilot, lambda: feed.requests == [("plans.set_current", 1)])


@pytest.mark.long
async def test_flight_keys_do_nothing_here_and_say_so(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen) and app.screen.draft.plan.items)
        for key in ("a", "d", "t", "h", "l", "r", "v", "g"):
            await pilot.press(key)
            await until(pilot, lambda wanted=key: f"{wanted}: flight keys work on the flight" in screen_text(app))
            assert isinstance(app.screen, MissionScreen)
        assert feed.requests == []


async def test_the_help_lists_the_keys_of_this_screen_first(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen))
        await pilot.press("question_mark")
        await until(pilot, lambda: "Fetch the vehicle's plans" in screen_text(app))
        assert "tab          To the map; there, back to the table" in screen_text(app)
        assert "Move home to" not in screen_text(app)  # below them
        assert "Cancel the transition" not in screen_text(app)  # here, x removes an item


@pytest.mark.long
async def test_a_parameter_is_edited_in_its_own_field(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        screen = app.screen
        await until(pilot, lambda: len(screen.draft.plan.items) == 6)
        await pilot.press("down", "e")
        await until(pilot, lambda: isinstance(app.focused, Input) and "Pass radius [m]" in screen_text(app))
        await pilot.press("tab", "tab", "tab", "tab", "8", "enter")
        await until(pilot, lambda: screen.draft.plan.items[1].params[2] == 8.0)
        await until(pilot, lambda: "pass 8" in screen_text(app))


@pytest.mark.long
async def test_another_command_opens_its_own_fields(feed):
    app = GroundStationApp(feed)
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


@pytest.mark.long
async def test_an_unsent_plan_is_still_there_when_its_screen_is_opened_again(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: len(app.screen.draft.plan.items) == 6)
        await pilot.press("x", "escape")
        await until(pilot, lambda: "The plan is not on the" in screen_text(app))
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen) and app.screen.table.row_count == 5)
        assert len(app.draft.plan.items) == 5
        assert app.draft.is_at_risk


@pytest.mark.long
async def test_replacing_an_unsent_plan_is_confirmed_first(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: len(app.screen.draft.plan.items) == 6)
        await pilot.press("x")
        for key in ("f", "o", "q"):
            await pilot.press(key)
            await until(pilot, lambda: isinstance(app.screen, ConfirmScreen))
            await pilot.press("n")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen))
        assert feed.requests == []
        assert len(app.draft.plan.items) == 5
        await confirm(pilot, "f")
        await until(pilot, lambda: feed.requests == [("plans.download",)])


async def test_a_plan_that_the_vehicle_accepted_is_not_at_risk(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: len(app.screen.draft.plan.items) == 6)
        await pilot.press("x", "u")
        assert app.draft.is_at_risk
        feed.snapshot = snapshot_with(HOVERING, plans={"mission": app.draft.plan.items})
        await until(pilot, lambda: not app.draft.is_at_risk)


async def test_a_snapshot_that_arrives_before_the_table_has_columns_is_not_lost(feed):
    class EarlySnapshotScreen(MissionScreen):
        def compose(self):
            self.snapshot = HOVERING  # as the app's pull may do between push and mount
            yield from super().compose()

    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)):
        app.pull = lambda: None
        screen = EarlySnapshotScreen(feed.station, lambda: 0.0, PlanDraft())
        await app.push_screen(screen)
        assert screen.draft.plan.items == HOVERING.plans.mission
        assert [screen.table.get_cell_at((row, 0)) for row in range(3)] == ["✓", "✓", "▶"]


@pytest.mark.long
async def test_an_unreadable_file_is_reported_by_name(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(100, 30)) as pilot:
        await pilot.press("m", "o")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("ctrl+u", *"nowhere.plan", "enter")
        await until(pilot, lambda: "nowhere.plan" in screen_text(app) and "No such file" in screen_text(app))


async def test_the_table_marks_reached_and_current_items(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(100, 30)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: len(app.screen.draft.plan.items) == 6 and app.screen.snapshot.mission.reached)
        marks = [app.screen.table.get_cell_at((row, 0)) for row in range(6)]
        assert marks == ["✓", "✓", "▶", " ", " ", " "]


async def test_a_plan_from_the_command_line_is_open_and_not_sent(feed):
    feed.snapshot = feed.station.snapshot = snapshot_with(HOVERING, plans={"mission": ()})
    app = GroundStationApp(feed)
    app.draft = PlanDraft(plan=load(DATA / "square.plan"), path="square.plan", changed=True)
    async with app.run_test(size=(100, 30)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen) and app.screen.table.row_count == 6)
        await until(pilot, lambda: "square.plan: 6 items, not on the vehicle" in screen_text(app))


def limits(plan):
    return {"fence": fence_items(plan), "rally": rally_items(plan)}


@pytest.mark.long
async def test_a_fence_is_opened_sent_and_deleted(tmp_path, monkeypatch):
    plan = load(write_limited_plan(tmp_path))
    monkeypatch.chdir(tmp_path)
    feed = FakeFeed(snapshot_with(HOVERING, plans={"mission": ()}, mission={"state": mavlink.MISSION_STATE_PAUSED}))
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m", "o")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("enter")
        words = "6 items, fence of 2 areas, 2 rally points, not on the vehicle"
        await until(pilot, lambda: words in " ".join(screen_text(app).split()))
        await confirm(pilot, "u")
        sent = ("plans.upload", plan.items, *limits(plan).items(), *READ_BACK)
        await until(pilot, lambda: feed.requests == [sent])
        feed.snapshot = snapshot_with(feed.snapshot, plans={"mission": plan.items, **limits(plan)})
        await until(pilot, lambda: "2 rally points, as on the vehicle" in " ".join(screen_text(app).split()))
        await pilot.press("down", "down")
        await confirm(pilot, "j")
        await until(pilot, lambda: feed.requests[-1] == ("plans.set_current", 2))
        await pilot.press("c")
        await until(pilot, lambda: isinstance(app.focused, OptionList))
        await pilot.press("down", "enter")
        await until(pilot, lambda: feed.requests[-1] == ("plans.clear", mavlink.MAV_MISSION_TYPE_FENCE))


async def test_the_vehicles_fence_is_saved_with_the_plan(tmp_path, monkeypatch):
    plan = load(write_limited_plan(tmp_path))
    monkeypatch.chdir(tmp_path)
    feed = FakeFeed(snapshot_with(HOVERING, plans={"mission": plan.items, **limits(plan)}))
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m", "w")
        await until(pilot, lambda: isinstance(app.focused, Input))
        await pilot.press("enter")
        await until(pilot, lambda: "Saved mission.plan" in screen_text(app))
    saved = load(tmp_path / "mission.plan")
    assert (fence_items(saved), rally_items(saved)) == (fence_items(plan), rally_items(plan))


@pytest.mark.long(after=1)
@pytest.mark.parametrize("size", [(80, 24), (120, 40), (200, 60)])
async def test_the_help_is_in_the_lower_line_at_every_size(feed, size):
    app = GroundStationApp(feed)
    async with app.run_test(size=size) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: "? Help" in screen_text(app).splitlines()[-1])


async def test_a_first_item_is_put_where_the_vehicle_is_in_the_air(feed):
    place = Geodetic(43.5650, 1.4820, 160.0)
    feed.snapshot = snapshot_with(
        HOVERING, plans={"mission": ()}, position={"p": (22.0, 71.0, -7.5), "geodetic": place}
    )
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m", "i")
        await until(pilot, lambda: isinstance(app.focused, OptionList))
        await pilot.press("enter")
        await until(pilot, lambda: len(app.draft.plan.items) == 1)
        item = app.draft.plan.items[0]
        assert (item.x, item.y, item.z) == (435650000, 14820000, 3.0)  # as high as it is going, not as it is


@pytest.mark.parametrize(("key", "below"), [("m", "#mission-status"), ("p", "#parameter-details")])
async def test_a_notice_does_not_lie_over_what_is_told_below_the_table(feed, key, below):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await pilot.press(key)
        await until(pilot, lambda: app.screen.query(below) and app.screen.query_one(below).size.height)
        app.notify("The plan is not on the vehicle. Press m to see it again")
        await until(pilot, lambda: app.screen.query(Toast))
        await settled(pilot)
        assert not app.screen.query_one(Toast).region.overlaps(app.screen.query_one(below).region)


async def test_an_empty_plan_is_not_sent(feed):
    feed.snapshot = snapshot_with(HOVERING, plans={"mission": ()}, mission={"state": 0})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen))
        await pilot.press("u")
        await until(pilot, lambda: "There is no plan to send" in screen_text(app))
        assert feed.requests == []
