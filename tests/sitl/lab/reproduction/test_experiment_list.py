"""``darko-sitl study report``: the page it writes, and refused arguments."""

import json

import pytest

from sitl.__main__ import main


@pytest.mark.long
def test_the_command_writes_a_page_and_nothing_else(tmp_path, capsys):
    path = tmp_path / "page.html"
    assert main(["study", "report", "--only", "sigmoids", "-o", str(path), "--jobs", "1"]) == 0
    assert capsys.readouterr().out.strip() == str(path)
    assert list(tmp_path.iterdir()) == [path]
    assert "Gompertz" in path.read_text()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--only", "nothing"], "no experiment 'nothing': there are limits"),
        (["--jobs", "0"], "--jobs 0: at least one"),
        (["-o", "nowhere/page.html"], "there is no folder nowhere"),
    ],
)
def test_a_mistaken_command_is_a_one_line_error(arguments, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["study", "report", *arguments]) == 2
    error = capsys.readouterr().err.strip()
    assert message in error
    assert "\n" not in error


@pytest.mark.long
def test_a_page_that_cannot_be_written_leaves_no_file_behind(tmp_path, capsys):
    taken = tmp_path / "page.html"
    taken.mkdir()
    assert main(["study", "report", "--only", "sigmoids", "-o", str(taken), "--jobs", "1"]) == 2
    assert "page.html" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [taken]


# ``darko-sitl study scenario``: experiments of several runs, as text and as JSON.


@pytest.mark.long
def test_an_experiment_runs_alone_by_its_name(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["study", "scenario", "straight-or-arc"]) == 0
    assert "roll by elevon, arc over straight" in capsys.readouterr().out
    assert [path.name for path in tmp_path.iterdir()] == ["straight-or-arc-1.svg"]
    assert main(["study", "scenario", "sigmoids", "--json", "--no-plot"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert [figure["verdict"] for figure in printed["figures"]] == ["differs, cause computed"]
