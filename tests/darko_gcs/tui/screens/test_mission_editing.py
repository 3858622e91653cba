"""Edits of the plan on the mission screen, by keys and by the mouse: nothing of it reaches the vehicle."""

import pytest
from textual.widgets import Input, OptionList

from darko_gcs.state.mission_items import place_of
from darko_gcs.state.mission_legs import asked_leg_modes
from darko_gcs.state.values import LegPrediction
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.map_panel import MovableMap
from darko_gcs.tui.screens.mission_screen import MissionScreen
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason, LegMode
from sitl.defaults import HOME
from tests.support.gcs.screens import FakeFeed, screen_text, settled, until
from tests.support.gcs.snapshots import HOVERING, snapshot_with

SIZES = ((80, 24), (120, 40), (200, 60))
HOVER_LEG = LegPrediction(29.2, 4983.0, 12.1, 1757.0, LegMode.FORWARD, DecisionReason.ENERGY)
NO_CRUISE = LegPrediction(9.4, 940.0, float("inf"), float("inf"), LegMode.HOVER, DecisionReason.TOO_LOW)


class PredictingFeed(FakeFeed):
    """A feed whose vehicle says at once what legs would take."""

    def advance(self, _elapsed):
        wanted = self.station.wanted_legs
        known = self.snapshot.mission.leg_predictions
        if set(wanted) != set(known):
            legs = {chain: tuple([HOVER_LEG, NO_CRUISE][k % 2] for k in range(len(chain.asked))) for chain in wanted}
            self.snapshot = snapshot_with(self.snapshot, mission={"leg_predictions": legs})


@pytest.fixture
def feed():
    return PredictingFeed(HOVERING)


@pytest.fixture
def app(feed):
    return GroundStationApp(feed)


async def opened(pilot, app):
    await pilot.press("m")
    await until(pilot, lambda: isinstance(app.screen, MissionScreen) and app.screen.table.row_count == 6)
    await until(pilot, lambda: "predicted" in screen_text(app))
    return app.screen


def items(app):
    return app.draft.plan.items


async def test_an_item_is_duplicated_and_the_edit_is_taken_back_and_made_again(feed, app):
    async with app.run_test(size=(120, 40)) as pilot:
        screen = await opened(pilot, app)
        before = items(app)
        await pilot.press("down", "D")
        after = items(app)
        assert after == (*before[:2], before[1], *before[2:])
        assert screen.table.cursor_row == 2
        await pilot.press("z")
        assert items(app) == before
        await pilot.press("Z")
        assert items(app) == after
        await pilot.press("Z")
        await until(pilot, lambda: "Nothing to redo" in screen_text(app))
        assert feed.requests == []


@pytest.mark.long
async def test_all_items_but_landings_are_given_one_height_and_it_is_taken_back_at_once(app):
    async with app.run_test(size=(120, 40)) as pilot:
        screen = await opened(pilot, app)
        before = items(app)
        await pilot.press("R")
        await until(pilot, lambda: "One height for 5 items" in screen_text(app) and isinstance(app.focused, Input))
        app.focused.value = "x"
        await pilot.press("enter")
        await until(pilot, lambda: "'x' is not a number" in screen_text(app))
        app.focused.value = "15"
        await pilot.press("enter")
        await until(pilot, lambda: app.screen is screen)
        assert [item.z for item in items(app)] == [15.0] * 5 + [before[5].z]
        await pilot.press("z")
        assert items(app) == before
        await pilot.press("R")
        await until(pilot, lambda: "+5 raises, -5 lowers all" in screen_text(app) and isinstance(app.focused, Input))
        app.focused.value = "+2.5"
        await pilot.press("enter")
        await until(pilot, lambda: app.screen is screen)
        assert [item.z for item in items(app)] == [item.z + 2.5 for item in before[:5]] + [before[5].z]
        await pilot.press("z")
        assert items(app) == before


async def test_an_edit_after_one_was_taken_back_leaves_nothing_to_make_again(app):
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app)
        await pilot.press("D", "z", "x", "Z")
        assert len(items(app)) == 5


@pytest.mark.long
async def test_an_item_is_inserted_above_the_first(app):
    async with app.run_test(size=(80, 24)) as pilot:
        screen = await opened(pilot, app)
        await pilot.press("I")
        await until(pilot, lambda: isinstance(app.focused, OptionList))
        await pilot.press("enter")
        await until(pilot, lambda: app.screen is screen)
        assert [item.command for item in items(app)[:2]] == [16, 22]


async def test_an_item_is_moved_up_and_down(app):
    async with app.run_test(size=(80, 24)) as pilot:
        screen = await opened(pilot, app)
        before = items(app)
        await pilot.press("shift+down")
        assert items(app)[:2] == (before[1], before[0])
        assert screen.table.cursor_row == 1
        await pilot.press("shift+up")
        assert items(app) == before
        await pilot.press("shift+up")  # it is the first already
        assert items(app) == before


async def test_the_way_of_a_leg_goes_from_auto_to_hover_to_cruise_and_back(feed, app):
    async with app.run_test(size=(120, 40)) as pilot:
        screen = await opened(pilot, app)
        before = items(app)
        await pilot.press("down")
        chosen = []
        for _ in range(3):
            await pilot.press("space")
            chosen.append(asked_leg_modes(items(app))[screen.table.cursor_row])
            await until(pilot, lambda: ("then hover" in screen_text(app)) == (chosen[-1] is LegMode.HOVER))
        assert chosen == [LegMode.HOVER, LegMode.FORWARD, LegMode.NONE]
        assert items(app) == before
        await pilot.press("up", "space")
        await until(pilot, lambda: "No leg leads to this item" in screen_text(app))
        assert feed.requests == []


async def test_another_autopilot_is_asked_for_hover_or_cruise_only(feed, app):
    feed.snapshot = snapshot_with(HOVERING, hybrid={"state": None})
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen) and app.screen.table.row_count == 6)
        await pilot.press("down", "space", "space", "space")
        states = [item.params[0] for item in items(app) if item.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION]
        assert mavlink.MAV_VTOL_STATE_MC in states
        assert feed.station.wanted_legs == ()
        assert "predicted" not in screen_text(app)
        assert "legs 16 m" in screen_text(app)


async def test_legs_show_what_they_take_either_way_and_which_way_is_flown(app):
    async with app.run_test(size=(80, 24)) as pilot:
        screen = await opened(pilot, app)
        assert [screen.table.get_cell_at((row, 9)).strip() for row in (0, 1)] == ["", "29 5.0k"]
        assert [screen.table.get_cell_at((1, column)).strip() for column in (6, 7, 8, 10)] == [
            "4", "+0.0", "auto", "12 1.8k*",
        ]  # fmt: skip
        await pilot.press("down")
        await until(pilot, lambda: "3 m above home  cruise: less energy" in screen_text(app))
        assert "hold 2, acceptance 0.3" in screen_text(app)


async def test_arrows_move_the_chosen_item_on_the_map(feed, app):
    async with app.run_test(size=(80, 24)) as pilot:
        screen = await opened(pilot, app)
        before = place_of(items(app)[1], HOME)
        await pilot.press("down", "tab")
        await until(pilot, lambda: isinstance(app.focused, MovableMap) and "step 0.5 m" in screen_text(app))
        await pilot.press(">", "up", "right", "right", "pageup")
        assert place_of(items(app)[1], HOME) == pytest.approx((before[0] + 1, before[1] + 2, before[2] - 1), abs=0.02)
        await pilot.press("tab")
        await until(pilot, lambda: app.focused is screen.table and "takeoff" in screen_text(app))
        assert feed.requests == []


@pytest.mark.long
async def test_a_click_on_an_item_chooses_it_and_a_click_beside_adds_one(app):
    async with app.run_test(size=(120, 40)) as pilot:
        screen = await opened(pilot, app)
        await settled(pilot)
        column, row = screen.map._cell_of(screen.map.places()[2])
        await pilot.mouse_down(screen.map, offset=(column + 1, row + 1))
        await pilot.mouse_up(screen.map, offset=(column + 1, row + 1))
        await until(pilot, lambda: screen.table.cursor_row == 2)
        assert len(items(app)) == 6
        middle, view = (screen.map.size.width // 2, screen.map.size.height // 2), screen.map._view
        await pilot.mouse_down(screen.map, offset=(middle[0] + 1, middle[1] + 1))
        await until(pilot, lambda: len(items(app)) == 7)
        assert screen.table.cursor_row == 3
        north, east, down = place_of(items(app)[3], HOME)
        assert (north, east) == pytest.approx(view[1], abs=view[0])
        assert down == pytest.approx(-3.0, abs=0.01)


async def test_the_mouse_drags_an_item(app):
    async with app.run_test(size=(120, 40)) as pilot:
        screen = await opened(pilot, app)
        await settled(pilot)
        north, east, _ = place_of(items(app)[2], HOME)
        (column, row), scale = screen.map._cell_of((north, east)), screen.map._view[0]
        await pilot.mouse_down(screen.map, offset=(column + 1, row + 1))
        await pilot.hover(screen.map, offset=(column - 5, row + 4))
        await pilot.mouse_up(screen.map, offset=(column - 5, row + 4))
        await until(pilot, lambda: place_of(items(app)[2], HOME)[0] < north - scale)
        there = place_of(items(app)[2], HOME)
        assert there[:2] == pytest.approx((north - 3 * scale, east - 3 * scale), abs=scale)
        assert screen.table.cursor_row == 2


async def test_without_home_nothing_is_put_on_the_map(feed, app):
    feed.snapshot = feed.station.snapshot = snapshot_with(HOVERING, position={"home": None}, plans={"mission": ()})
    async with app.run_test(size=(120, 40)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen) and app.screen.map.size.width > 0)
        await pilot.mouse_down(app.screen.map, offset=(5, 5))
        await until(pilot, lambda: "Home is not known yet" in screen_text(app))
        assert items(app) == ()


@pytest.mark.long(after=1)
@pytest.mark.parametrize("size", SIZES)
def test_the_screen_matches_its_snapshot(snap_compare, app, size):
    async def settle(pilot):
        await opened(pilot, app)
        await pilot.press("down", "down")
        await settled(pilot)

    assert snap_compare(app, terminal_size=size, run_before=settle)


def test_the_map_of_a_small_terminal_matches_its_snapshot(snap_compare, app):
    async def settle(pilot):
        await opened(pilot, app)
        await pilot.press("down", "down", "tab")
        await settled(pilot)

    assert snap_compare(app, terminal_size=(80, 24), run_before=settle)


@pytest.mark.long
async def test_zoomed_out_the_map_stands_still_while_points_are_put_on_it(feed, app):
    feed.snapshot = feed.station.snapshot = snapshot_with(HOVERING, plans={"mission": ()})
    async with app.run_test(size=(120, 40)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen) and app.screen.map.size.width > 0)
        await settled(pilot)
        fitting = app.screen.map._view
        await pilot.press("tab", "minus", "minus", "minus")
        await until(pilot, lambda: app.screen.map._view[0] == pytest.approx(8.0 * fitting[0]))
        still = app.screen.map._view
        for count, offset in ((1, (6, 4)), (2, (30, 4)), (3, (6, 9))):
            await pilot.mouse_down(app.screen.map, offset=offset)
            await until(pilot, lambda count=count: len(items(app)) == count)
            await settled(pilot)
            assert app.screen.map._view == still
        await pilot.press("0")
        await until(pilot, lambda: app.screen.map._view[0] < still[0])


async def test_zoomed_in_the_chosen_item_is_in_the_middle(app):
    async with app.run_test(size=(120, 40)) as pilot:
        screen = await opened(pilot, app)
        await settled(pilot)
        fitting = screen.map._view
        await pilot.press("down", "down", "tab", "plus")
        await until(pilot, lambda: screen.map._view[0] == pytest.approx(fitting[0] / 2.0))
        assert screen.map._view[1] == pytest.approx(screen.map.places()[2])


@pytest.mark.long
async def test_a_first_plan_is_drawn_on_a_map_that_a_plan_fits_on_and_low_or_endless_plans_are_told(feed, app):
    on_ground = mavlink.MAV_LANDED_STATE_ON_GROUND
    feed.snapshot = feed.station.snapshot = snapshot_with(
        HOVERING, plans={"mission": ()}, status={"landed_state": on_ground, "armed": False}
    )
    async with app.run_test(size=(160, 40)) as pilot:
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen) and app.screen.map.size.width > 0)
        await settled(pilot)
        screen = app.screen
        scale, (height, width) = screen.map._view[0], (screen.map.size.height, screen.map.size.width)
        assert scale * min(height, width / 2) == pytest.approx(200.0)
        for count, offset in ((1, (8, 3)), (2, (24, 3))):
            await pilot.mouse_down(screen.map, offset=offset)
            await until(pilot, lambda count=count: len(items(app)) == count)
        assert screen.map._view[0] == scale
        assert [item.z for item in items(app)] == [20.0, 20.0]  # not at 3 m: legs of this length are flown forward
        await until(pilot, lambda: "no landing: it hovers at its last item" in " ".join(screen_text(app).split()))
        assert "LOW" not in screen_text(app)
        assert "0 20m" in screen_text(app)


@pytest.mark.long
async def test_a_place_is_typed_in_metres_too_but_not_in_both(feed, app):
    async with app.run_test(size=(120, 40)) as pilot:
        screen = await opened(pilot, app)
        await pilot.press("down")
        before = items(app)[1]
        screen.action_edit_plan("edit")
        await until(pilot, lambda: "or north of home [m]" in screen_text(app))
        fields = list(app.screen.query(Input))
        assert [field.value for field in fields[-2:]] == ["4.00", "0.00"]
        fields[-2].value, fields[-1].value = "12.5", "-7"
        fields[-1].focus()
        await pilot.press("enter")
        await until(pilot, lambda: items(app)[1] != before)
        assert place_of(items(app)[1], HOME)[:2] == pytest.approx((12.5, -7.0), abs=0.02)
        assert items(app)[1].z == before.z
        screen.action_edit_plan("edit")
        await until(pilot, lambda: "or north of home [m]" in screen_text(app))
        fields = list(app.screen.query(Input))
        for field, value, words in ((fields[-2], "x", "is not a number"), (fields[-5], "1.0", "not in both")):
            field.value = value
            field.focus()
            await pilot.press("enter")
            await until(pilot, lambda words=words: words in screen_text(app))
