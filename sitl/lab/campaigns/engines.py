"""Engines that fly chunks: this process, processes of this machine, or the workers of a Dask cluster.

An engine takes chunks in order and gives each back as it is flown, in any order. A worker that dies takes nothing with
it: its chunk is flown again.
"""

from __future__ import annotations

import math
import os
import pickle
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from functools import lru_cache
from importlib.util import find_spec
from multiprocessing import active_children, connection, get_context, parent_process
from typing import TYPE_CHECKING, Any

from sitl import SitlError
from sitl.lab.campaigns.chunks import chunk_name, code_version, fly_chunk
from sitl.lab.campaigns.specification import Specification

if TYPE_CHECKING:
    from distributed import Client

Flown = Generator[tuple[range, bytes], None, None]
Engine = Callable[[Specification, Sequence[range]], Flown]
CHUNKS_AHEAD = 2  # chunks at once for each process, so that none waits
MOST_DEATHS = 3  # of workers one after the other, without a chunk flown
RECONNECTION_TIME = 600.0  # a scheduler that is lost is waited for so long [s]
CONNECTION_TIME = 10  # of one attempt [s]
RETRY_TIME = 1.0  # between two attempts [s]


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0))


def fly_here(specification: Specification, chunks: Sequence[range]) -> Flown:
    """Fly chunks in this process, one after the other."""
    for cases in chunks:
        yield cases, fly_chunk(specification, cases)


@lru_cache(maxsize=2)
def _unpacked(packed: bytes) -> Specification:
    specification: Specification = pickle.loads(packed)  # noqa: S301 - of the process that started this one
    return specification


def fly_packed(packed: bytes, first: int, stop: int, version: str) -> bytes:
    """Fly a chunk in another process.

    Args:
        packed: The specification.
        first: Case.
        stop: One more than the last case.
        version: Of the code that asks.

    Raises:
        SitlError: This process has other code, whose flights are others.
    """
    if version != code_version():
        raise SitlError("a worker has another version of darko, or of a library, than this command")
    return fly_chunk(_unpacked(packed), range(first, stop))


def _begin_worker() -> None:
    """Have a worker end with its parent, however that ends, and without a traceback at an interrupt."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    connection.wait([sentinel])
    os._exit(1)


def on_processes(jobs: int) -> Engine:
    """An engine of processes of this machine.

    Args:
        jobs: How many.
    """

    def fly(specification: Specification, chunks: Sequence[range]) -> Flown:
        left, deaths = list(chunks), 0
        while left:
            try:
                for cases, data in _pooled(pickle.dumps(specification), left, jobs):
                    left.remove(cases)
                    deaths = 0
                    yield cases, data
            except BrokenProcessPool:
                deaths += 1
                if deaths >= MOST_DEATHS:
                    raise SitlError(
                        f"{deaths} workers died without a chunk flown, of cases {left[0].start} on; "
                        "is there memory for so many (--jobs)?"
                    ) from None

    return fly


def _pooled(packed: bytes, chunks: Sequence[range], jobs: int) -> Flown:
    waiting: deque[range] = deque(chunks)
    flying: dict[Future[bytes], range] = {}
    others = set(active_children())
    pool = ProcessPoolExecutor(jobs, get_context("spawn"), _begin_worker)
    try:
        while waiting or flying:
            while waiting and len(flying) < CHUNKS_AHEAD * jobs:
                cases = waiting.popleft()
                flying[pool.submit(fly_packed, packed, cases.start, cases.stop, code_version())] = cases
            done, _ = wait(flying, return_when=FIRST_COMPLETED)
            yield from _results(done, flying)
    finally:
        pool.shutdown(wait=not flying, cancel_futures=True)
        for worker in set(active_children()) - others:  # at work on what nobody waits for any more
            worker.terminate()


def _results(done: set[Future[bytes]], flying: dict[Future[bytes], range]) -> Flown:
    for future in sorted(done, key=lambda each: flying[each].start):
        data = future.result()
        yield flying.pop(future), data


# A Dask cluster: the scheduler carries a chunk's numbers out and its lines back; the disk is this machine's.


def require_distributed() -> None:
    """Check that a cluster can be reached, before the work for it is done.

    Raises:
        SitlError: Dask distributed is not installed.
    """
    if find_spec("distributed") is None:
        raise SitlError("--scheduler needs Dask distributed: pip install 'darko[cluster]'")


def on_cluster(address: str, tell: Callable[[str], None]) -> Engine:
    """An engine of the workers of a Dask cluster.

    Args:
        address: Of its scheduler, such as ``tcp://10.0.0.1:8786``.
        tell: Told when the scheduler is lost and found.
    """

    def fly(specification: Specification, chunks: Sequence[range]) -> Flown:
        left, heard_at = list(chunks), -math.inf
        while left:
            try:
                with _client(address) as client:
                    heard_at = time.monotonic()
                    for cases, data in _on_client(client, specification, left):
                        left.remove(cases)
                        heard_at = time.monotonic()
                        yield cases, data
            except _lost_errors() as error:
                if time.monotonic() - heard_at > RECONNECTION_TIME:
                    raise SitlError(f"--scheduler {address}: no scheduler answers ({type(error).__name__})") from None
                tell(f"the scheduler at {address} is lost; waiting for it")
                time.sleep(RETRY_TIME)

    return fly


def _client(address: str) -> Client:
    from distributed import Client  # noqa: PLC0415 - an optional dependency

    return Client(address, timeout=CONNECTION_TIME, set_as_default=False)


def _lost_errors() -> tuple[type[Exception], ...]:
    """Errors that a lost scheduler or worker shows as."""
    from concurrent.futures import CancelledError  # noqa: PLC0415

    from distributed import KilledWorker  # noqa: PLC0415 - an optional dependency
    from distributed.client import FutureCancelledError  # noqa: PLC0415
    from distributed.comm import CommClosedError  # noqa: PLC0415

    return (OSError, TimeoutError, CancelledError, FutureCancelledError, CommClosedError, KilledWorker)


def _on_client(client: Client, specification: Specification, chunks: Sequence[range]) -> Flown:
    from distributed import as_completed  # noqa: PLC0415 - an optional dependency

    packed, waiting = pickle.dumps(specification), deque(chunks)
    ahead = CHUNKS_AHEAD * max(sum(client.nthreads().values()), 1)
    flying: dict[str, range] = {}
    begun = [_submitted(client, packed, specification, waiting, flying) for _ in range(min(ahead, len(waiting)))]
    completed = as_completed(begun, loop=client.loop)
    for future in completed:
        data = future.result()
        cases = flying.pop(future.key)
        future.release()
        if waiting:
            completed.add(_submitted(client, packed, specification, waiting, flying))
        yield cases, data


def _submitted(
    client: Client, packed: bytes, specification: Specification, waiting: deque[range], flying: dict[str, range]
) -> Any:  # noqa: ANN401 - a future of distributed
    cases = waiting.popleft()
    key = chunk_name(specification, cases)
    flying[key] = cases
    return client.submit(fly_packed, packed, cases.start, cases.stop, code_version(), key=key, retries=MOST_DEATHS)
