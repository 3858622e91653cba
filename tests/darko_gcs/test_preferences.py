"""The operator's preferences: kept, read strictly, never overwritten when they cannot be read."""

import pytest

from darko_gcs.preferences import Preferences, PreferencesFile
from protocol.errors import FileError

SOME = Preferences(
    favourite_parameters=frozenset({"DRK_KPP", 'odd "name"'}), hidden_panels=frozenset({"truth"}), theme="gruvbox"
)


def test_without_a_file_the_defaults_hold(tmp_path):
    assert PreferencesFile(tmp_path / "none" / "gcs.toml").load() == Preferences()


def test_what_is_saved_is_read_again_and_stands_in_the_users_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    kept = PreferencesFile()
    kept.save(SOME)
    assert kept.load() == SOME
    assert kept.path == tmp_path / "darko" / "gcs.toml"
    assert PreferencesFile().load() == SOME


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"favourite_parameters = [", "not TOML"),
        (b"\xff", "not TOML"),
        (b"favourite_parameters = 'A'", "favourite_parameters is not a list of names"),
        (b"favourite_parameters = ['A', 1]", "favourite_parameters is not a list of names"),
        (b"hidden_panels = 'truth'", "hidden_panels is not a list of names"),
        (b"theme = 3", "theme is not a name"),
        (b"colour = 'red'", "colour is not known: there is favourite_parameters"),
        (b"#" * 70_000, "longer than 65536 bytes"),
    ],
)
def test_a_file_with_an_error_is_named_and_not_overwritten(tmp_path, data, words):
    file = tmp_path / "gcs.toml"
    file.write_bytes(data)
    for use in (PreferencesFile(file).load, lambda: PreferencesFile(file).save(SOME)):
        with pytest.raises(FileError) as told:
            use()
        assert str(told.value).startswith(f"{file}: ")
        assert words in str(told.value)
    assert file.read_bytes() == data


def test_a_folder_that_cannot_be_made_is_told(tmp_path):
    (tmp_path / "darko").write_text("")
    with pytest.raises(FileError, match="cannot be"):
        PreferencesFile(tmp_path / "darko" / "gcs.toml").save(SOME)
