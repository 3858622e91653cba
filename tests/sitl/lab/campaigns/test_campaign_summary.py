"""Results of campaigns: intervals, worst cases, shares of the variance, the table, the page."""

import io
import json
import math

import numpy as np
import pytest

from sitl.lab.campaigns.campaign_page import campaign_page
from sitl.lab.campaigns.campaign_run import CampaignResult
from sitl.lab.campaigns.campaign_summary import (
    influences,
    mean_bounds,
    parquet_table,
    passed,
    quantities,
    summary_lines,
    worst_of,
)
from sitl.lab.campaigns.case_flights import FlownCase
from sitl.lab.campaigns.specification import draw
from tests.support.campaigns import SMALL, small

REQUIRED = SMALL + "\n[require]\nstayed = 0.9\n"


def result(text=REQUIRED, count=40, **run):
    """Of which the first value is the push, and the last case failed."""
    campaign = small(text, **{"cases": count, "worst": ["reached", "-reached"], **run})
    pushes = [draw(campaign, number).values["push"] for number in range(count)]
    flown = [FlownCase(number, "time", "", (push + number / 1000, 1.0)) for number, push in enumerate(pushes)]
    flown[-1] = FlownCase(count - 1, "error", "lost", (math.nan, math.nan))
    return CampaignResult(campaign, flown, ended_early=False)


def drawn_of(found):
    return quantities(found.specification, (one.number for one in found.flown))


def test_words_and_numbers_are_columns_of_their_own():
    campaign = small(SMALL.replace("[vary]", '[vary]\nwho = { choice = ["hybrid", 2.0] }'), cases=30)
    drawn = quantities(campaign, range(30))
    assert set(drawn["who"]) == {"hybrid", "2.0"}
    assert drawn["push"][:4].tolist() == [0.0, 2.0, 0.0, 2.0]
    assert drawn["airframe.m"][7] == draw(campaign, 7).factors["m"]


def test_the_interval_of_a_mean_is_that_of_the_normal_distribution_for_many_and_near_it_for_few():
    values = np.random.default_rng(1).normal(5.0, 2.0, 400)
    half = 1.96 * values.std(ddof=1) / 20.0
    assert mean_bounds(values) == pytest.approx((values.mean() - half, values.mean() + half), abs=0.05)
    many = np.tile(values, 60)
    half = 1.96 * many.std(ddof=1) / math.sqrt(len(many))
    assert mean_bounds(many) == pytest.approx((many.mean() - half, many.mean() + half))
    assert mean_bounds(np.array([3.0, 3.0])) == (3.0, 3.0)
    assert all(map(math.isnan, mean_bounds(np.array([]))))


def test_shares_of_the_variance_are_those_of_a_known_function():
    """Of x + 2 y + 3 (word): variances 1/12, 4/12, and 9/4 of a fair coin."""
    random = np.random.default_rng(2)
    x, y, idle = random.uniform(size=(3, 4000))
    word = random.choice(["a", "b"], 4000)
    values = x + 2.0 * y + 3.0 * (word == "b")
    total = 1 / 12 + 4 / 12 + 9 / 4
    found = {one.name: one.share for one in influences({"x": x, "y": y, "idle": idle, "word": word.tolist()}, values)}
    assert list(found)[:2] == ["word", "y"]
    assert found["word"] == pytest.approx(9 / 4 / total, abs=0.02)
    assert found["y"] == pytest.approx(4 / 12 / total, abs=0.03)
    assert "idle" not in found


def test_chance_alone_names_nothing_most_times():
    random = np.random.default_rng(3)
    named = [
        influences({str(k): random.uniform(size=100) for k in range(30)}, random.normal(size=100)) for _ in range(40)
    ]
    assert sum(map(bool, named)) <= 5
    assert influences({"x": [1.0, 2.0, 3.0]}, [1.0, math.nan, 2.0]) == []
    assert influences({"x": [1.0, 2.0, 3.0]}, [1.0, 1.0, 1.0]) == []


def test_the_worst_cases_come_with_their_command():
    lines = summary_lines(result(), drawn_of(result()), "darko-sitl campaign small.toml")
    assert worst_of(result(), "reached")[0] == (37, pytest.approx(2.037))
    assert worst_of(result(), "-reached")[0] == (0, 0.0)
    assert "worst reached 2.037: darko-sitl campaign small.toml --case 37" in lines
    assert "error: lost: darko-sitl campaign small.toml --case 39" in lines
    assert "stayed: 39 of 39 (91.0 to 100 %); wanted: 90 %" in lines
    assert any(line.startswith("variance of reached: push 100 %") for line in lines)


def test_a_case_with_an_error_does_not_hold():
    assert passed(result(), drawn_of(result()))
    wanted = result(REQUIRED.replace("stayed = 0.9", "stayed = 0.99"))
    assert not passed(wanted, drawn_of(wanted))


TABLE = """
[table]
rows = ["push"]
columns = ["median / p95 / most reached", "share stayed", "count stayed"]
"""


def test_a_table_has_a_row_for_each_value_and_cells_of_statistics():
    found = result(SMALL + TABLE)
    lines = summary_lines(found, drawn_of(found), "")
    reached = [push + number / 1000 for push in (0.0, 2.0) for number in range(40) if (number % 2) * 2.0 == push][:-1]
    middle, high = np.median(reached[:20]), np.quantile(reached[:20], 0.95)
    assert lines[2:6] == [
        "| push | cases | reached [m], median / p95 / most | stayed | stayed |",
        "| --- | --- | --- | --- | --- |",
        f"| 0 | 20 | {middle:.3g} / {high:.3g} / 0.038 | 20 of 20 (83.2 to 100 %) | 20/20 |",
        "| 2 | 20 | 2.02 / 2.04 / 2.04 | 19 of 20 (75.1 to 99.9 %) | 19/20 |",
    ]


def test_a_table_may_have_a_block_of_columns_for_each_value():
    found = result(SMALL + '[table]\nacross = "push"\ncolumns = ["most reached", "count stayed"]')
    head, _, row = summary_lines(found, drawn_of(found), "")[2:5]
    assert head == "| cases | push 0: reached [m], most | push 0: stayed | push 2: reached [m], most | push 2: stayed |"
    assert row == "| 40 | 0.038 | 20/20 | 2.04 | 19/20 |"


def test_a_measure_that_serves_others_is_not_told():
    text = SMALL.replace("reached", "_reached")
    found = result(text, worst=[])
    lines = summary_lines(found, drawn_of(found), "")
    assert lines[1].startswith("stayed: 39 of 39")
    assert not [line for line in lines if "_reached" in line]


def test_what_is_required_must_hold_in_every_row():
    wanted = "[require]\nstayed = 0.96\nreached = 0.01"
    whole, rows = result(SMALL + wanted), result(SMALL + TABLE + wanted)
    assert passed(whole, drawn_of(whole))
    assert not passed(rows, drawn_of(rows))
    assert any(line.endswith("wanted: 96 % in every row") for line in summary_lines(rows, drawn_of(rows), ""))


def test_the_table_has_all_that_was_drawn_and_measured():
    parquet = pytest.importorskip("pyarrow.parquet")
    drawn = drawn_of(result())
    table = parquet.read_table(io.BytesIO(parquet_table(result(), drawn)))
    assert parquet_table(result(), drawn) == parquet_table(result(), drawn)
    assert table.column_names == ["case", "seed", *drawn, "reached", "stayed", "end", "error"]
    row = table.to_pylist()[3]
    assert [row[name] for name in drawn] == [values[3] for values in drawn.values()]
    assert (row["case"], row["seed"], row["end"]) == (3, 2, "time")
    assert table.to_pylist()[39]["error"] == "lost"


def test_the_page_needs_nothing_from_elsewhere():
    pytest.importorskip("matplotlib")
    drawn, command = drawn_of(result()), "darko-sitl campaign small.toml"
    page = campaign_page(result(), drawn, summary_lines(result(), drawn, command), command)
    assert page.count("<svg") == 1  # none of what is true or false
    assert "darko-sitl campaign small.toml --case 37" in page
    assert not [part for part in ("src=", "url(", "@import", "<link rel='stylesheet") if f'{part}"http' in page]
    assert json.dumps("hypot(DARKO_TRUTH.position[0], DARKO_TRUTH.position[1])")[1:-1] in page
