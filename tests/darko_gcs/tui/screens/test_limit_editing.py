"""Fence and rally points drawn, dragged and edited in metres on the mission screen, as waypoints are."""

import pytest
from textual.widgets import Input, OptionList

from darko_gcs.state.fence_shapes import fence_circles, fence_polygons, item_position, rally_points
from darko_gcs.state.flight_plan_state import FlightPlanState
from darko_gcs.state.map_overlay import OverlayShape
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.map_panel import MovableMap
from darko_gcs.tui.screens.dialogs import AskScreen, ChooseScreen
from darko_gcs.tui.screens.mission_screen import MissionScreen
from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.plans import load, save
from protocol.plans.fence_rally import fence_items, rally_items
from sitl.defaults import HOME
from tests.support.gcs.screens import FakeFeed, confirm, screen_text, settled, until
from tests.support.gcs.snapshots import HOVERING, snapshot_with


@pytest.fixture
def feed():
    return FakeFeed(HOVERING)


@pytest.fixture
def app(feed):
    return GroundStationApp(feed)


async def opened(pilot, app, times=1):
    """The mission screen with the fence (1) or the rally points (2)."""
    await pilot.press("m")
    await until(pilot, lambda: isinstance(app.screen, MissionScreen) and app.screen.table.row_count == 6)
    await pilot.press(*["G"] * times)
    await until(pilot, lambda: app.screen.table.row_count == 0)
    return app.screen


async def put_in(pilot, app, number):
    """Put an area of the list into the fence."""
    screen = app.screen
    await pilot.press("i")
    await until(pilot, lambda: isinstance(app.screen, ChooseScreen) and isinstance(app.focused, OptionList))
    await pilot.press(*["down"] * number, "enter")
    await until(pilot, lambda: app.screen is screen and screen.table.row_count > 0)


def drafted(app):
    return snapshot_with(HOVERING, plans={"fence": app.draft.fence, "rally": app.draft.rally})


async def typed(pilot, app, **values):
    """Type into the fields of a form, by their order, and confirm."""
    await until(pilot, lambda: isinstance(app.screen, AskScreen) and isinstance(app.focused, Input))
    for field, value in values.items():
        app.screen.query_one(f"#field-{field[1:]}", Input).value = value
    await pilot.press("enter")


@pytest.mark.long
async def test_a_polygon_is_put_in_its_corner_edited_in_metres_and_all_of_it_turned_and_taken_back(feed, app):
    async with app.run_test(size=(140, 44)) as pilot:
        screen = await opened(pilot, app)
        await put_in(pilot, app, 0)
        assert screen.table.row_count == 4
        await until(pilot, lambda: "inside 1/4" in screen_text(app) and "fence of 1 area" in screen_text(app))
        assert "A square of 80 m around" in " ".join(screen_text(app).split())
        await pilot.press("e")
        await typed(pilot, app, f0="70", f1="-12.5")
        await until(pilot, lambda: app.screen is screen)
        ((corners, state),) = fence_polygons(drafted(app))
        assert (corners[0], state) == (pytest.approx((70.0, -12.5), abs=0.02), "fence")
        await pilot.press("space")
        assert [state for _, state in fence_polygons(drafted(app))] == ["keep-out"]
        await pilot.press("z", "z", "z")
        assert app.draft.fence == ()
        await pilot.press("Z")
        assert len(app.draft.fence) == 4
        assert feed.requests == []


@pytest.mark.long
async def test_a_corner_is_added_by_a_click_dragged_by_the_mouse_and_removed(app):
    async with app.run_test(size=(140, 44)) as pilot:
        screen = await opened(pilot, app)
        await put_in(pilot, app, 0)
        shown = screen.query_one(MovableMap)
        await settled(pilot)
        await pilot.click(shown, offset=(20, 8))
        await until(pilot, lambda: screen.table.row_count == 5)
        assert screen.table.cursor_row == 1
        before = item_position(HOVERING, app.draft.fence[1])
        cell = shown._cell_of(before)
        await pilot.mouse_down(shown, offset=(cell[0] + 1, cell[1] + 1))
        await pilot.hover(shown, offset=(cell[0] + 7, cell[1] + 1))
        await pilot.mouse_up(shown, offset=(cell[0] + 7, cell[1] + 1))
        await until(pilot, lambda: item_position(HOVERING, app.draft.fence[1])[1] > before[1] + 1.0)
        await pilot.press("x")
        assert len(app.draft.fence) == 4
        assert {item.params[0] for item in app.draft.fence} == {4.0}


@pytest.mark.long
async def test_an_area_is_put_where_was_clicked_and_the_map_stands_still_under_clicks_near_its_edge(app):
    async with app.run_test(size=(140, 44)) as pilot:
        screen = await opened(pilot, app)
        shown = screen.query_one(MovableMap)
        await settled(pilot)
        middle = shown.middle
        await pilot.click(shown, offset=(9, 6))
        await until(pilot, lambda: "i puts a polygon or a circle there" in screen_text(app))
        await put_in(pilot, app, 3)
        assert item_position(HOVERING, app.draft.fence[0]) == pytest.approx(shown.pressed, abs=0.1)
        assert shown.pressed != pytest.approx(middle, abs=1.0)
        await pilot.press("x", "G")
        await settled(pilot)
        view = shown._view
        await pilot.click(shown, offset=(2, 2))
        await until(pilot, lambda: len(app.draft.rally) == 1)
        await settled(pilot)
        assert shown._view == view


@pytest.mark.long
async def test_a_polygon_that_crosses_itself_is_warned_of(app):
    async with app.run_test(size=(140, 44)) as pilot:
        screen = await opened(pilot, app)
        await put_in(pilot, app, 0)
        await until(pilot, lambda: "fence of 1 area" in screen_text(app))
        assert "CROSSED" not in screen_text(app)
        await pilot.press("e")
        await typed(pilot, app, f0="-60", f1="0")
        await until(pilot, lambda: "CROSSED: the fence's polygon from item 0" in " ".join(screen_text(app).split()))
        assert screen.query_one("#mission-status").has_class("-warned")


@pytest.mark.long
async def test_a_circle_has_a_radius_that_must_be_one(app):
    async with app.run_test(size=(80, 24)) as pilot:
        screen = await opened(pilot, app)
        await put_in(pilot, app, 3)
        await pilot.press("e")
        await typed(pilot, app, f2="-3")
        await until(pilot, lambda: "Radius: from 0.01 to 100 000 m, not -3" in screen_text(app))
        await typed(pilot, app, f2="7.5")
        await until(pilot, lambda: app.screen is screen)
        ((_, _, radius, state),) = fence_circles(drafted(app))
        assert (radius, state) == (7.5, "keep-out")


@pytest.mark.long
async def test_rally_points_are_clicked_moved_by_keys_in_three_ways_saved_and_uploaded(feed, app, tmp_path):
    async with app.run_test(size=(140, 44)) as pilot:
        screen = await opened(pilot, app, times=2)
        await settled(pilot)
        await pilot.click(screen.query_one(MovableMap), offset=(12, 12))
        await until(pilot, lambda: len(app.draft.rally) == 1)
        ((north, east),) = rally_points(drafted(app))
        await pilot.press("up", "right", "pageup")
        await until(pilot, lambda: app.draft.rally[0].z == 20.5)
        assert rally_points(drafted(app))[0] == pytest.approx((north + 0.5, east + 0.5), abs=0.02)
        path = tmp_path / "limits.plan"
        save(app.draft.to_save(HOVERING), path)
        assert rally_items(load(path)) == app.draft.rally
        assert fence_items(load(path)) == ()
        await confirm(pilot, "u")
        await until(pilot, lambda: feed.requests)
        ((request, items, *named),) = feed.requests
        assert (request, items) == ("plans.upload", None)  # the vehicle has the mission already
        assert ("rally", app.draft.rally) in named


async def test_a_fence_is_sent_while_a_flight_plan_is_flown_whose_leg_is_the_mission(feed, app):
    planned = HOVERING._replace(flight_plan=FlightPlanState(plan_id=1))
    feed.snapshot = snapshot_with(planned, mission={"state": mavlink.MISSION_STATE_ACTIVE})
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app)
        app.draft.edit(())
        await put_in(pilot, app, 0)
        await pilot.press("u")
        await until(pilot, lambda: "Send the fence? The vehicle obeys the fence at once." in screen_text(app))
        await until(pilot, lambda: hasattr(app.screen, "shown_at") and app.screen.is_mounted)
        await pilot.press("y")
        await until(pilot, lambda: feed.requests)
        assert feed.requests[0][:2] == ("plans.upload", None)
        assert app.draft.is_on_vehicle(snapshot_with(feed.snapshot, plans={"fence": app.draft.fence}))


async def test_a_leg_through_a_keep_out_area_and_one_below_the_chosen_height_are_warned_of(app):
    async with app.run_test(size=(140, 44)) as pilot:
        screen = await opened(pilot, app)
        assert "BLOCKED" not in screen_text(app)
        await put_in(pilot, app, 1)
        await until(pilot, lambda: "BLOCKED: leg" in " ".join(screen_text(app).split()))
        assert screen.query_one("#mission-status").has_class("-warned")
        assert "✗" in screen_text(app)
        await pilot.press("L")
        await typed(pilot, app, f0="-1")
        await until(pilot, lambda: "from 0 to 1 000 m, not -1" in screen_text(app))
        await typed(pilot, app, f0="4000")
        await typed(pilot, app, f0="900")
        await until(pilot, lambda: app.screen is screen and screen.low_leg == 900.0)


async def test_the_pilots_shapes_are_on_both_maps(app):
    place = LocalFrame(HOME).to_geodetic((2.0, 2.0, 0.0))
    app.overlay = (OverlayShape("Tree", (place,)),)
    async with app.run_test(size=(140, 44)) as pilot:
        await until(pilot, lambda: "•Tree" in screen_text(app))
        await pilot.press("m")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen) and "•Tree" in screen_text(app))


async def test_without_home_or_in_a_recording_nothing_is_put_in(feed, app):
    feed.snapshot = snapshot_with(HOVERING, position={"home": None})
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app)
        await pilot.press("i")
        await until(pilot, lambda: "Home is not known yet" in screen_text(app))
        feed.snapshot = snapshot_with(HOVERING, session={"is_replay": True})
        await settled(pilot)
        await put_in_refused(pilot, app)
        assert app.draft.fence == ()


async def put_in_refused(pilot, app):
    await pilot.press("i")
    await until(pilot, lambda: isinstance(app.focused, OptionList))
    await pilot.press("enter")
    await until(pilot, lambda: "recording cannot be edited" in screen_text(app))


@pytest.mark.long
async def test_columns_keys_and_help_are_those_of_the_part_that_is_edited(feed, app):
    async with app.run_test(size=(200, 60)) as pilot:
        screen = await opened(pilot, app)
        await put_in(pilot, app, 0)

        def footer():
            return screen_text(app).splitlines()[-1]

        await until(pilot, lambda: "space In/out" in footer() and "G Rally" in footer() and "tab Map" in footer())
        assert "Leg mode" not in footer()
        assert "cruise" not in screen_text(app)  # a column of legs
        await pilot.press("question_mark")
        await until(pilot, lambda: "Stay out of the area" in screen_text(app))
        assert "Raise or lower" in screen_text(app)
        assert "Fly the leg in hover" not in screen_text(app)
        await pilot.press("escape")
        await until(pilot, lambda: app.screen is screen)
        await pilot.press("S", "j")  # of the mission: the rows here are corners
        await settled(pilot)
        assert app.screen is screen
        await pilot.press("tab")
        await until(pilot, lambda: "tab Table" in footer())
        await pilot.press("G")
        await until(pilot, lambda: "G Mission" in footer() and "height" in screen_text(app))
        assert "In/out" not in footer()
        await pilot.press("G")
        await until(pilot, lambda: "space Leg mode" in footer() and "G Fence" in footer())
        assert "cruise s J" in screen_text(app)


@pytest.mark.long
async def test_differences_of_a_fence_are_told_in_words(feed, app):
    async with app.run_test(size=(120, 40)) as pilot:
        screen = await opened(pilot, app)
        await put_in(pilot, app, 3)
        await pilot.press("equals_sign")
        await until(pilot, lambda: app.screen is not screen and "circle to stay outside, r 20 m" in screen_text(app))
        assert "nav fence" not in screen_text(app)
