"""The palette finds every action of every screen; the footer leaves no key out that there is room for."""

import pytest
from textual.binding import Binding

from darko_gcs.feed.replay_feed import ReplayFeed
from darko_gcs.tui.actions import ACTIONS
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.key_footer import MAX_EXTRA, KeyFooter
from darko_gcs.tui.palette import SCREENS, help_sections, holds
from darko_gcs.tui.replay_app import ReplayApp
from protocol.tlog import read_tlog
from tests.support.gcs.screens import FakeFeed, settled, until
from tests.support.gcs.snapshots import HOVERING
from tests.support.paths import DATA

FLIGHT = DATA / "square-flight.tlog"


def own_bindings(node):
    """The bindings of our own classes of a screen or an app, that are told to the pilot."""
    kinds = [kind for kind in type(node).__mro__ if not kind.__module__.startswith("textual.")]
    found = [binding for kind in kinds for binding in kind.__dict__.get("BINDINGS", ())]
    return [binding for binding in found if isinstance(binding, Binding) and (binding.description or binding.tooltip)]


def missing(app):
    """Actions of the screen and of the app that no line of the palette runs."""
    entries = app.palette_entries(app.screen)
    titles = {entry.title.split(": ", 1)[-1] for entry in entries}
    names = {str(entry.run) for entry in entries}
    wanted = [*own_bindings(app.screen), *own_bindings(app)]
    return [
        binding.action
        for binding in wanted
        if holds(app.screen, binding)
        and (binding.tooltip or binding.description) not in titles
        and not binding.action.startswith("app.")
        and not is_offered(app, binding, names)
    ]


def is_offered(app, binding, names):
    """Whether an action of the table is in the palette, or cannot be done here."""
    if not binding.action.startswith("act("):
        return False
    name = binding.action.split("'")[1]
    return not app._offers(name, app.screen) or any(repr(name) in text for text in names)


@pytest.mark.long(after=1)
@pytest.mark.parametrize("name", ["", *SCREENS])
async def test_it_finds_every_action_of_every_screen(name):
    app = GroundStationApp(FakeFeed(HOVERING))
    async with app.run_test(size=(120, 40)) as pilot:
        await until(pilot, lambda: app.screen.query(KeyFooter))
        if name:
            app.action_act(name)
            await until(pilot, lambda: isinstance(app.screen, SCREENS[name][0]))
        await settled(pilot)
        assert missing(app) == []


async def test_the_help_of_a_recording_s_charts_lists_each_key_once_with_what_it_does_there():
    app = ReplayApp(ReplayFeed(read_tlog(FLIGHT), FLIGHT.name))
    async with app.run_test(size=(120, 40)) as pilot:
        await until(pilot, lambda: app.screen.query(KeyFooter))
        app.action_act("charts")
        await until(pilot, lambda: isinstance(app.screen, SCREENS["charts"][0]))
        offered = [action for action in ACTIONS if app.check_action("act", (action.name,))]
        sections = dict(help_sections(app.screen, offered, app.extra_keys(), {}, is_live=False))
        titles = ("Keys of this screen", "Recording", "Keys")
        keys = [key for title in titles for keys, _ in sections[title] for key in keys.split()]
        twice = {key for key in keys if keys.count(key) > 1}
        assert twice == {"→"}  # with shift it seeks
        assert ("space", "Pause or play") in sections["Recording"]
        assert ("← →", "Move the cursor; a click puts it there") in sections["Keys of this screen"]


async def test_a_word_finds_what_a_recording_can_do():
    app = ReplayApp(ReplayFeed(read_tlog(FLIGHT), FLIGHT.name))
    async with app.run_test(size=(120, 40)) as pilot:
        await until(pilot, lambda: app.screen.query(KeyFooter))
        assert {"Recording: 5 s back", "Recording: 30 s on", "Recording: To the end"} <= set(found(app, "seek"))


async def test_it_finds_every_action_of_a_recording():
    app = ReplayApp(ReplayFeed(read_tlog(FLIGHT), FLIGHT.name))
    async with app.run_test(size=(120, 40)) as pilot:
        await until(pilot, lambda: app.screen.query(KeyFooter))
        assert missing(app) == []
        assert {"pause", "seek(-5)"} <= {binding.action for binding in own_bindings(app)}


@pytest.mark.long(after=1)
@pytest.mark.parametrize("name", ["", *SCREENS])
async def test_the_footer_leaves_out_no_key_that_it_has_room_for(name):
    app = GroundStationApp(FakeFeed(HOVERING))
    async with app.run_test(size=(200, 60)) as pilot:
        await until(pilot, lambda: app.screen.query(KeyFooter))
        if name:
            app.action_act(name)
            await until(pilot, lambda: isinstance(app.screen, SCREENS[name][0]))
        await settled(pilot)
        footer = app.screen.query_one(KeyFooter)
        room = footer.size.width - sum(key.width + 1 for key in footer._shown)
        left_out = [key for key in footer._rest if key not in footer._shown]
        assert all(key.width + 1 > room for key in left_out)
        shown = {key.description for key in (*footer._shown, *left_out)}
        active = {active.binding for active in app.screen.active_bindings.values()}  # of a list, some keys are its own
        short = {binding.description for binding in own_bindings(app.screen) if binding.show and binding in active}
        assert {text for text in short if 0 < len(text) <= MAX_EXTRA} <= shown


def found(app, query):
    """Titles that a query finds, best first."""
    scored = [(entry.score(query), entry.title) for entry in app.palette_entries(app.screen)]
    return [title for score, title in sorted(scored, key=lambda pair: -pair[0]) if score > 0.0]


async def test_beginnings_of_words_rank_first_and_letters_within_words_find_nothing():
    app = GroundStationApp(FakeFeed(HOVERING))
    async with app.run_test(size=(80, 24)):
        assert found(app, "arm")[0] == "Arm the vehicle"
        assert {"List the jumps from law to law", "Draw charts"} == set(found(app, "lyapunov"))
        assert found(app, "take off")[0] == "Take off to a height above home"
        assert "Take off to a height above home" in found(app, "launch")
        assert found(app, "rm") == found(app, "tkf") == []
