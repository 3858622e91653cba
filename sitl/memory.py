"""What the vehicle keeps between runs: its mission, fence and rally points, its home, and its changed parameters.

Files are replaced whole (write aside, flush, rename), so that a crash leaves the old or the new one. What clears
several at once is written down first, and finished by the next start if a crash came between.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

from protocol.errors import FileError, LocalProtocolError
from protocol.frames import Geodetic
from protocol.plans import Plan, load, save
from protocol.plans.geofence import fence_items, rally_items, with_fence, with_rally
from protocol.plans.mission import MissionItem
from protocol.whole_file import write_whole
from sitl.errors import SitlError

LEFT_OVER = "*.new"  # of writes that were cut short
LARGEST = 1 << 20  # a table of ours is never that long [bytes]

Keep = Callable[[Callable[[], None]], None]
"""Calls what writes to the memory; what could not be written is said, and the flight goes on."""


class MemoryFaultError(SitlError):
    """The state folder cannot be read or written; the message names the file."""


class Anchors(NamedTuple):
    """Where the local frame and home are on the globe."""

    start: Geodetic  # where the frame's origin was when the vehicle started
    origin: Geodetic  # of the local frame
    home: Geodetic


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
        self._home = folder / "home.json"
        self._plans = (self._mission, self._fence, self._rally)  # by MAV_MISSION_TYPE
        self._clearing = folder / "clearing"  # names the plans that are being cleared together
        self._tidy()

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

    def clear_plans(self, kinds: Iterable[int]) -> None:
        """Keep no plan of these MAV_MISSION_TYPEs any more: all of them are gone, or none.

        Raises:
            MemoryFaultError: The folder cannot be written.
        """
        _write(self._clearing, " ".join(self._plans[kind].name for kind in kinds), "plans not cleared")
        try:
            self._finish_clearing()
        except OSError as error:
            raise MemoryFaultError(f"plans not cleared: {self.folder}: {error.strerror}") from error

    def parameters(self) -> dict[str, float]:
        """The kept parameters by name."""
        kept = _read_table(self._parameters, "defaults")
        for name, value in kept.items():
            if not _is_number(value):
                raise MemoryFaultError(f"{self._parameters}: {name} is {value!r}, not a number")
        return kept

    def keep_parameters(self, values: Mapping[str, float]) -> None:
        """Replace the kept parameters."""
        _write(self._parameters, json.dumps(dict(sorted(values.items())), indent=1), "parameters not kept")

    def anchors(self) -> Anchors | None:
        """The kept home and origin; None where neither was ever moved."""
        kept = _read_table(self._home, "the home it is started with")
        if not kept:
            return None
        places = [_geodetic(self._home, name, kept.get(name)) for name in Anchors._fields]
        return Anchors(*places)

    def keep_anchors(self, anchors: Anchors) -> None:
        """Replace the kept home and origin: both, or neither."""
        table = {name: asdict(place) for name, place in anchors._asdict().items()}
        _write(self._home, json.dumps(table, indent=1), "home not kept")

    def _tidy(self) -> None:
        """Finish what a crash cut short."""
        with suppress(OSError):
            self._finish_clearing()
            for path in list(self.folder.glob(LEFT_OVER)):
                path.unlink()

    def _finish_clearing(self) -> None:
        if self._clearing.exists():
            named = self._clearing.read_text(encoding="utf-8", errors="replace").split()
            for path in self._plans:
                if path.name in named:
                    path.unlink(missing_ok=True)
            self._clearing.unlink()


def _read_table(path: Path, otherwise: str) -> dict[str, Any]:
    """A JSON object, empty where there is no file; ``otherwise`` is what deleting it gives."""
    if not path.exists():
        return {}
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST + 1)
        if len(content) > LARGEST:
            raise MemoryFaultError(f"{path}: too long (delete the file to start from {otherwise})")
        kept = json.loads(content.decode("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise MemoryFaultError(f"{path}: {error} (delete the file to start from {otherwise})") from error
    if not isinstance(kept, dict):
        raise MemoryFaultError(f"{path}: not a table (delete the file to start from {otherwise})")
    return kept


def _geodetic(path: Path, name: str, kept: object) -> Geodetic:
    if isinstance(kept, dict) and kept.keys() == {"lat_deg", "lon_deg", "alt"}:
        place = Geodetic(**kept)
        if all(_is_number(value) for value in kept.values()) and abs(place.lat_deg) <= 90.0:
            return place
    raise MemoryFaultError(f"{path}: {name} is {kept!r}, not a place (delete the file to start where it is started)")


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max


def _write(path: Path, text: str, what: str) -> None:
    try:
        write_whole(path, text.encode("utf-8"))
    except FileError as error:
        raise MemoryFaultError(f"{what}: {error}") from error


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
