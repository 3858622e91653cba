"""Runs the simulated vehicle as a subprocess: ``--sitl``."""

from __future__ import annotations

import asyncio
import contextlib
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from darko_gcs.errors import LinkError

__all__ = ["SitlProcess"]

SITL_PROGRAM = Path(sys.executable).with_name("darko-sitl")
STOP_TIMEOUT = 3.0  # after which the process is killed [s]
READY_PREFIX = "ready after"  # of the line it prints when everything is compiled and it flies


class SitlProcess:
    """One ``darko-sitl`` process."""

    def __init__(self, process: asyncio.subprocess.Process, on_line: Callable[[str], None]) -> None:
        self._process = process
        self._on_line = on_line
        self.is_ready = False  # it has printed so
        self._reader = asyncio.create_task(self._read())

    @classmethod
    async def start(cls, gcs_port: int, arguments: Sequence[str], on_line: Callable[[str], None]) -> SitlProcess:
        """Start a vehicle that sends its telemetry to ``gcs_port``.

        Args:
            gcs_port: Where the ground station listens.
            arguments: Further arguments of darko-sitl.
            on_line: Called with every line the process prints.

        Raises:
            LinkError: If it cannot be started.
        """
        try:
            process = await asyncio.create_subprocess_exec(
                str(SITL_PROGRAM),
                *("--port", "0", "--gcs-port", str(gcs_port)),
                *arguments,
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.DEVNULL,
                stderr=asyncio.subprocess.PIPE,
            )
        except OSError as error:
            raise LinkError(f"cannot start {SITL_PROGRAM}: {error.strerror}") from error
        return cls(process, on_line)

    @property
    def exit_code(self) -> int | None:
        """Exit code; None while it runs."""
        return self._process.returncode

    async def stop(self) -> None:
        """Terminate the process; kill it if it does not stop in time."""
        if self._process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                self._process.terminate()
            try:
                await asyncio.wait_for(self._process.wait(), STOP_TIMEOUT)
            except TimeoutError:
                self._process.kill()
                await self._process.wait()
        await self._reader

    async def _read(self) -> None:
        stream = self._process.stderr
        while stream is not None and (line := await stream.readline()):
            text = line.decode(errors="replace").rstrip().removeprefix("darko-sitl: ")
            self.is_ready = self.is_ready or text.startswith(READY_PREFIX)
            self._on_line(text)
