"""Calls the pilot: the terminal's bell, a notice, and a command of the pilot's own, once for each alert."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Iterable, Sequence
from typing import Any

from textual.app import App
from textual.widgets import Input

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.values import Alert
from protocol.wire.message import Source

SHOWN_TIME = 20.0  # of a notice [s]
MAX_RUN_TIME = 30.0  # of the command, which is then ended [s]


class AlertCalls:
    """Follows the alerts of all vehicles.

    Args:
        app: Rings and shows.
        command: Run with the alert's words as its last argument; empty: none. Its environment has DARKO_ALERT, the
            kind, and DARKO_VEHICLE, the system id.
    """

    def __init__(self, app: App[Any], command: Sequence[str] = ()) -> None:
        self._app, self._command = app, tuple(command)
        self._called: set[tuple[Source, Alert]] = set()
        self._running: set[asyncio.Task[None]] = set()

    def follow(self, vehicles: Iterable[Snapshot]) -> None:
        """Call for what is new."""
        for s in vehicles:
            for alert in s.session.alerts:
                key = None if s.identity.source is None else (s.identity.source, alert._replace(over=None))
                if s.identity.source is not None and key is not None and key not in self._called:
                    self._called.add(key)
                    self._call(s.identity.source[0], alert)

    def _call(self, system: int, alert: Alert) -> None:
        self._app.bell()
        text = f"Vehicle {system}: {alert.text}"
        keys = "Esc, then A" if isinstance(self._app.focused, Input) else "A"  # which a field would take as a letter
        self._app.notify(f"{text} ({keys}: seen)", severity="error", timeout=SHOWN_TIME, markup=False)
        if self._command:
            task = asyncio.create_task(self._run(system, alert, text))
            self._running.add(task)
            task.add_done_callback(self._running.discard)

    async def _run(self, system: int, alert: Alert, text: str) -> None:
        environment = {**os.environ, "DARKO_ALERT": alert.kind, "DARKO_VEHICLE": str(system)}
        nowhere = asyncio.subprocess.DEVNULL
        try:
            process = await asyncio.create_subprocess_exec(
                *self._command, text, stdin=nowhere, stdout=nowhere, stderr=nowhere, env=environment
            )
        except OSError as error:
            self._tell(f"cannot be run: {error.strerror}")
            return
        try:
            code = await asyncio.wait_for(process.wait(), MAX_RUN_TIME)
        except TimeoutError:
            process.kill()
            self._tell(f"was ended after {MAX_RUN_TIME:.0f} s")
        else:
            if code:
                self._tell(f"ended with exit code {code}")

    def _tell(self, what: str) -> None:
        if self._app.is_running:
            self._app.notify(f"--on-alert {self._command[0]} {what}", severity="warning", markup=False)
