"""Small dialogs, among them one for a file's path, which completes itself. Telemetry continues beneath them."""

import pytest
from textual.app import App
from textual.widgets import Input

from darko_gcs.tui.screens.dialogs import PathInput, path_matches


@pytest.fixture
def folder(tmp_path, monkeypatch):
    for name in ("alpha.plan", "alpine.plan", "alps.txt", "beta.plan", ".hidden.plan"):
        (tmp_path / name).touch()
    (tmp_path / "all").mkdir()
    (tmp_path / "all" / "inner.plan").touch()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_matches_are_folders_and_files_with_the_suffix(folder):
    assert path_matches("al", (".plan",)) == ["all/", "alpha.plan", "alpine.plan"]
    assert path_matches("alps") == ["alps.txt"]
    assert path_matches("./al", (".txt",)) == ["./all/", "./alps.txt"]
    assert path_matches(f"{folder}/all/", (".plan",)) == [f"{folder}/all/inner.plan"]


def test_hidden_files_match_only_if_asked_for(folder):
    assert folder
    assert ".hidden.plan" not in path_matches("")
    assert path_matches(".h") == [".hidden.plan"]


def test_a_folder_that_there_is_not_has_no_matches(folder):
    assert path_matches(f"{folder}/nowhere/a") == path_matches("~nobody-has-this-name/a") == []


def test_a_path_beneath_the_users_folder_stays_as_typed(folder, monkeypatch):
    monkeypatch.setenv("HOME", str(folder))
    assert path_matches("~/be") == ["~/beta.plan"]


class OneField(App):
    def compose(self):
        yield PathInput("", suffixes=(".plan",), id="path")
        yield Input(id="next")


async def test_tab_completes_as_far_as_all_matches_agree_and_then_goes_on(folder):
    assert folder
    app = OneField()
    async with app.run_test() as pilot:
        field = app.query_one(PathInput)
        await pilot.press("b", "tab")
        assert field.value == "beta.plan"
        await pilot.press("tab")
        assert app.focused.id == "next"
        field.value = "alp"
        field.focus()
        await pilot.press("end", "h", "tab")
        assert field.value == "alpha.plan"
