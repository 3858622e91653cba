"""Policies: our controllers' scores, the shipped one, its file, its training, and logs of flights."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")

from protocol.flight_log.flight_series import flight_series  # noqa: E402
from protocol.tlog import read_tlog  # noqa: E402
from sitl import SitlError  # noqa: E402
from sitl.__main__ import main  # noqa: E402
from sitl.gym.environments import DarkoEnv  # noqa: E402
from sitl.gym.episode_log import EpisodeLog  # noqa: E402
from sitl.gym.flight_batch import BatchOptions, FlightBatch  # noqa: E402
from sitl.gym.policies import compared, fly_episodes, load_policy, policy_text, score_lines, shipped_policies  # noqa: E402
from sitl.gym.rewards import OBSERVED  # noqa: E402

ROOT = Path(__file__).parents[3]


@pytest.mark.long
def test_our_controllers_and_the_shipped_policy_hold_a_place_that_nothing_loses():
    found = compared("Hover", range(900, 910), shipped_policies())
    assert not any(found[name].lost.any() for name in ("hybrid", "report", "indi", "hover"))
    assert found["zero"].lost.all()
    assert min(found[name].mean for name in ("hybrid", "report", "indi", "hover")) > 2.0 * found["zero"].mean
    assert found["hover"].off.max() < 1.2
    assert len(score_lines("Hover", found)) == 5


@pytest.mark.long(after=1)
@pytest.mark.parametrize("task", ["Transition", "Leg", "Fall", "Gust"])
def test_the_hybrid_controller_loses_no_episode(task):
    batch = FlightBatch(task, 5, BatchOptions(actions="reference"))
    found = fly_episodes(batch, range(1, 6), lambda seen: np.zeros((len(seen), 4)))
    assert not found.lost.any()
    assert found.off.max() < {"Gust": 6.0, "Fall": 9.0}.get(task, 3.0)


def test_a_policy_is_the_same_after_its_file(tmp_path):
    policy = shipped_policies()["hover"]
    (tmp_path / "own.json").write_text(policy_text(policy))
    again = load_policy(tmp_path / "own.json")
    seen = np.linspace(-1.0, 1.0, 2 * OBSERVED, dtype=np.float32).reshape(2, OBSERVED)
    assert np.array_equal(again.act(seen), policy.act(seen))
    assert again.curve == policy.curve
    assert policy.curve[-1] > policy.curve[0]


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"weights": [[1.0]]}, "weights must be 4 x 22 finite numbers"),
        ({"offset": "none"}, "no policy"),
        ({"curve": None}, "no policy"),
        (None, "no policy"),
    ],
)
def test_a_file_that_is_no_policy_is_refused_by_its_name(tmp_path, change, text):
    kept = json.loads(policy_text(shipped_policies()["hover"]))
    path = tmp_path / "bad.json"
    path.write_text("{" if change is None else json.dumps(kept | change))
    with pytest.raises(SitlError, match=f"bad.json: {text}"):
        load_policy(path)
    with pytest.raises(SitlError, match=r"none.json: No such file"):
        load_policy(tmp_path / "none.json")


@pytest.mark.long
def test_a_flown_policy_leaves_a_log_of_its_flight(tmp_path, capsys):
    log = tmp_path / "flight.tlog"
    assert main(["gym", "fly", "hover", "--log", str(log), "--seed", "4"]) == 0
    assert "ended after 10.0 s" in capsys.readouterr().out
    series = flight_series(read_tlog(log), "flight")
    assert series.position.times[-1] - series.position.times[0] == pytest.approx(10.0, abs=0.5)
    heights = -series.position.fields["z"]  # NED
    assert np.abs(heights - 50.0).max() < 5.0
    assert abs(heights[-1] - 50.0) < 1.5


def test_every_episode_of_a_wrapped_environment_has_its_log(tmp_path):
    env = EpisodeLog(DarkoEnv("Hover"), tmp_path)
    for seed in (1, 2):
        env.reset(seed=seed)
        for _ in range(30):
            env.step(np.zeros(4))
    env.close()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["episode-1.tlog", "episode-2.tlog"]
    series = flight_series(read_tlog(tmp_path / "episode-2.tlog"), "flight")
    assert len(series.position) > 3
    with pytest.raises(SitlError, match="there is no such folder"):
        EpisodeLog(DarkoEnv("Hover"), tmp_path / "none")


@pytest.mark.long
def test_training_again_gives_the_same_policy(tmp_path):
    for name in ("a", "b"):
        command = [sys.executable, "scripts/train_reference.py", "--iterations", "2", "--test-episodes", "2"]
        subprocess.run([*command, "--out", str(tmp_path / name)], cwd=ROOT, check=True, capture_output=True)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    assert len(load_policy(tmp_path / "a").curve) == 2
