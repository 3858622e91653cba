"""Campaigns' files: what they draw, and what is refused in one line."""

import math
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from sitl import SitlError, load_airframe
from sitl.lab.campaigns.distributions import Distribution
from sitl.lab.campaigns.specification import draw, load_specification, shipped_campaigns, specification_of
from sitl.lab.studies.wrong_models import UNCERTAIN
from tests.support.campaigns import SMALL, small

PAGE = Path(__file__).parents[4] / "docs" / "campaigns.md"


def test_a_case_is_the_same_whatever_was_drawn_before():
    campaign = small()
    drawn = [draw(campaign, number) for number in (5, 0, 11)]
    assert [draw(campaign, number) for number in (11, 0, 5)] == drawn[::-1]
    assert draw(small(cases=1000), 11) == drawn[2]


def test_every_cell_of_the_grid_has_every_seed():
    drawn = [draw(small(), number) for number in range(12)]
    assert {(case.values["push"], case.seed) for case in drawn} == {(p, s) for p in (0.0, 2.0) for s in range(1, 7)}
    assert drawn[0].values["turn"] == drawn[1].values["turn"] != drawn[2].values["turn"]
    assert list(drawn[0].values) == ["push", "turn"]


def test_two_grids_are_all_their_pairs_the_last_changing_soonest():
    text = SMALL.replace("turn = {", "kind = { grid = [7, 8, 9] }\nturn = {")
    pairs = [(case.values["push"], case.values["kind"]) for case in (draw(small(text), k) for k in range(6))]
    assert pairs == [(0.0, 7.0), (0.0, 8.0), (0.0, 9.0), (2.0, 7.0), (2.0, 8.0), (2.0, 9.0)]


def test_a_grid_along_another_makes_rows_not_pairs():
    text = SMALL.replace("turn = {", 'kind = { grid = ["slow", "fast"], along = "push" }\nturn = {')
    pairs = [(case.values["push"], case.values["kind"]) for case in (draw(small(text), k) for k in range(4))]
    assert pairs == [(0.0, "slow"), (2.0, "fast")] * 2
    assert small(text).cells == 2


def test_streams_are_other_generators_of_the_same_seed():
    """A stream of the run may have values of grids; one of a quantity leaves the others as they were."""
    streamed = small(SMALL.replace("chunk = 3", 'stream = [7, "10 * push"]'))
    random = np.random.default_rng((2, 7, 20))
    assert draw(streamed, 3).values["turn"] == random.uniform(0.0, math.tau)
    own = small(SMALL.replace("turn = {", "gust = { uniform = [0, 1], stream = 33 }\nturn = {"))
    assert draw(own, 3).values["gust"] == np.random.default_rng((2, 33)).uniform()
    assert draw(own, 3).values["turn"] == draw(small(), 3).values["turn"]


def test_a_file_has_what_its_base_has_and_its_own_keys_in_place_of_those():
    own = {"base": "falls", "parameters": {"SIM_WIND_SPD": 2.0}, "run": {"cases": 7}}
    campaign, base = specification_of(Path("mine.toml"), own, {}), load_specification("falls")
    winds = [one.flight.parameters["SIM_WIND_SPD"] for one in (campaign, base)]
    assert (campaign.cases, winds) == (7, [2.0, 5.0])
    assert (campaign.measures, campaign.flight.orders) == (base.measures, base.flight.orders)
    assert load_specification("falls-calm").flight.home.radius == 1.0
    with pytest.raises(SitlError, match=r"mine.toml: base = 'fall' must be another of delays, failures"):
        specification_of(Path("mine.toml"), {"base": "fall"}, {})


def test_what_is_derived_is_of_what_is_drawn_and_of_the_seed():
    derived = '[derived]\ntwice = "2 * push"\nodd = "seed % 2 + twice"\nfixed = 3\n[vehicle]'
    values = draw(small(SMALL.replace("[vehicle]", derived)), 1).values
    assert (values["twice"], values["odd"], values["fixed"]) == (4.0, 5.0, 3.0)


def test_values_are_set_by_their_place_in_the_file():
    changes = {"vary.push.grid": [5.0], "vehicle.controller": "indi", "parameters.SIM_WIND_SPD": 3}
    campaign = specification_of(Path("small.toml"), tomllib.loads(SMALL), changes)
    assert draw(campaign, 1).values["push"] == 5.0
    assert (campaign.flight.vehicle.controller, campaign.flight.parameters) == ("indi", {"SIM_WIND_SPD": 3.0})
    assert campaign.identity != small().identity
    with pytest.raises(SitlError, match=r"run.cases.most cannot be set: cases is no table"):
        specification_of(Path("small.toml"), tomllib.loads(SMALL), {"run.cases.most": 1})


def test_the_airframe_differs_from_the_model_in_the_constants_that_are_named():
    case = draw(small(SMALL.replace("relative = 0.1", "relative = 0.1, of = ['m'], intervals.C_90 = [1.5, 1.6]")), 0)
    model = load_airframe("nominal").parameters
    airframe = case.airframe(model)
    changed = {name for name in model._fields if getattr(model, name) != getattr(airframe, name)}
    assert changed == {"m", "C_90"}
    assert 1.5 <= airframe.C_90 <= 1.6
    assert abs(airframe.m / model.m - 1.0) <= 0.1
    assert list(draw(small(), 0).factors) == list(UNCERTAIN)


def test_a_hypercube_has_one_value_in_every_part():
    campaign = small(sampling="latin-hypercube", block=20, cases=80)
    turns = np.array([draw(campaign, number).values["turn"] for number in range(0, 80, 2)]) / math.tau
    masses = np.array([draw(campaign, number).factors["m"] for number in range(0, 80, 2)])
    for block in (slice(0, 20), slice(20, 40)):
        assert sorted((turns[block] * 20).astype(int)) == list(range(20))
        assert sorted(((masses[block] - 0.9) / 0.2 * 20).astype(int)) == list(range(20))
    assert len(set(turns)) == 40


@pytest.mark.parametrize(
    ("distribution", "low", "middle", "high"),
    [
        (Distribution("uniform", (2.0, 4.0)), 2.0, 3.0, 4.0),
        (Distribution("normal", (1.0, 2.0)), -math.inf, 1.0, math.inf),
        (Distribution("normal", (1.0, 2.0), (0.0, 2.0)), 0.0, 1.0, 2.0),
        (Distribution("log_uniform", (1.0, 100.0)), 1.0, 10.0, 100.0),
        (Distribution("triangular", (0.0, 1.0, 2.0)), 0.0, 1.0, 2.0),
        (Distribution("choice", (1.0, 2.0, "three")), 1.0, 2.0, "three"),
    ],
)
def test_distributions_by_their_share_of_the_probability(distribution, low, middle, high):
    assert [distribution.at(share) for share in (0.0, 0.5, 1.0)] == pytest.approx([low, middle, high])


@pytest.mark.parametrize(
    "distribution",
    [
        Distribution("uniform", (2.0, 4.0)),
        Distribution("normal", (1.0, 2.0)),
        Distribution("triangular", (0.0, 0.5, 2.0)),
        Distribution("log_uniform", (1.0, 100.0)),
    ],
)
def test_a_generator_draws_the_same_distribution(distribution):
    random = np.random.default_rng(1)
    drawn = [distribution.drawn(random) for _ in range(4000)]
    shares = [np.mean(np.array(drawn) < distribution.at(share)) for share in (0.1, 0.5, 0.9)]
    assert shares == pytest.approx([0.1, 0.5, 0.9], abs=0.03)


@pytest.mark.parametrize("name", shipped_campaigns())
def test_a_shipped_campaign_is_read_and_says_what_it_is(name):
    campaign = load_specification(name)
    assert campaign.about
    assert draw(campaign, 0).seed == 1


REFUSED = [
    ("cases = 12", "cases = 0", "small.toml: run.cases = 0 is not within 1 and 1e+07"),
    ("cases = 12", "casses = 12", "run.casses is not known; did you mean 'cases'?"),
    ("chunk = 3", "chunk = 2.5", "run.chunk = 2.5 is not a whole number"),
    ("chunk = 3", 'worst = ["speed"]', "run.worst must be some of reached, stayed"),
    ("chunk = 3", 'until = { measure = "far", width = 1 }', "run.until.measure = 'far' must be one of reached, stayed"),
    ('[0.0, "2 * pi"]', '[0.0, "2 * tau"]', "there is no tau"),
    ('[0.0, "2 * pi"]', "[1.0, 0.0]", "vary.turn.uniform = [1.0, 0.0] must ascend"),
    ("uniform = ", "unifrom = ", "vary.turn.unifrom is not known; did you mean 'uniform'?"),
    ("relative = 0.1", 'relative = 0.1, of = ["mass"]', "names 'mass', which is no constant of an airframe"),
    ('"push * cos(turn)"', '"push * cos(torn)"', "there is no torn; did you mean turn?"),
    ('"push * cos(turn)"', '"push.real"', "push.real is not a number, a name or a known function"),
    ('do = "throw"', 'do = "land"', "order[0].velocity is not known"),
    ('do = "throw"', 'do = "jump"', "order[0].do = 'jump' must be one of go to, leg"),
    ("seconds = 0.2", "", "flight.seconds is missing"),
    ("seconds = 0.2", 'seconds = 0.2\nuntil = ["home"]', "flight.home and until"),
    ("seconds = 0.2", 'seconds = 0.2\nuntil = ["dusk"]', "flight.until must be some of mission, ground, crash, home"),
    ("position[0]", "height", "DARKO_TRUTH.height is not recorded, but position, velocity, q, rates"),
    ("position[0]", "position[7]", "DARKO_TRUTH.position has the numbers [0] to [2]"),
    ("DARKO_TRUTH.position[0]", "DARKO_TRUHT.position[0]", "there is no DARKO_TRUHT; did you mean DARKO_TRUTH?"),
    ("stayed =", "time =", "time is the name of something else"),
    ('"reached < 0.1"', '"reach < 0.1"', "stayed: there is no reach; did you mean reached?"),
    ('"reached < 0.1"', '"rms(reached) < 0.1"', "there is no function rms of numbers"),
    ("autopilot = false", "autopilot = false\nautpilot = 1", "vehicle.autpilot is not known"),
    ("autopilot = false", 'controller = "push"', "vehicle.controller = 0.0 must be one of hybrid, report, indi"),
    (
        "turn = {",
        'kind = { grid = [1], along = "push" }\nturn = {',
        "vary.kind.along = 'push' must be a grid of 1",
    ),
    ("turn = {", 'kind = { choice = [1], along = "push" }\nturn = {', "vary.kind.along is of grids"),
    ("chunk = 3", 'stream = ["turn"]', "run.stream = 'turn': there is no turn; there are push"),
    ("seconds = 0.2", 'seconds = 0.2\nuntil = ["lost > 3"]', "there is no lost"),
    (
        "[vehicle]",
        "[derived]\nfast = 'pish > 1'\n[vehicle]",
        "derived.fast = 'pish > 1': there is no pish",
    ),
    ("[vehicle]", "[derived]\npush = '1'\n[vehicle]", "push is the name of something else"),
    ("position[0]", "position[0] + from_way(1, 2)", "from_way takes 3 numbers for each point"),
    ("seconds = 0.2", "seconds = 0.2\nrate = 60", "flight.rate = 60 does not divide 500"),
    ('do = "throw"', 'do = "throw"\nif = "push"', "order[0].if = 'push' is not a condition"),
    ('do = "throw"', 'do = "throw"\nwhen = "5"', "order[0].when = '5' is not a condition"),
    ('do = "throw"', 'do = "throw"\nwhen = "DARKO_TRUTH.place[0] > 5"', "DARKO_TRUTH.place is not recorded"),
    ('do = "throw"', 'do = "throw"\nname = "push"', "push is the name of something else"),
    (
        "[measures]",
        "[table]\ncolumns = ['mean far']\n[measures]",
        "there is no measure 'far'; there are reached",
    ),
    ("[measures]", "[table]\ncolumns = ['mode reached']\n[measures]", "'mode' must be one of median, mean, least"),
    ("[measures]", "[table]\ncolumns = ['share reached']\n[measures]", "but reached is not true or false"),
    ("[measures]", "[table]\nrows = ['turn']\ncolumns = []\n[measures]", "table.rows must be some of push"),
    ("autopilot = false", 'controller = "pid"', "vehicle.controller = 'pid' must be one of hybrid, report, indi"),
]


@pytest.mark.parametrize(("given", "instead", "words"), REFUSED)
def test_what_is_wrong_is_refused_in_one_line(given, instead, words):
    assert given in SMALL
    with pytest.raises(SitlError, match=re.escape(words)) as error:
        small(SMALL.replace(given, instead))
    assert "\n" not in str(error.value)


def test_the_file_that_the_page_shows_is_read():
    page = PAGE.read_text(encoding="utf-8")
    campaign = small(page.split("```toml\n")[1].split("```")[0])
    assert (campaign.cells, campaign.early_end.measure, campaign.airframe_draw.size) == (3, "held", 3)
    assert 0.8 <= draw(campaign, 7).constants["C_90"] <= 1.2


def test_a_campaign_that_is_not_shipped_is_refused():
    with pytest.raises(SitlError, match="there is no campaign 'hold'; there are delays, failures, fall-heights"):
        load_specification("hold")
    with pytest.raises(SitlError, match=r"none.toml: cannot be read"):
        load_specification("none.toml")
