"""What ends the ground station from outside: a closed terminal, or a request to stop."""

from __future__ import annotations

import asyncio
import contextlib
import signal
from collections.abc import Callable

__all__ = ["REASONS", "watch_signals"]

REASONS = {
    signal.SIGHUP: "The terminal was closed",
    signal.SIGTERM: "The ground station was asked to stop",
}


def watch_signals(ended: Callable[[str], None]) -> None:
    """Call ``ended`` with the reason, in words, when the process is to end; only in the main thread."""
    loop = asyncio.get_running_loop()
    for number, reason in REASONS.items():
        with contextlib.suppress(RuntimeError, ValueError, NotImplementedError):
            loop.add_signal_handler(number, ended, reason)
