"""The parameters screen: favourites, and files of parameters."""

import pytest

from darko_gcs.preferences import Preferences, PreferencesFile
from darko_gcs.state.parameters import ChangeState, ParameterChange
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.screens.dialogs import FileDialog
from darko_gcs.tui.screens.parameter_dialogs import ComparisonScreen
from darko_gcs.tui.screens.parameters_screen import ParametersScreen
from protocol.plans.parameter_files import load_parameters
from tests.support.gcs.parameters_screen import TUNED, line_of, opened, shown
from tests.support.gcs.screens import FakeFeed, notices, screen_text, until
from tests.support.gcs.snapshots import snapshot_with


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    """Preferences and files of this test alone."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def feed():
    return FakeFeed(TUNED)


async def test_favourites_come_first_and_are_kept(feed, home):
    app = GroundStationApp(feed)
    async with app.run_test(size=(80, 24)) as pilot:
        await opened(pilot, app, "SIM_[red]")
        await pilot.press("f4")
        await until(pilot, lambda: app.screen.table.keys[0] == "SIM_[red]")
        await until(pilot, lambda: line_of(app, "SIM_[red]").startswith("★"))
        assert app.screen.table.key == "SIM_[red]"  # the cursor goes along
        await pilot.press("f3")
        await until(pilot, lambda: app.screen.table.keys == ("SIM_[red]",))
        await until(pilot, lambda: "only favourites" in screen_text(app))
        await pilot.press("escape")
        await until(pilot, lambda: not isinstance(app.screen, ParametersScreen))
        await opened(pilot, app)
        assert app.screen.table.keys[0] == "SIM_[red]"
    assert PreferencesFile(home / "darko" / "gcs.toml").load() == Preferences(frozenset({"SIM_[red]"}))


def told(app, words):
    """Whether a notice says this; the screen may break its lines anywhere."""
    return words in notices(app)


async def test_a_damaged_file_of_preferences_is_named_and_left_alone(feed, home):
    file = home / "darko" / "gcs.toml"
    file.parent.mkdir(exist_ok=True)
    file.write_text("favourites = 3")
    app = GroundStationApp(feed)
    async with app.run_test(size=(120, 40), notifications=True) as pilot:
        await pilot.press("p")
        await until(pilot, lambda: told(app, "favourites is not known"))
        await until(pilot, lambda: "SIM_[red]" in screen_text(app))
        await pilot.press("f4")
        await until(pilot, lambda: told(app, "Favourite not saved: "))
    assert file.read_text() == "favourites = 3"


@pytest.mark.long
async def test_a_file_is_compared_and_what_is_chosen_is_set(feed, home):
    (home / "mine.parm").write_text("DRK_KPP 2\nNAV_DLL_ACT 3\nEKF_AIDS 17\nNOT_HERE 1\n")
    app = GroundStationApp(feed)
    async with app.run_test(size=(120, 40)) as pilot:
        await opened(pilot, app)
        await pilot.press("f7")
        await shown(pilot, FileDialog)
        assert app.focused.value == "mine.parm"
        app.focused.value = "none.parm"
        await pilot.press("enter")
        await until(pilot, lambda: "none.parm: cannot be read" in screen_text(app))
        app.focused.value = "mine.parm"
        await pilot.press("enter")
        await until(pilot, lambda: isinstance(app.screen, ComparisonScreen) and "2 of 3 chosen" in screen_text(app))
        await until(pilot, lambda: "mine.parm: 3 of 4 parameters differ" in screen_text(app))
        await until(
            pilot, lambda: line_of(app, "NAV_DLL_ACT").strip("▎▌▐█▕ ").split("  ")[0].startswith("[x] NAV_DLL_ACT")
        )
        await until(pilot, lambda: "land (3)" in line_of(app, "NAV_DLL_ACT"))
        await until(pilot, lambda: "go on (0)" in line_of(app, "NAV_DLL_ACT"))
        await until(pilot, lambda: "missing" in line_of(app, "NOT_HERE"))
        await pilot.press("down")
        await pilot.press("space")
        await until(pilot, lambda: app.screen.chosen == {"DRK_KPP"})
        await pilot.press("enter")
        await until(pilot, lambda: feed.requests[-1] == ("set_parameters", {"DRK_KPP": 2.0}))
        await pilot.press("a")
        await until(pilot, lambda: app.screen.chosen == {"DRK_KPP", "NAV_DLL_ACT"})
        await pilot.press("enter")
        await until(pilot, lambda: feed.requests[-1] == ("set_parameters", {"DRK_KPP": 2.0, "NAV_DLL_ACT": 3.0}))
        feed.snapshot = snapshot_with(
            TUNED,
            parameters={
                "values": {**TUNED.parameters.values, "DRK_KPP": 2.0},
                "changes": {
                    "DRK_KPP": ParameterChange(2.0, ChangeState.SET),
                    "NAV_DLL_ACT": ParameterChange(3.0, ChangeState.REFUSED, "not today"),
                },
            },
        )
        await until(pilot, lambda: "0 of 3 chosen, 1 set, 1 refused" in screen_text(app))
        await until(pilot, lambda: "go on (0)" in line_of(app, "NAV_DLL_ACT"))  # the old value stays
        await until(pilot, lambda: "refused: not today" in line_of(app, "NAV_DLL_ACT"))
        await until(pilot, lambda: line_of(app, "DRK_KPP").split()[4:6] == ["2", "2"])
        await pilot.press("escape")
        await until(pilot, lambda: isinstance(app.screen, ParametersScreen))


async def test_a_file_that_differs_in_nothing_opens_no_list(feed, home):
    (home / "mine.parm").write_text("DRK_KPP 1.5\n")
    app = GroundStationApp(feed)
    async with app.run_test(size=(120, 40), notifications=True) as pilot:
        await opened(pilot, app)
        await pilot.press("f7")
        await shown(pilot, FileDialog)
        await pilot.press("enter")
        await until(pilot, lambda: "all 1 parameters are as on the vehicle" in screen_text(app))


@pytest.mark.long
async def test_rows_of_another_component_are_named_and_left_out(feed, home):
    (home / "mine.params").write_text("1\t1\tDRK_KPP\t1.5\t9\n1\t154\tDRK_KPP\t9\t9\n1\t154\tMNT_RATE\t9\t9\n")
    app = GroundStationApp(feed)
    async with app.run_test(size=(120, 40), notifications=True) as pilot:
        await opened(pilot, app)
        await pilot.press("f7")
        await shown(pilot, FileDialog)
        app.focused.value = "mine.params"
        await pilot.press("enter")
        await until(pilot, lambda: told(app, "left out, of other components: 2 parameters, DRK_KPP, MNT_RATE"))
        await until(pilot, lambda: told(app, "all 1 parameters are as on the vehicle"))


@pytest.mark.long(after=1)
@pytest.mark.parametrize("name", ["some.params", "some.parm"])
async def test_all_are_saved_in_the_format_of_the_files_name(feed, home, name):
    app = GroundStationApp(feed)
    async with app.run_test(size=(120, 40), notifications=True) as pilot:
        await opened(pilot, app)
        feed.snapshot = snapshot_with(TUNED, parameters={"values": {"DRK_KPP": 1.5, "NAV_DLL_ACT": 2}, "total": 2})
        await until(pilot, lambda: len(app.screen.table.keys) == 2)
        await pilot.press("f8")
        await shown(pilot, FileDialog)
        app.focused.value = name
        await pilot.press("enter")
        await until(pilot, lambda: f"{name}: 2 parameters saved" in screen_text(app))
    assert load_parameters(home / name).of((1, 1)) == {"DRK_KPP": 1.5, "NAV_DLL_ACT": 2.0}
    assert ("\t6\n" in (home / name).read_text()) == name.endswith("params")


async def test_an_incomplete_list_is_not_saved(feed):
    feed.snapshot = snapshot_with(TUNED, parameters={"total": 9})
    app = GroundStationApp(feed)
    async with app.run_test(size=(120, 40), notifications=True) as pilot:
        await opened(pilot, app)
        await pilot.press("f8")
        await until(pilot, lambda: "Not saved: 4 of 9 parameters received" in screen_text(app))
