"""Runs the simulated vehicle as a subprocess: ``--sitl``."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence

from darko_gcs.errors import GroundError, LinkError

SITL_PROGRAM = (sys.executable, "-m", "sitl")  # of this very installation
PROGRAM_NAME = "darko-sitl"  # as it calls itself
CHECK_TIMEOUT = 30.0  # for the process to read its arguments [s]
ENDINGS = {-signal.SIGKILL: "was killed", -signal.SIGTERM: "was stopped", -signal.SIGINT: "was stopped"}
STOP_TIMEOUT = 3.0  # after which the process is killed [s]
READY_PREFIX = "ready after"  # of the line it prints when everything is compiled and it flies


def check_arguments(arguments: Sequence[str], airframe: str | None = None) -> None:
    """Have darko-sitl read its arguments without a flight.

    Args:
        arguments: As it would be started.
        airframe: The parameter set among them, which it looks for.

    Raises:
        GroundError: They are wrong, in darko-sitl's own words.
    """
    checks = [[*arguments, "--help"]] + ([["airframe", airframe]] if airframe is not None else [])
    for check in checks:
        try:
            told = subprocess.run(  # noqa: S603 - our own program
                [*SITL_PROGRAM, *check], capture_output=True, text=True, timeout=CHECK_TIMEOUT, check=False
            )
        except (OSError, subprocess.TimeoutExpired):
            return  # the start itself will tell
        if told.returncode:
            last = (told.stderr.strip().splitlines() or [f"exit code {told.returncode}"])[-1]
            raise GroundError(last.removeprefix(f"{PROGRAM_NAME}: ").removeprefix("error: "))


class SitlProcess:
    """One ``darko-sitl`` process."""

    def __init__(self, process: asyncio.subprocess.Process, on_line: Callable[[str], None]) -> None:
        self._process = process
        self._on_line = on_line
        self.is_ready = False  # it has printed so
        self._reader = asyncio.create_task(self._read())

    @classmethod
    async def start(
        cls, gcs_port: int, arguments: Sequence[str], on_line: Callable[[str], None], api_port: int = 0
    ) -> SitlProcess:
        """Start a vehicle that sends its telemetry to ``gcs_port``.

        Args:
            gcs_port: Where the ground station listens.
            arguments: Further arguments of darko-sitl.
            on_line: Called with every line the process prints.
            api_port: Where another program listens; 0: none, so that vehicles of two sessions stay apart.

        Raises:
            LinkError: If it cannot be started.
        """
        try:
            process = await asyncio.create_subprocess_exec(
                *SITL_PROGRAM,
                *("--port", "0", "--gcs-port", str(gcs_port), "--api-port", str(api_port)),
                *arguments,
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.DEVNULL,
                stderr=asyncio.subprocess.PIPE,
            )
        except OSError as error:
            raise LinkError(f"cannot start {PROGRAM_NAME}: {error.strerror}") from error
        return cls(process, on_line)

    @property
    def exit_code(self) -> int | None:
        """Exit code; None while it runs."""
        return self._process.returncode

    @property
    def ending(self) -> str:
        """Outcome of the ended process, in words; "" while it runs."""
        code = self.exit_code
        return "" if code is None else f"{PROGRAM_NAME} {ENDINGS.get(code, f'ended with exit code {code}')}"

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
            text = line.decode(errors="replace").rstrip().removeprefix(f"{PROGRAM_NAME}: ")
            self.is_ready = self.is_ready or text.startswith(READY_PREFIX)
            self._on_line(text)
