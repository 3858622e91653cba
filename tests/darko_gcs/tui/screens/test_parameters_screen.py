"""The parameters screen: filter, description, change."""

from dataclasses import replace

import pytest
from textual.widgets import Input

from darko_gcs.state.parameter_metadata import ParameterMetadata
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.screens.dialogs import AskScreen
from darko_gcs.tui.screens.parameters_screen import ParametersScreen, matching_names, parameter_cells
from tests.support.gcs.screens import FakeFeed, screen_text, until
from tests.support.gcs.snapshots import HOVERING

GAIN = ParameterMetadata(text="Position gain", unit="N/m", minimum=0.1, maximum=3.0, default=1.2)
SWITCH = ParameterMetadata(text="Integral in the linear law", minimum=0.0, maximum=1.0, default=1.0, is_integer=True)
TUNED = replace(
    HOVERING,
    parameters={"DRK_KPP": 1.5, "DRK_LQI": 1, "SIM_[red]": 2.0}, parameter_count=3,
    parameter_metadata={"DRK_KPP": GAIN, "DRK_LQI": SWITCH},
)  # fmt: skip


@pytest.fixture
def feed():
    return FakeFeed(TUNED)


def test_the_filter_searches_names_and_descriptions():
    assert matching_names(TUNED, "") == ("DRK_KPP", "DRK_LQI", "SIM_[red]")
    assert matching_names(TUNED, "gain drk") == ("DRK_KPP",)
    assert matching_names(TUNED, "linear") == ("DRK_LQI",)
    assert matching_names(TUNED, "nothing") == ()
    assert matching_names(TUNED, "", only_changed=True) == ("DRK_KPP",)


def test_a_row_has_value_unit_range_and_a_mark_if_changed():
    gain = [str(cell) for cell in parameter_cells(TUNED, "DRK_KPP")]
    assert gain == ["*", "DRK_KPP", "1.5", "N/m", "0.1..3", "Position gain"]
    assert [str(cell) for cell in parameter_cells(TUNED, "SIM_[red]")] == [" ", "SIM_[red]", "2", "", "", ""]


async def test_a_parameter_is_found_by_typing_and_changed(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("p")
        await until(pilot, lambda: isinstance(app.screen, ParametersScreen) and "3 of 3 parameters" in screen_text(app))
        await until(pilot, lambda: feed.requests == [("fetch_parameter_metadata",)])
        await until(pilot, lambda: app.screen.table.row_count == 3)
        assert str(app.screen.table.get_row("SIM_[red]")[1]) == "SIM_[red]"
        await pilot.press(*"position")
        await until(pilot, lambda: "1 of 3 parameters shown, 1 changed from default (*)" in screen_text(app))
        assert "DRK_KPP: Position gain, 0.1..3 N/m, default 1.2" in screen_text(app)
        await pilot.press("enter")
        await until(pilot, lambda: isinstance(app.screen, AskScreen) and isinstance(app.focused, Input))
        app.focused.value = "9"
        await pilot.press("enter")
        await until(pilot, lambda: "DRK_KPP: 9 is not within 0.1..3 N/m" in screen_text(app))
        app.focused.value = "2.5"
        await pilot.press("enter")
        await until(pilot, lambda: feed.requests[-1] == ("set_parameter", "DRK_KPP", 2.5))
        feed.snapshot = replace(TUNED, parameters={**TUNED.parameters, "DRK_KPP": 2.5})
        await until(pilot, lambda: str(app.screen.table.get_row("DRK_KPP")[2]) == "2.5")
        await pilot.press("escape")
        await until(pilot, lambda: "3 of 3 parameters" in screen_text(app))
        await pilot.press("escape")
        await until(pilot, lambda: not isinstance(app.screen, ParametersScreen))


async def test_the_arrow_keys_move_the_cursor_of_the_table(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("p")
        await until(pilot, lambda: isinstance(app.screen, ParametersScreen) and app.screen.table.row_count == 3)
        await pilot.press("down", "down")
        assert app.screen.table.cursor_row == 2
        await pilot.press("up")
        assert app.screen.table.cursor_row == 1
        await pilot.press("pageup")
        await until(pilot, lambda: app.screen.table.cursor_row == 0)
        await pilot.press("pagedown")
        await until(pilot, lambda: app.screen.table.cursor_row == 2)


async def test_parameters_of_a_recording_are_shown_but_cannot_be_changed(feed):
    feed.station, feed.snapshot = None, replace(TUNED, parameter_metadata={})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("p")
        await until(pilot, lambda: "the vehicle has no description of it" in screen_text(app))
        await pilot.press("enter")
        await pilot.pause()
        assert isinstance(app.screen, ParametersScreen)
