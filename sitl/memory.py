"""What the vehicle keeps between runs: its mission and its changed parameters.

Files are replaced whole (write aside, flush, rename), so that a crash leaves the old or the new one.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from protocol.errors import FileError
from protocol.plans import Plan, load, save
from protocol.plans.mission import MissionItem
from sitl.errors import SitlError


class MemoryFaultError(SitlError):
    """The state folder cannot be read or written; the message names the file."""


class Memory:
    """One folder of state."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise MemoryFaultError(f"state folder {folder}: {error.strerror}") from error
        self._mission = folder / "mission.plan"
        self._parameters = folder / "parameters.json"

    def mission(self) -> tuple[MissionItem, ...]:
        """The kept mission, empty if there is none."""
        if not self._mission.exists():
            return ()
        try:
            return tuple(load(self._mission).items)
        except FileError as error:
            raise MemoryFaultError(f"{error} (delete the file to start without a mission)") from error

    def keep_mission(self, items: Sequence[MissionItem]) -> None:
        """Replace the kept mission."""
        try:
            save(Plan(items=tuple(items)), self._mission)
        except (OSError, FileError) as error:
            raise MemoryFaultError(f"mission not kept: {self._mission}: {error}") from error

    def parameters(self) -> dict[str, float]:
        """The kept parameters by name."""
        if not self._parameters.exists():
            return {}
        try:
            kept = json.loads(self._parameters.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise MemoryFaultError(f"{self._parameters}: {error} (delete the file to start from defaults)") from error
        if not isinstance(kept, dict):
            raise MemoryFaultError(f"{self._parameters}: not a table of parameters")
        for name, value in kept.items():
            if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
                raise MemoryFaultError(f"{self._parameters}: {name} is {value!r}, not a number")
        return kept

    def keep_parameters(self, values: Mapping[str, float]) -> None:
        """Replace the kept parameters."""
        staged = self._parameters.with_suffix(".new")
        try:
            with staged.open("w", encoding="utf-8") as file:
                json.dump(dict(sorted(values.items())), file, indent=1)
                file.flush()
                os.fsync(file.fileno())
            staged.replace(self._parameters)
        except OSError as error:
            raise MemoryFaultError(f"parameters not kept: {self._parameters}: {error.strerror}") from error
