"""Campaigns run: the result is the same whoever flies in whatever order, and what is there is not flown again."""

import numpy as np
import pytest

from sitl import SitlError
from sitl.lab.campaigns.campaign_run import Progress, in_words, interval_width, run_specification
from sitl.lab.campaigns.case_flights import FlownCase
from sitl.lab.campaigns.chunks import ChunkStore, chunk_bytes
from sitl.lab.studies.proportions import share_bounds
from tests.support.campaigns import small


def made_up(number):
    value = float(np.random.default_rng(number).normal())
    return FlownCase(number, "time", "", (value, float(value < 1.0)))


class Engine:
    """Makes results up, in any order, and fails after so many chunks."""

    def __init__(self, order=None, fails_after=None):
        self.order, self.fails_after, self.flown = order, fails_after, []

    def __call__(self, _, chunks):
        chosen = list(chunks)
        if self.order is not None:
            np.random.default_rng(self.order).shuffle(chosen)
        for cases in chosen:
            if len(self.flown) == self.fails_after:
                raise SitlError("the engine fails")
            self.flown.append(cases)
            yield cases, chunk_bytes(map(made_up, cases))


def run(folder, engine, **changes):
    campaign = small(**changes)
    return run_specification(campaign, ChunkStore(folder, campaign), engine, clock=lambda: 0.0, write=lambda _: None)


UNTIL = {"measure": "reached", "width": 1.0, "least": 10}


@pytest.mark.parametrize("until", [{}, {"until": UNTIL}, {"until": {"measure": "stayed", "width": 0.3}}])
def test_the_result_does_not_depend_on_the_order(tmp_path, until):
    results = [run(tmp_path / str(order), Engine(order), cases=200, **until) for order in (None, 1, 2)]
    assert results[0].flown == results[1].flown == results[2].flown
    assert len(results[0].flown) == 200 if not until else 20 <= len(results[0].flown) < 200
    assert [one.number for one in results[0].flown] == list(range(len(results[0].flown)))
    assert results[0].ended_early == bool(until)


def test_an_early_end_is_where_the_interval_is_narrow_for_the_first_time(tmp_path):
    result = run(tmp_path, Engine(), cases=200, until=UNTIL)
    widths = [interval_width(result.values("reached")[:count], judges=False) for count in range(12, 200, 3)]
    count = len(result.flown)
    assert widths[(count - 12) // 3] <= 1.0
    assert all(width > 1.0 for width in widths[: (count - 12) // 3])


def test_what_is_there_is_not_flown_again(tmp_path):
    first = Engine(fails_after=5)
    with pytest.raises(SitlError, match="the engine fails"):
        run(tmp_path, first, cases=30)
    second, third = Engine(), Engine()
    result = run(tmp_path, second, cases=30)
    assert len(first.flown) == 5
    assert not set(first.flown) & set(second.flown)
    assert result.flown == [made_up(number) for number in range(30)] == run(tmp_path, third, cases=30).flown
    assert third.flown == []
    assert run(tmp_path, fourth := Engine(), cases=36).flown[:30] == result.flown
    assert fourth.flown == [range(30, 33), range(33, 36)]


def test_widths_of_intervals():
    low, high = share_bounds(7, 10)
    assert interval_width([1.0] * 7 + [0.0] * 3, judges=True) == high - low
    assert interval_width([1.0, float("nan")], judges=False) == float("inf")
    assert interval_width([0.0, 1.0, float("inf"), float("nan")], judges=False) == pytest.approx(2 * 12.706 * 0.5, 1e-4)


def test_progress_tells_rate_time_left_and_errors():
    now, lines = [0.0], []
    progress = Progress(1000, 400, lambda: now[0], lines.append)
    now[0] = 4.0
    progress.add([FlownCase(400, "time", "", ())] * 20)
    now[0] = 6.0
    progress.add([FlownCase(420, "error", "lost", ())] * 10)
    assert lines == ["430/1000 cases, 300 a minute, 2 min left, 10 with an error"]
    assert [in_words(seconds) for seconds in (3.2, 300.0, 7500.0)] == ["3 s", "5 min", "2 h 5 min"]
