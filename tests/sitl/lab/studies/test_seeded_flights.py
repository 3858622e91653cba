"""Seeded flights: in order, counted as they are done, refused where there is nothing to fly."""

import argparse
import signal
import time

import pytest

from sitl import SitlError
from sitl.defaults import BRISK
from sitl.lab.studies.seeded_flights import craft_of, fly_draws, seeds, worker_pool
from sitl.lab.study_options import PAPARAZZI, add_seeded


def test_results_are_in_the_order_of_the_seeds_and_each_is_counted():
    done = []
    assert fly_draws(str, seeds(3, 7), jobs=1, on_progress=done.append) == ["7", "8", "9"]
    assert done == [1, 2, 3]


@pytest.mark.parametrize(
    ("flights", "first", "words"), [(0, 1, "0 flights"), (-2, 1, "-2 flights"), (3, -1, "seed -1")]
)
def test_no_flights_and_negative_seeds_are_refused(flights, first, words):
    with pytest.raises(SitlError, match=words):
        seeds(flights, first)


@pytest.mark.parametrize(("draws", "jobs"), [([], 1), ([1], 0)])
def test_nothing_to_fly_and_no_process_are_refused(draws, jobs):
    with pytest.raises(SitlError, match="both must be at least 1"):
        fly_draws(str, draws, jobs)


@pytest.mark.parametrize("controller", ["report", "robust-pi", PAPARAZZI])
def test_a_brisk_pace_is_refused_where_no_law_heeds_it(controller):
    options = argparse.ArgumentParser()
    add_seeded(options, 3, "flights", also=("robust-pi", PAPARAZZI))
    assert craft_of(options.parse_args(["--brisk", "--controller", "indi"])).tuning.pace == BRISK
    with pytest.raises(SitlError, match=f"--brisk: {controller} flies by other gains"):
        craft_of(options.parse_args(["--brisk", "--controller", controller]))


# Worker processes: they take their tasks, and an interrupt or an error ends them at once.


def interrupt_handler():
    """Handler of SIGINT in this process."""
    return signal.getsignal(signal.SIGINT)


def test_tasks_run_in_other_processes_and_keep_their_order():
    with worker_pool(2) as pool:
        assert list(pool.map(abs, (-3, 2, -1))) == [3, 2, 1]


@pytest.mark.long
def test_a_worker_is_ended_by_an_interrupt_without_a_traceback():
    with worker_pool(1) as pool:
        assert pool.submit(interrupt_handler).result() is signal.SIG_DFL


def start_and_fail(waiting):
    """Hand many tasks to one worker, then fail."""
    with worker_pool(1) as pool:
        waiting += [pool.submit(time.sleep, 0.2) for _ in range(100)]
        raise RuntimeError


def test_waiting_tasks_are_dropped_when_the_block_fails():
    began, waiting = time.monotonic(), []
    with pytest.raises(RuntimeError):
        start_and_fail(waiting)
    assert time.monotonic() - began < 10.0
    assert waiting[-1].cancelled()
