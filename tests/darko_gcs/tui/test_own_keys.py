"""The pilot's own keys: a file of them, whose bad entries are told in one line and whose others hold."""

import pytest
from textual.binding import Binding

from darko_gcs.preferences import KEYS_FILE, PreferencesFile
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.own_keys import named_keys, own_keys
from darko_gcs.tui.palette import screen_bindings
from darko_gcs.tui.screens.mission_screen import MissionScreen
from tests.support.gcs.screens import FakeFeed, notices, screen_text, until
from tests.support.gcs.snapshots import HOVERING

USUAL = [
    Binding("a", "arm", "Arm", id="arm"),
    Binding("d", "disarm", "Disarm", id="disarm"),
    *named_keys("mission", [Binding("u", "upload", "Upload"), Binding("shift+up", "move", "Move up")]),
]


def read(tmp_path, text):
    path = tmp_path / KEYS_FILE
    path.write_text(text, encoding="utf-8")
    return own_keys(path, USUAL)


def test_keys_are_of_actions_and_of_screens_and_may_change_places(tmp_path):
    keys, problems = read(tmp_path, 'arm = "d"\ndisarm = "a"\n[mission]\nupload = "f9"\nmove-up = "ctrl+shift+up"\n')
    assert keys == {"arm": "d", "disarm": "a", "mission.upload": "f9", "mission.move-up": "ctrl+shift+up"}
    assert problems == ()


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ('armm = "b"', "armm: there is no such action"), ("disarm = 3", "disarm: its key is not a text"),
        ('disarm = "hyper"', "disarm: there is no key 'hyper'"), ('disarm = "a"', "disarm: a is the key of arm"),
        ('disarm = "ctrl+q"', "disarm: ctrl+q keeps its meaning"),
        ('[arm2]\nx = "b"', "arm2.x: there is no such action"),
        ('[mission]\nupload = "shift+up"', "mission.upload: shift+up is the key of mission.move-up"),
    ],
)  # fmt: skip
def test_a_bad_entry_is_told_and_the_others_hold(tmp_path, entry, words):
    keys, (problem,) = read(tmp_path, f'"mission.move-up" = "f7"\n{entry}\n' if "mission" not in entry else entry)
    assert problem == f"{tmp_path / KEYS_FILE}: {words}"
    assert keys == ({} if "mission" in entry else {"mission.move-up": "f7"})


def test_a_file_that_is_no_toml_is_told_and_none_is_no_fault(tmp_path):
    keys, (problem,) = read(tmp_path, "arm =")
    assert (keys, "not TOML" in problem) == ({}, True)
    assert own_keys(tmp_path / "none.toml", USUAL) == ({}, ())


def test_every_key_of_the_screens_has_a_name_of_its_own():
    named = {(binding.id, binding.key) for binding in screen_bindings() if binding.description}
    names = [name for name, _ in named]
    assert None not in names
    assert len(set(names)) == len(names)


async def test_an_own_key_works_is_shown_and_the_usual_one_does_nothing(tmp_path):
    (tmp_path / KEYS_FILE).write_text('mission = "f9"\nhold = "J"\nnothing = "b"\n[mission2]\n', encoding="utf-8")
    feed = FakeFeed(HOVERING)
    app = GroundStationApp(feed, PreferencesFile(tmp_path / "gcs.toml"))
    async with app.run_test(size=(200, 60), notifications=True) as pilot:
        await until(pilot, lambda: "nothing: there is no such action" in " ".join(notices(app).split()))
        await until(pilot, lambda: "J Hold" in screen_text(app))
        await pilot.press("m", "f9")
        await until(pilot, lambda: isinstance(app.screen, MissionScreen))
        entries = {entry.title: entry.help for entry in app.palette_entries(app.screen)}
        assert entries["Show the mission"].startswith("Key f9")
