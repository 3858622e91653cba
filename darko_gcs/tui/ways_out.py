"""Exits of the ground station that come from outside: a closed terminal, or a request to stop."""

from __future__ import annotations

import asyncio
import contextlib
import os
import select
import signal
import threading
import time
from collections.abc import Awaitable, Callable

CLOSED = "The terminal was closed"
REASONS = {
    signal.SIGHUP: CLOSED,
    signal.SIGTERM: "The ground station was asked to stop",
}
LOOK_PERIOD = 500  # between looks at the terminal [ms]
MAX_LEAVING_TIME = 10.0  # for the ground station to end by itself after its terminal was closed [s]
EXIT_HUNG_UP = 129  # as shells report SIGHUP


def watch_signals(ended: Callable[[str], None]) -> None:
    """Call ``ended`` with the reason, in words, when the process is to end; only in the main thread."""
    loop = asyncio.get_running_loop()
    for number, reason in REASONS.items():
        with contextlib.suppress(RuntimeError, ValueError, NotImplementedError):
            loop.add_signal_handler(number, ended, reason)


def ignore_interrupts() -> None:
    """Leave Ctrl+C to the page's server, which asks: it reaches all processes of its terminal."""
    with contextlib.suppress(RuntimeError, ValueError, NotImplementedError):
        asyncio.get_running_loop().add_signal_handler(signal.SIGINT, lambda: None)


def watch_terminal(descriptor: int, ended: Callable[[str], None]) -> None:
    """Call ``ended`` when nobody has the other side of the terminal open any more, and end the process if that fails.

    No signal tells so if the terminal is not the session's own. Textual reads and writes on without end then, in the
    loop's thread too: hence a thread that needs no loop.

    Args:
        descriptor: Of the terminal; anything else is not watched.
        ended: Takes the reason, in the running loop.
    """
    if not os.isatty(descriptor):
        return
    loop = asyncio.get_running_loop()

    def watch() -> None:
        while not is_hung_up(descriptor, LOOK_PERIOD):
            pass
        with contextlib.suppress(RuntimeError):  # the loop has ended
            loop.call_soon_threadsafe(ended, CLOSED)
        time.sleep(MAX_LEAVING_TIME)
        os._exit(EXIT_HUNG_UP)

    threading.Thread(target=watch, name="terminal-watch", daemon=True).start()


def is_hung_up(descriptor: int, wait: int = 0) -> bool:
    """Whether nobody has the other side of a terminal open, now or within some time [ms]."""
    poll = select.poll()
    poll.register(descriptor, 0)  # hang-ups and errors are always told
    return bool(poll.poll(wait))


async def leave(close: Callable[[], Awaitable[None]]) -> None:
    """Close what must be closed, and end the process without a word to a terminal that is not there any more."""
    try:
        await close()
    finally:
        os._exit(0)
