"""The vehicle process as the ground station's child: ``--sitl``."""

from __future__ import annotations

import asyncio
import contextlib
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from darko_gcs.errors import LinkError

__all__ = ["Child"]

PROGRAM = Path(sys.executable).with_name("darko-sitl")
STOP_WITHIN = 3.0  # [s] before it is killed
READY = "ready after"  # begins what it says when it has compiled what it needs and flies


class Child:
    """One ``darko-sitl``, told from its siblings by its process id."""

    def __init__(self, process: asyncio.subprocess.Process, hear: Callable[[str], None]) -> None:
        self._process = process
        self._hear = hear
        self.is_ready = False  # has said so
        self._reader = asyncio.create_task(self._read())

    @classmethod
    async def start(cls, gcs_port: int, arguments: Sequence[str], hear: Callable[[str], None]) -> Child:
        """Start the vehicle so that it reports to ``gcs_port``.

        Args:
            gcs_port: Where the ground station listens.
            arguments: Further arguments of darko-sitl.
            hear: Called with every line the vehicle says.

        Raises:
            LinkError: If it cannot be started.
        """
        try:
            process = await asyncio.create_subprocess_exec(
                str(PROGRAM),
                *("--port", "0", "--gcs-port", str(gcs_port)),
                *arguments,
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.DEVNULL,
                stderr=asyncio.subprocess.PIPE,
            )
        except OSError as error:
            raise LinkError(f"cannot start {PROGRAM}: {error.strerror}") from error
        return cls(process, hear)

    @property
    def exit_code(self) -> int | None:
        """How it ended; None while it runs."""
        return self._process.returncode

    async def stop(self) -> None:
        """End the process, gently if it lets itself."""
        if self._process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                self._process.terminate()
            try:
                await asyncio.wait_for(self._process.wait(), STOP_WITHIN)
            except TimeoutError:
                self._process.kill()
                await self._process.wait()
        await self._reader

    async def _read(self) -> None:
        stream = self._process.stderr
        while stream is not None and (line := await stream.readline()):
            text = line.decode(errors="replace").rstrip().removeprefix("darko-sitl: ")
            self.is_ready = self.is_ready or text.startswith(READY)
            self._hear(text)
