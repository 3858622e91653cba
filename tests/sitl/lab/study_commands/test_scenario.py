"""``darko-sitl study scenario``: experiments of several runs, as text and as JSON."""

import json

from sitl.__main__ import main


def test_an_experiment_runs_alone_by_its_name(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["study", "scenario", "straight-or-arc"]) == 0
    assert "roll by elevon, arc over straight" in capsys.readouterr().out
    assert [path.name for path in tmp_path.iterdir()] == ["straight-or-arc-1.svg"]
    assert main(["study", "scenario", "sigmoids", "--json", "--no-plot"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert [figure["verdict"] for figure in printed["figures"]] == ["differs, cause computed"]
