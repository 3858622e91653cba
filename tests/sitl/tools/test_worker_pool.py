"""Worker processes: they take their tasks, and an interrupt or an error ends them at once."""

import signal
import time

import pytest

from sitl.lab.studies.seeded_flights import worker_pool


def interrupt_handler():
    """Handler of SIGINT in this process."""
    return signal.getsignal(signal.SIGINT)


def test_tasks_run_in_other_processes_and_keep_their_order():
    with worker_pool(2) as pool:
        assert list(pool.map(abs, (-3, 2, -1))) == [3, 2, 1]


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
