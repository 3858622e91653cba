"""What the vehicle keeps between runs: its mission, fence and rally points, and its changed parameters.

Files are replaced whole (write aside, flush, rename), so that a crash leaves the old or the new one.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from protocol.errors import FileError, LocalProtocolError
from protocol.plans import Plan, load, save
from protocol.plans.geofence import fence_items, rally_items, with_fence, with_rally
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
        self._fence = folder / "fence.plan"
        self._rally = folder / "rally.plan"
        self._parameters = folder / "parameters.json"

    def mission(self) -> tuple[MissionItem, ...]:
        """The kept mission, empty if there is none."""
        return _load(self._mission, lambda plan: plan.items)

    def keep_mission(self, items: Sequence[MissionItem]) -> None:
        """Replace the kept mission."""
        _save(self._mission, lambda: Plan(items=tuple(items)))

    def fence(self) -> tuple[MissionItem, ...]:
        """The kept fence, empty if there is none."""
        return _load(self._fence, fence_items)

    def keep_fence(self, items: Sequence[MissionItem]) -> None:
        """Replace the kept fence."""
        _save(self._fence, lambda: with_fence(Plan(), items))

    def rally(self) -> tuple[MissionItem, ...]:
        """The kept rally points, empty if there are none."""
        return _load(self._rally, rally_items)

    def keep_rally(self, items: Sequence[MissionItem]) -> None:
        """Replace the kept rally points."""
        _save(self._rally, lambda: with_rally(Plan(), items))

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


def _load(path: Path, read: Callable[[Plan], tuple[MissionItem, ...]]) -> tuple[MissionItem, ...]:
    if not path.exists():
        return ()
    try:
        return tuple(read(load(path)))
    except FileError as error:
        raise MemoryFaultError(f"{error} (delete the file to start without a {path.stem})") from error


def _save(path: Path, make: Callable[[], Plan]) -> None:
    try:
        save(make(), path)
    except (OSError, FileError, LocalProtocolError) as error:
        raise MemoryFaultError(f"{path.stem} not kept: {path}: {error}") from error
