"""Charts on the screen: added, moved through, paused, kept as views; the same of a recording."""

import math

import pytest

from darko_gcs.feed.replay_feed import ReplayFeed
from darko_gcs.state.chart_views import ChartView, ChartViews
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.replay_app import ReplayApp
from darko_gcs.tui.screens.charts_screen import ChartsScreen
from darko_gcs.tui.widgets.charts_panel import ChartsPanel
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.tlog import read_tlog
from tests.support.gcs.messages import arrived, heartbeat, jump, position
from tests.support.gcs.screens import FakeFeed, notices, panel_text, screen_text, settled, until
from tests.support.gcs.snapshots import FORWARD
from tests.support.paths import DATA
from tests.support.vehicle.darko_messages import hybrid_state


@pytest.fixture
def feed():
    feed = FakeFeed(FORWARD)
    feed.history.follow((1, 1))
    for k in range(600):
        feed.history.take([arrived(attitude(k)), arrived(position(100 * k, 0.1 * k))], 40.5 + 0.1 * k)
        if k == 300:
            feed.history.take([arrived(jump(1, 5.0)), arrived(heartbeat())], 40.5 + 0.1 * k)
    return feed


def attitude(k):
    return mavlink.MAVLink_attitude_message(100 * k, 0.2 * math.sin(0.05 * k), 1.5 + 0.05 * math.cos(0.02 * k),
                                            0.01 * k, 0.1 * math.cos(0.05 * k), 0.0, 0.1)  # fmt: skip


def station(feed, tmp_path):
    app = GroundStationApp(feed)
    app.views = ChartViews(tmp_path / "views.toml")
    return app


async def opened(pilot):
    await pilot.press("C")
    await until(pilot, lambda: isinstance(pilot.app.screen, ChartsScreen) and "Charts" in screen_text(pilot.app))


@pytest.mark.long
async def test_an_expression_is_added_with_its_value_and_unit(feed, tmp_path):
    app = station(feed, tmp_path)
    async with app.run_test(size=(120, 40)) as pilot:
        await opened(pilot)
        await pilot.press("c")
        await until(pilot, lambda: "Another chart" in screen_text(app))
        await pilot.press(*"LOCAL_POSITION_NED.x*2", "enter")
        await until(pilot, lambda: "g LOCAL_POSITION_NED.x*2  119.8" in screen_text(app))
        await pilot.press("delete")
        await until(pilot, lambda: "LOCAL_POSITION_NED" not in screen_text(app))


@pytest.mark.long
async def test_an_expression_is_completed_by_tab_and_may_be_a_name_of_the_panels(feed, tmp_path):
    app = station(feed, tmp_path)
    async with app.run_test(size=(120, 40)) as pilot:
        await opened(pilot)
        await pilot.press("c")
        await until(pilot, lambda: "Tab: complete" in screen_text(app))
        await pilot.press(*"2*loc", "tab", "x", "enter")
        await until(pilot, lambda: "g 2*LOCAL_POSITION_NED.x  119.8" in screen_text(app))
        await pilot.press("c")
        await until(pilot, lambda: "Tab: complete" in screen_text(app))
        await pilot.press(*"til", "tab", "enter")
        await until(pilot, lambda: "h tilt  " in screen_text(app))


async def test_tab_completes_at_once_and_goes_on_to_the_next_completion_in_a_field_that_keeps_the_letters(
    feed, tmp_path
):
    app = station(feed, tmp_path)
    feed.history.take([arrived(mavlink.MAVLink_altitude_message(0, *[1.0] * 6))], 100.4)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot)
        await pilot.press("c")
        await until(pilot, lambda: "Tab: complete" in screen_text(app))
        field = app.focused
        field.value = "2*alt"  # the suggestion, which comes later, is not waited for
        field.action_complete()
        assert (field.value, field.cursor_position) == ("2*altitude", 10)
        await pilot.press("tab")
        assert field.value == "2*ALTITUDE."
        await pilot.press("tab")
        assert field.value == "2*ALTITUDE.time_usec"
        field.value = "xyz"
        await pilot.press("tab", "1")
        assert (app.focused, field.value) == (field, "xyz1")  # the only field


@pytest.mark.long
async def test_the_beginning_of_a_name_is_refused_with_the_whole_one(feed, tmp_path):
    app = station(feed, tmp_path)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot)
        await pilot.press("a")
        await until(pilot, lambda: "Add to the chart" in screen_text(app))
        await pilot.press(*"alt", "enter")
        await until(pilot, lambda: "did you mean altitude?" in " ".join(screen_text(app).split()))


async def test_curves_keep_their_letters_while_a_view_is_edited(feed, tmp_path):
    app = station(feed, tmp_path)
    async with app.run_test(size=(120, 40)) as pilot:
        await opened(pilot)
        assert "c deg(ATTITUDE.yaw)" in screen_text(app)
        await pilot.press("a")
        await until(pilot, lambda: "Add to the chart" in screen_text(app))
        await pilot.press(*"LOCAL_POSITION_NED.x", "enter")
        await until(pilot, lambda: "g LOCAL_POSITION_NED.x" in screen_text(app))
        assert "c deg(ATTITUDE.yaw)" in screen_text(app)


async def test_a_value_that_rounding_left_is_0_and_a_law_has_its_name(feed, tmp_path):
    app = station(feed, tmp_path)
    feed.history.take([arrived(hybrid_state(59_900, Law.FORWARD_LINEAR))], 100.4)
    app.view = ChartView("", (("LOCAL_POSITION_NED.x - 59.9", "DARKO_HYBRID_STATE.law"),))
    async with app.run_test(size=(120, 40)) as pilot:
        await opened(pilot)
        await until(pilot, lambda: "59.9  0 m" in screen_text(app) and "law  forward linear" in screen_text(app))


async def test_a_wrong_expression_is_refused_with_what_is_meant(feed, tmp_path):
    app = station(feed, tmp_path)
    async with app.run_test(size=(120, 40)) as pilot:
        await opened(pilot)
        await pilot.press("a")
        await until(pilot, lambda: "Add to the chart" in screen_text(app))
        await pilot.press(*"ATTITUD.roll", "enter")
        await until(pilot, lambda: "did you mean" in screen_text(app))
        await pilot.press("escape")
        await until(pilot, lambda: isinstance(app.screen, ChartsScreen))


async def test_the_cursor_shows_the_values_of_its_time(feed, tmp_path):
    app = station(feed, tmp_path)
    app.view = ChartView("", (("LOCAL_POSITION_NED.x",),))
    async with app.run_test(size=(120, 40)) as pilot:
        await opened(pilot)
        await until(pilot, lambda: "59.9 m" in screen_text(app))
        await pilot.press("left")
        await until(pilot, lambda: "cursor 0:" in screen_text(app) and "59.9 m" not in screen_text(app))
        shown = app.screen.charts
        value = float(screen_text(app).split("LOCAL_POSITION_NED.x")[1].split()[0])
        assert value == pytest.approx(shown.cursor, abs=0.8)
        await pilot.press("escape")
        await until(pilot, lambda: "cursor" not in screen_text(app).lower().replace("→ cursor", ""))
        assert isinstance(app.screen, ChartsScreen)


@pytest.fixture
def young():
    """A feed that has heard 10 s of the 60 s that are shown."""
    feed = FakeFeed(FORWARD)
    feed.history.follow((1, 1))
    for k in range(100):
        feed.history.take([arrived(position(100 * k, 0.1 * k))], 90.5 + 0.1 * k)
    return feed


async def test_the_cursor_begins_where_there_is_data_and_stays_in_sight_of_a_zoom(young, tmp_path):
    app = station(young, tmp_path)
    app.view = ChartView("", (("LOCAL_POSITION_NED.x",),))
    async with app.run_test(size=(120, 40)) as pilot:
        await opened(pilot)
        await until(pilot, lambda: "9.9 m" in screen_text(app))
        await pilot.press("left")
        await until(pilot, lambda: "cursor 0:0" in screen_text(app) and "no value" not in screen_text(app))
        charts = app.screen.charts
        assert charts.cursor == pytest.approx(5.0, abs=1.5)
        await pilot.press(*["plus"] * 4)  # to less than what lies between the cursor and the present
        await until(pilot, lambda: "paused" in screen_text(app))
        assert charts.end - charts.window < charts.cursor < charts.end


async def test_no_value_has_no_unit(young, tmp_path):
    app = station(young, tmp_path)
    app.view = ChartView("", (("LOCAL_POSITION_NED.x",),))
    async with app.run_test(size=(120, 40)) as pilot:
        await opened(pilot)
        await until(pilot, lambda: "9.9 m" in screen_text(app))
        app.screen.charts.move_cursor(-1000)
        assert app.screen.charts.cursor == young.history.begin  # not before the first message
        await until(pilot, lambda: "cursor 0:0" in screen_text(app))
        app.screen.charts.cursor = -50.0
        app.screen.charts.choose(0)
        await until(pilot, lambda: "no value" in screen_text(app))
        assert "no value m" not in screen_text(app)


async def test_paused_charts_stand_still_and_go_on(feed, tmp_path):
    app = station(feed, tmp_path)
    app.view = ChartView("", (("LOCAL_POSITION_NED.x",),))
    async with app.run_test(size=(120, 40)) as pilot:
        await opened(pilot)
        await pilot.press("space")
        await until(pilot, lambda: "paused" in screen_text(app))
        feed.history.take([arrived(position(70_000, 99.0))], 110.5)
        feed.now = 110.5
        await pilot.pause(0.3)
        assert "99 m" not in screen_text(app)
        await pilot.press("space")
        await until(pilot, lambda: "99 m" in screen_text(app) and "paused" not in screen_text(app))


async def test_keys_zoom_and_show_all(feed, tmp_path):
    app = station(feed, tmp_path)
    async with app.run_test(size=(120, 40)) as pilot:
        await opened(pilot)
        await pilot.press("plus")
        await until(pilot, lambda: " 30 s " in screen_text(app))
        await pilot.press("0")
        await until(pilot, lambda: " all " in screen_text(app))
        await pilot.press("less_than_sign")
        await until(pilot, lambda: "paused" in screen_text(app))


@pytest.mark.long
async def test_a_view_is_kept_by_name_and_opened_again(feed, tmp_path):
    app = station(feed, tmp_path)
    async with app.run_test(size=(120, 40), notifications=True) as pilot:
        await opened(pilot)
        await pilot.press("down", "down", "delete", "s")
        await until(pilot, lambda: "Keep these charts" in screen_text(app))
        await pilot.press(*["backspace"] * 12, *"mine", "enter")
        await until(pilot, lambda: "Charts: mine" in screen_text(app))
        await until(pilot, lambda: "--view 'mine'" in notices(app))
        assert ChartViews(app.views.file).view("mine").charts[0] == ("deg(ATTITUDE.roll)", "deg(ATTITUDE.pitch)")
        await pilot.press("o")
        await until(pilot, lambda: "Open a view" in screen_text(app) and "mine: deg" in screen_text(app))
        await pilot.press("down", "down", "enter")
        await until(pilot, lambda: "Charts: height and speed" in screen_text(app))


async def test_what_the_vehicle_does_not_send_is_said_beside_its_name(feed, tmp_path):
    app = station(feed, tmp_path)
    app.view = ChartView("", (("VFR_HUD.alt",),))
    async with app.run_test(size=(120, 40)) as pilot:
        await opened(pilot)
        await until(pilot, lambda: "the vehicle has no VFR_HUD" in screen_text(app))


async def test_a_field_of_the_inspector_is_drawn():
    app = ReplayApp(ReplayFeed(read_tlog(DATA / "square-flight.tlog"), "square-flight.tlog", begin=3.0))
    async with app.run_test(size=(120, 40)) as pilot:
        await pilot.press("space", "E")
        await until(pilot, lambda: "255/190" in screen_text(app))
        await pilot.press(*"vfr", "enter", "down", "enter")
        await until(pilot, lambda: "VFR_HUD.groundspeed" in screen_text(app) and "Charts" in screen_text(app))


@pytest.mark.long
async def test_a_recording_shows_all_of_the_flight_with_its_jumps():
    app = ReplayApp(ReplayFeed(read_tlog(DATA / "square-flight.tlog"), "square-flight.tlog", begin=3.0))
    async with app.run_test(size=(120, 40)) as pilot:
        await pilot.press("space", "C", "0")
        await until(pilot, lambda: "hover linear" in screen_text(app) and " all " in screen_text(app))


@pytest.mark.long(after=1)
@pytest.mark.parametrize("size", [(80, 24), (120, 40), (200, 60)], ids=["80x24", "120x40", "200x60"])
def test_the_screen_matches_its_snapshot(snap_compare, feed, tmp_path, size):
    async def settle(pilot):
        await opened(pilot)
        await pilot.press("left")
        await settled(pilot)

    assert snap_compare(station(feed, tmp_path), terminal_size=size, run_before=settle)


def test_a_long_window_shows_new_values_within_a_second(feed):
    panel = ChartsPanel(feed.history, ChartView("", (("LOCAL_POSITION_NED.x",),)))
    panel.window = 600.0
    feed.history.take([arrived(position(60_100, 7.0))], 100.6)
    before = panel_text(panel, FORWARD, 120, 20)
    feed.history.take([arrived(position(60_700, 7.5))], 101.2)
    assert panel_text(panel, FORWARD, 120, 20) == before
    feed.history.take([arrived(position(61_200, 8.5))], 101.7)
    assert "LOCAL_POSITION_NED.x  8.5 m" in panel_text(panel, FORWARD, 120, 20)
