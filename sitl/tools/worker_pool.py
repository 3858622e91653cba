"""Worker processes for studies: an interrupt ends them at once and without tracebacks."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context


@contextmanager
def worker_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """A pool of freshly started processes; tasks that still wait when the block fails are dropped.

    Args:
        workers: How many processes.
    """
    end_quietly = signal.signal, (signal.SIGINT, signal.SIG_DFL)  # no KeyboardInterrupt traceback from each worker
    with ProcessPoolExecutor(workers, get_context("spawn"), *end_quietly) as pool:
        try:
            yield pool
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
