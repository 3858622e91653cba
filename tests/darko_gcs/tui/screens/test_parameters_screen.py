"""The parameters screen: filter, description, changes of every kind."""

import pytest
from textual.widgets import Input, OptionList, SelectionList

from darko_gcs.state.parameters import ChangeState, ParameterChange, is_changed
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.screens.dialogs import AskScreen, ConfirmScreen, FileDialog, HelpScreen
from darko_gcs.tui.screens.parameter_dialogs import ChooseBitsScreen, ChooseValueScreen, ComparisonScreen
from darko_gcs.tui.screens.parameters_screen import DoneChange, ParametersScreen
from tests.support.gcs.parameters_screen import ACTION, TUNED, line_of, opened, shown
from tests.support.gcs.screens import FakeFeed, confirm, screen_text, settled, until
from tests.support.gcs.snapshots import snapshot_with

SIZES = ((80, 24), (120, 40), (200, 60))


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    """Preferences and files of this test alone."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def feed():
    return FakeFeed(TUNED)


async def answered(pilot, app, text):
    """The question is shown, and a value is typed in and confirmed."""
    await shown(pilot, AskScreen)
    await until(pilot, lambda: isinstance(app.focused, Input))
    app.focused.value = text
    await pilot.press("enter")


@pytest.mark.long
async def test_a_parameter_is_found_by_typing_and_changed(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app)
        await until(pilot, lambda: "4 of 4 parameters shown, 2 changed from default (*)" in screen_text(app))
        await until(pilot, lambda: feed.requests == [("fetch_parameter_metadata",)])
        await pilot.press(*"position")
        await until(pilot, lambda: "1 of 4 parameters shown" in screen_text(app))
        await until(pilot, lambda: "DRK_KPP: Position gain" in screen_text(app))
        await until(pilot, lambda: "value 1.5 N/m, default 1.2 N/m, range 0.1..3 N/m" in screen_text(app))
        await until(pilot, lambda: line_of(app, "DRK_KPP").split()[:5] == ["*", "DRK_KPP", "1.5", "N/m", "Position"])
        await pilot.press("enter")
        await shown(pilot, AskScreen)
        app.focused.value = "9"
        await pilot.press("enter")
        await until(pilot, lambda: "DRK_KPP: 9 is outside 0.1..3 N/m" in screen_text(app))
        app.focused.value = "much"
        await pilot.press("enter")
        await until(pilot, lambda: "DRK_KPP: 'much' is not a number" in screen_text(app))
        app.focused.value = "2.5"
        await pilot.press("enter")
        await until(pilot, lambda: feed.requests[-1] == ("set_parameter", "DRK_KPP", 2.5))
        feed.snapshot = snapshot_with(TUNED, parameters={"values": {**TUNED.parameters.values, "DRK_KPP": 2.5}})
        await until(pilot, lambda: isinstance(app.screen, ParametersScreen) and " 2.5 " in line_of(app, "DRK_KPP"))
        await pilot.press("escape")
        await until(pilot, lambda: "4 of 4 parameters" in screen_text(app))
        await pilot.press("escape")
        await until(pilot, lambda: not isinstance(app.screen, ParametersScreen))


async def test_longer_names_and_values_are_seen_whole_as_soon_as_they_come(feed):
    feed.snapshot = snapshot_with(TUNED, parameters={"values": {"A": 1.0}, "total": 1})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("p")
        await until(pilot, lambda: isinstance(app.screen, ParametersScreen) and "1 of 1" in screen_text(app))
        app.screen.snapshot = snapshot_with(
            feed.snapshot, parameters={"values": {"A": 1.0, "SIXTEEN_LETTERS_": 1234567.0}}
        )
        assert "SIXTEEN_LETTERS_ 1234567 " in screen_text(app)  # at once, however late the screens have their turn


async def test_a_refused_value_is_told_and_the_old_one_stays_in_view(feed):
    reason = "60 is outside 0.1..3"
    change = ParameterChange(60.0, ChangeState.REFUSED, reason)
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app, "DRK_KPP")
        feed.snapshot = snapshot_with(TUNED, parameters={"changes": {"DRK_KPP": ParameterChange(60.0)}})
        await until(pilot, lambda: line_of(app, "DRK_KPP").split()[:3] == ["*…", "DRK_KPP", "1.5"])
        await until(pilot, lambda: "60: waiting" in screen_text(app))
        feed.snapshot = snapshot_with(TUNED, parameters={"changes": {"DRK_KPP": change}})
        await until(pilot, lambda: line_of(app, "DRK_KPP").split()[:3] == ["*!", "DRK_KPP", "1.5"])
        await until(pilot, lambda: f"60: refused: {reason}" in screen_text(app))


async def test_an_enumeration_is_shown_by_name_and_chosen_from_a_list(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app, "NAV_DLL_ACT")
        await until(pilot, lambda: "go on (0)" in line_of(app, "NAV_DLL_ACT"))
        await until(pilot, lambda: "takes effect after a reboot" in screen_text(app))
        await pilot.press("enter")
        await shown(pilot, ChooseValueScreen)
        await until(pilot, lambda: "go on (0)  ← now, default" in screen_text(app))
        await until(pilot, lambda: "another number" not in screen_text(app))
        await pilot.press("down", "down", "enter")
        await until(pilot, lambda: feed.requests[-1] == ("set_parameter", "NAV_DLL_ACT", 2.0))


async def test_a_value_without_a_name_can_be_typed_where_the_range_is_longer_than_the_list(feed):
    channel = ACTION._replace(values=((0.0, "none"),), maximum=18.0)
    feed.snapshot = snapshot_with(
        TUNED,
        parameters={"values": {**TUNED.parameters.values, "NAV_DLL_ACT": 7}, "metadata": {"NAV_DLL_ACT": channel}},
    )
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app, "NAV_DLL_ACT")
        await pilot.press("enter")
        await shown(pilot, ChooseValueScreen)
        assert app.screen.query_one(OptionList).highlighted == 1
        await pilot.press("enter")
        await answered(pilot, app, "12")
        await until(pilot, lambda: feed.requests[-1] == ("set_parameter", "NAV_DLL_ACT", 12.0))


async def test_a_mask_is_shown_by_its_bits_and_switched_bit_by_bit(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(120, 40)) as pilot:
        await opened(pilot, app, "EKF_AIDS")
        await until(pilot, lambda: "GPS + flow (17)" in line_of(app, "EKF_AIDS"))
        await pilot.press("enter")
        await shown(pilot, ChooseBitsScreen)
        await until(pilot, lambda: "17 becomes 17" in screen_text(app))
        await pilot.press("down", "space")
        await until(pilot, lambda: "17 becomes 19" in screen_text(app))
        assert set(app.screen.query_one(SelectionList).selected) == {0, 1, 4}
        await pilot.press("enter")
        await until(pilot, lambda: feed.requests[-1] == ("set_parameter", "EKF_AIDS", 19))


async def test_bits_without_a_name_stay_as_they_are(feed):
    feed.snapshot = snapshot_with(TUNED, parameters={"values": {**TUNED.parameters.values, "EKF_AIDS": 17 + 256}})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app, "EKF_AIDS")
        await pilot.press("enter")
        await shown(pilot, ChooseBitsScreen)
        await pilot.press("space")
        await until(pilot, lambda: app.screen.mask == 16 + 256)


async def test_a_default_is_set_back_after_a_question(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(120, 40), notifications=True) as pilot:
        await opened(pilot, app, "DRK_KPP")
        await pilot.press("f6")
        await shown(pilot, ConfirmScreen)
        await until(pilot, lambda: "Set DRK_KPP back to its default, 1.2? It is 1.5 now." in screen_text(app))
        await pilot.press("n")
        await until(pilot, lambda: isinstance(app.screen, ParametersScreen))
        assert feed.requests == [("fetch_parameter_metadata",)]
        await pilot.press("f6")
        await shown(pilot, ConfirmScreen)
        await pilot.pause(0.05)
        await pilot.press("y")
        await until(pilot, lambda: feed.requests[-1] == ("set_parameter", "DRK_KPP", 1.2))
        for row, words in (("NAV_DLL_ACT", "has its default value"), ("SIM_[red]", "does not report the default of")):
            await until(pilot, lambda: isinstance(app.screen, ParametersScreen))
            app.screen.table.move_to(app.screen.table.keys.index(row))
            await pilot.press("f6")
            await until(pilot, lambda words=words: words in screen_text(app))
        assert len(feed.requests) == 2


@pytest.mark.long
async def test_the_last_change_is_taken_back_after_a_question_also_when_the_screen_was_left(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(120, 40), notifications=True) as pilot:
        await opened(pilot, app, "DRK_KPP")
        await pilot.press("ctrl+z")
        await until(pilot, lambda: "Nothing to undo" in screen_text(app))
        await pilot.press("enter")
        await answered(pilot, app, "2")
        await until(pilot, lambda: feed.requests[-1] == ("set_parameter", "DRK_KPP", 2.0))
        feed.snapshot = snapshot_with(TUNED, parameters={"values": {**TUNED.parameters.values, "DRK_KPP": 2.0}})
        await until(pilot, lambda: isinstance(app.screen, ParametersScreen) and " 2 " in line_of(app, "DRK_KPP"))
        await pilot.press("escape")
        await until(pilot, lambda: not isinstance(app.screen, ParametersScreen))
        await opened(pilot, app, "DRK_KPP")
        await confirm(pilot, "ctrl+z")
        await until(pilot, lambda: feed.requests[-1] == ("set_parameter", "DRK_KPP", 1.5))
        assert app.changes == []
        feed.snapshot = snapshot_with(feed.snapshot, identity={"source": (2, 1)})
        app.changes.append(DoneChange((1, 1), "DRK_KPP", 9.0))
        await until(
            pilot,
            lambda: isinstance(app.screen, ParametersScreen) and app.screen.snapshot.identity.source == (2, 1),
        )
        await pilot.press("ctrl+z")  # of another vehicle
        await settled(pilot)
        assert isinstance(app.screen, ParametersScreen)


@pytest.mark.long
async def test_the_same_value_again_is_sent_and_is_nothing_to_take_back(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(120, 40), notifications=True) as pilot:
        await opened(pilot, app, "DRK_KPP")
        await pilot.press("enter")
        await shown(pilot, AskScreen)
        await pilot.press("enter")
        await until(pilot, lambda: feed.requests[-1] == ("set_parameter", "DRK_KPP", 1.5))
        await until(pilot, lambda: isinstance(app.screen, ParametersScreen))
        await pilot.press("ctrl+z")
        await until(pilot, lambda: "Nothing to undo" in screen_text(app))


async def test_only_what_differs_from_its_default_is_shown(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app)
        await pilot.press("f2")
        await until(pilot, lambda: app.screen.table.keys == ("DRK_KPP", "EKF_AIDS"))
        await until(
            pilot, lambda: "2 of 4 parameters shown, 2 changed from default (*), only changed" in screen_text(app)
        )
        assert all(is_changed(TUNED, name) for name in app.screen.table.keys)
        await pilot.press("f2")
        await until(pilot, lambda: len(app.screen.table.keys) == 4)


async def test_the_keys_move_the_cursor_of_the_list(feed):
    feed.snapshot = snapshot_with(TUNED, parameters={"values": {f"P{n:03d}": n for n in range(100)}, "total": 100})
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("p")
        await until(pilot, lambda: isinstance(app.screen, ParametersScreen) and " P002 " in screen_text(app))
        table = app.screen.table
        for key, row in (("down", 1), ("down", 2), ("up", 1), ("pageup", 0), ("up", 0)):
            await pilot.press(key)
            await until(pilot, lambda row=row: table.cursor == row)
        for _ in range(12):
            await pilot.press("pagedown")
        await until(pilot, lambda: table.cursor == 99 and " P099 " in screen_text(app))
        await until(pilot, lambda: " P002 " not in screen_text(app))
        await pilot.click(table, offset=(5, 1))
        await until(pilot, lambda: table.cursor < 99)
        assert f" {table.key} " in screen_text(app).splitlines()[3]


async def test_a_restarted_vehicle_is_asked_for_its_metadata_again(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app)
        await until(pilot, lambda: feed.requests == [("fetch_parameter_metadata",)])
        feed.snapshot = snapshot_with(
            TUNED, parameters={"values": {}, "metadata": {}}, link={"restarts": TUNED.link.restarts + 1}
        )
        await until(pilot, lambda: feed.requests[1:] == [("fetch_parameters",), ("fetch_parameter_metadata",)])


async def test_the_help_lists_the_keys_of_this_screen(feed):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app)
        await pilot.press("f1")
        await until(pilot, lambda: isinstance(app.screen, HelpScreen) and "back to its default" in screen_text(app))


async def test_parameters_of_a_recording_are_shown_but_cannot_be_changed(feed, home):
    feed.station, feed.snapshot = None, snapshot_with(TUNED, parameters={"metadata": {}}, session={"is_replay": True})
    (home / "mine.parm").write_text("DRK_KPP 2\n")
    app = GroundStationApp(feed)
    async with app.run_test(size=(120, 40), notifications=True) as pilot:
        await opened(pilot, app)
        await until(pilot, lambda: "not described in a recording" in screen_text(app))
        for key in ("enter", "f6", "f5"):
            await pilot.press(key)
            await until(pilot, lambda: "This is a recording" in screen_text(app))
            app.clear_notifications()
            await until(pilot, lambda: "This is a recording" not in screen_text(app))
        await pilot.press("f7")
        await shown(pilot, FileDialog)
        await pilot.press("enter")
        await until(pilot, lambda: isinstance(app.screen, ComparisonScreen) and "1 of 1 chosen" in screen_text(app))
        await pilot.press("enter")
        await until(pilot, lambda: "This is a recording" in screen_text(app))


@pytest.mark.long(after=1)
@pytest.mark.parametrize("size", SIZES)
async def test_it_fits_the_terminal(feed, size):
    app = GroundStationApp(feed)
    async with app.run_test(size=size) as pilot:
        await opened(pilot, app, "NAV_DLL_ACT")
        for part in (
            "NAV_DLL_ACT", "go on (0)", "GPS + flow (17)", "2 changed from default", "Ground station lost",
            "0 go on, 1 hold", "default go on (0)", "⏎ Change", "f2 Changed", "f6 Default", "f7 File", "f8 Save",
        ):  # fmt: skip
            await until(pilot, lambda part=part: part in screen_text(app))


@pytest.mark.long(after=1)
@pytest.mark.parametrize("size", SIZES)
def test_the_screen_matches_its_snapshot(snap_compare, feed, size):
    async def settle(pilot):
        await opened(pilot, pilot.app, "NAV_DLL_ACT")
        await settled(pilot)

    assert snap_compare(GroundStationApp(feed), terminal_size=size, run_before=settle)
