"""Environments for agents: gymnasium's checks, one and many to the bit, seeds, endings, options."""

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")

from gymnasium.utils.env_checker import check_env  # noqa: E402 - where it is installed

import sitl.gym  # noqa: E402
from sitl import SitlError  # noqa: E402
from sitl.gym.environments import DarkoEnv, DarkoVectorEnv  # noqa: E402
from sitl.gym.flight_tasks import TASKS  # noqa: E402

STEPS = 12


def flown(env, steps=STEPS, seed=5):
    """Observations, rewards and endings of a vector under random actions."""
    env.action_space.seed(1)
    seen = [env.reset(seed=seed)[0]]
    rest = []
    for _ in range(steps):
        observation, *end, _ = env.step(env.action_space.sample())
        seen.append(observation)
        rest.append(np.stack(end))
    env.close()
    return np.stack(seen), np.stack(rest)


@pytest.mark.parametrize("task", TASKS)
def test_gymnasium_finds_nothing_wrong(task):
    check_env(gymnasium.make(f"{sitl.gym.NAMESPACE}/{task}-v0").unwrapped)


@pytest.mark.parametrize(
    ("task", "options"),
    [
        ("Hover", {"vary": {"m": (0.9, 1.1), "wind": (0.0, 3.0), "gusts": (0.0, 1.0)}}),
        ("Gust", {"actions": "rates"}),
        ("Fall", {"actions": "virtual"}),
        ("Gust", {"observe": "sensors"}),
        ("Leg", {"actions": "reference"}),
        ("Transition", {"actions": "reference", "controller": "indi", "observe": "sensors"}),
    ],
)
def test_a_vector_flies_the_bits_of_single_environments_through_their_resets(task, options):
    name = f"{sitl.gym.NAMESPACE}/{task}-v0"
    many = gymnasium.make_vec(name, num_envs=3, max_episode_steps=5, **options)
    assert isinstance(many, DarkoVectorEnv)
    alone = gymnasium.make_vec(name, num_envs=3, vectorization_mode="sync", max_episode_steps=5, **options)
    for ours, theirs in zip(flown(many), flown(alone), strict=True):
        assert np.array_equal(ours, theirs)
    assert many.metadata["autoreset_mode"] is gymnasium.vector.AutoresetMode.NEXT_STEP


def test_the_number_of_threads_changes_no_bit():
    one, three = (flown(DarkoVectorEnv(5, "Gust", threads=threads)) for threads in (1, 3))
    assert all(np.array_equal(*pair) for pair in zip(one, three, strict=True))


def test_a_seed_is_one_episode_and_the_next_is_another():
    env = DarkoEnv("Hover")
    first, _ = env.reset(seed=3)
    second, _ = env.reset()
    again, _ = env.reset(seed=3)
    assert np.array_equal(first, again)
    assert not np.array_equal(first, second)


def test_leaving_the_bounds_terminates_and_the_time_limit_truncates():
    env = DarkoVectorEnv(2, "Hover", max_episode_steps=4)
    env.reset(seed=1)
    env.batch.fleet.flights["plant"]["body"]["position"]["x"][0] = 11.0
    _, rewards, terminated, truncated, _ = env.step(np.zeros((2, 4)))
    assert terminated.tolist() == [True, False]
    assert not truncated.any()
    assert (rewards > 0.0).all()
    observations, rewards, *ends, _ = env.step(np.zeros((2, 4)))
    assert rewards[0] == 0.0
    assert rewards[1] > 0.0
    assert not np.any(ends)
    assert np.abs(observations[0, :3]).max() < 0.5  # it begins anew
    ends = [env.step(np.zeros((2, 4)))[2:4] for _ in range(2)]
    assert ends[1][1].tolist() == [False, True]


def test_what_is_not_finite_is_lost_and_observed_within_the_bounds():
    env = DarkoVectorEnv(2, "Hover")
    env.reset(seed=1)
    env.batch.fleet.flights["plant"]["body"]["velocity"]["x"][0] = np.nan
    observations, rewards, terminated, _, _ = env.step(np.zeros((2, 4)))
    assert terminated.tolist() == [True, False]
    assert rewards[0] == 0.0
    assert observations in env.observation_space


def test_the_ground_ends_a_fall():
    env = DarkoEnv("Fall")
    env.reset(seed=1)
    env.batch.fleet.flights["plant"]["body"]["position"]["z"] = 0.5
    assert env.step(np.zeros(4))[2]


def test_more_thrust_climbs_and_an_elevon_turns():
    moved = []
    for action in ([1.0, 1.0, 0.0, 0.0], [-1.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.5, 0.5]):
        env = DarkoEnv("Transition")
        env.reset(seed=1)
        for _ in range(10):
            env.step(np.array(action))
        body = env.batch.fleet.flights["plant"]["body"]
        moved.append((float(body["velocity"]["z"][0]), float(body["rates"]["y"][0])))
    assert moved[0][0] > moved[2][0] > moved[1][0]
    assert abs(moved[2][1]) > 0.5


def test_a_body_rate_that_is_asked_for_is_flown():
    env = DarkoEnv("Transition", actions="rates")
    env.reset(seed=1)
    for _ in range(15):
        env.step(np.array([0.2, 0.0, 0.0, 0.0]))
    assert float(env.batch.fleet.flights["plant"]["body"]["rates"]["x"][0]) == pytest.approx(1.2, abs=0.4)


def test_airframe_and_weather_are_varied_within_their_intervals():
    env = DarkoVectorEnv(40, "Hover", vary={"m": (0.9, 1.1), "wind": (1.0, 3.0), "gusts": (0.2, 0.4)})
    env.reset(seed=1)
    factors = env.batch.fleet.airframes["m"] / env.batch.airframe.m
    wind, gusts = env.batch.fleet.airs["wind"], env.batch.fleet.airs["gust_rms"]
    speed = np.hypot(wind["x"], wind["y"])
    for values, low, high in ((factors, 0.9, 1.1), (speed, 1.0, 3.0), (gusts, 0.2, 0.4)):
        assert (values >= low - 1e-9).all()
        assert (values <= high + 1e-9).all()
        assert values.max() - values.min() > 0.7 * (high - low)
    assert len(set(env.batch.fleet.airframes["k_f"])) == 1


def test_a_campaign_s_specification_varies_airframe_and_weather(tmp_path):
    """Wind from the east at 1 to 3 m/s: it blows to the west."""
    spec = tmp_path / "mine.toml"
    spec.write_text(
        "[run]\ncases = 8\n[vary]\nwind = { uniform = [1.0, 3.0] }\n"
        'airframe = { relative = 0.1, of = ["m"] }\n'
        '[parameters]\nSIM_WIND_SPD = "wind"\nSIM_WIND_DIR = 90.0\nSIM_GUST_RMS = "wind / 10"\n'
        '[flight]\nseconds = 5.0\n[measures]\nlong = "time"\n'
    )
    env = DarkoVectorEnv(40, "Hover", vary=str(spec))
    env.reset(seed=1)
    fleet, model = env.batch.fleet, env.batch.airframe
    wind, gusts = fleet.airs["wind"], fleet.airs["gust_rms"]
    assert np.abs(wind["x"]).max() < 1e-12
    assert gusts == pytest.approx(wind["y"] / 10.0)
    assert 1.0 <= wind["y"].min() < 1.3
    assert 2.7 < wind["y"].max() <= 3.0
    factors = fleet.airframes["m"] / model.m
    assert 0.9 <= factors.min() < 0.95
    assert 1.05 < factors.max() <= 1.1
    assert set(fleet.airframes["k_f"]) == {model.k_f}
    again = DarkoEnv("Hover", vary=str(spec))
    again.reset(seed=4)
    assert again.batch.fleet.airs["wind"]["y"][0] == wind["y"][3]


def test_a_campaign_that_cannot_vary_an_episode_is_refused(tmp_path):
    spec = tmp_path / "gusty.toml"
    spec.write_text(
        "[run]\ncases = 8\n[vary]\nwind = { uniform = [1.0, 3.0] }\n"
        '[parameters]\nSIM_WIND_SPD = "wind + t / 100"\n[flight]\nseconds = 5.0\n[measures]\nlong = "time"\n'
    )
    with pytest.raises(SitlError, match=r"SIM_WIND_SPD = 'wind . t / 100' changes within a flight"):
        DarkoEnv("Hover", vary=str(spec))
    with pytest.raises(SitlError, match="nowhere"):
        DarkoEnv("Hover", vary="nowhere.toml")


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"task": "Sleep"}, "task 'Sleep': there is Hover"),
        ({"actions": "wishes"}, "actions 'wishes': there is actuators"),
        ({"observe": "all"}, "observe 'all': there is truth, sensors"),
        ({"periods": 3}, "periods 3: must divide 200"),
        ({"threads": 0}, "1 environments by 0 threads"),
        ({"colour": 1}, "option 'colour': there is observe"),
        ({"controller": "bird"}, "controller 'bird': there is hybrid"),
        ({"vary": {"beauty": (0.0, 1.0)}}, "variation of 'beauty': there is wind, gusts, m"),
        ({"vary": {"actuator_model": (1.0, 1.0)}}, "variation of 'actuator_model'"),
        ({"vary": {"m": (1.1, 0.9)}}, "variation of m: 1.1 to 0.9 is no interval within 0.1 and 10"),
        ({"vary": {"m": 1.0}}, "variation of m: 1.0 is no interval"),
        ({"render_mode": "human"}, "render_mode 'human': there is rgb_array"),
    ],
)
def test_a_wrong_option_is_told_in_a_line(options, text):
    with pytest.raises(SitlError, match=text.replace("(", r"\(")):
        DarkoEnv(**options)


@pytest.mark.parametrize("actions", [np.zeros(3), np.array([0.0, 0.0, np.nan, 0.0])])
def test_actions_that_are_none_are_refused(actions):
    env = DarkoEnv()
    env.reset(seed=1)
    with pytest.raises(SitlError, match="1 rows of 4 finite numbers"):
        env.step(actions)


def test_sensors_see_about_what_is_true():
    true, sensed = DarkoEnv("Hover"), DarkoEnv("Hover", observe="sensors")
    seen = [env.reset(seed=2)[0] for env in (true, sensed)]
    assert not np.array_equal(*seen)
    assert np.abs(seen[0][:12] - seen[1][:12]).max() < 0.3


def test_a_picture_shows_the_track_and_the_place():
    env = DarkoEnv("Hover", render_mode="rgb_array")
    env.reset(seed=1)
    before = env.render()
    for _ in range(20):
        env.step(np.array([1.0, 1.0, 0.0, 0.0]))
    after = env.render()
    assert before.shape == after.shape == (240, 480, 3)
    tracks = [np.count_nonzero((picture == (60, 130, 200)).all(axis=2)) for picture in (before, after)]
    assert tracks[1] > tracks[0]
    assert (after == (210, 70, 50)).all(axis=2).any()
