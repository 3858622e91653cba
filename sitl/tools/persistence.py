"""Files: the state folder, what is written to the disk, and flight plans."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

from protocol.errors import FileError, LocalProtocolError, ProtocolError
from protocol.flight_plans import load_flight_plan
from protocol.flight_plans.plan_check import PlanCheck, check_flown
from protocol.flight_plans.plan_names import NameMapping, load_name_mapping
from protocol.frames import Geodetic
from protocol.plans import Plan, load, save
from protocol.plans.fence_rally import fence_items, rally_items, with_fence, with_rally
from protocol.plans.plan import MissionItem
from protocol.tools.files import write_atomically
from sitl.errors import SitlError

# The vehicle's storage between runs: mission, fence, rally points, flight plan, home, origin, changed parameters.
#
# A fence and rally points are kept as the items that arrived: as ``geoFence`` and ``rallyPoints``, which files of
# ground stations have, they would lose what those do not tell.
#
# Files are replaced atomically, so that a crash leaves the old or the new one. If several are to be cleared together,
# that is written down first, and the next start finishes it after a crash.

LEFT_OVER = "*.new"  # files of writes that a crash cut short
MAX_FLIGHT_PLAN_SIZE = 1 << 20  # beyond what can be sent [bytes]
MAX_ERROR_LOG = 1 << 18  # [bytes]
MAX_TABLE_SIZE = 1 << 20  # far beyond what the vehicle writes [bytes]


class StateFolderError(SitlError):
    """The state folder cannot be read or written; the message names the file."""


class HomeAndOrigin(NamedTuple):
    """Positions of home and of the local frame's origin."""

    start: Geodetic  # where the origin was when the vehicle started
    origin: Geodetic
    home: Geodetic


class StateFolder:
    """One folder of state.

    Reading raises StateFolderError if a file is damaged, writing if it cannot be written.

    Args:
        folder: Where it is; it is made if it is missing.

    Raises:
        StateFolderError: It cannot be made.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StateFolderError(f"state folder {folder}: {error.strerror}") from error
        self._mission = folder / "mission.plan"
        self._fence = folder / "fence.plan"
        self._rally = folder / "rally.plan"
        self._flight_plan = folder / "flight_plan.xml"
        self._parameters = folder / "parameters.json"
        self._home = folder / "home.json"
        self._plans = (self._mission, self._fence, self._rally)  # by MAV_MISSION_TYPE
        self.errors = folder / "errors.log"  # tracebacks, for those who mend the vehicle
        self._clearing = folder / "clearing"  # names the plans that are being cleared together
        self._tidy()

    def mission(self) -> tuple[MissionItem, ...]:
        """The stored mission, empty if there is none."""
        return _load(self._mission, lambda plan: plan.items)

    def save_mission(self, items: Sequence[MissionItem]) -> None:
        """Replace the stored mission."""
        _save(self._mission, lambda: Plan(items=tuple(items)))

    def fence(self) -> tuple[MissionItem, ...]:
        """The stored fence, empty if there is none."""
        return _load(self._fence, lambda plan: plan.items or fence_items(plan))

    def save_fence(self, items: Sequence[MissionItem]) -> None:
        """Replace the stored fence."""
        _save(self._fence, lambda: with_fence(Plan(items=tuple(items)), items))

    def rally(self) -> tuple[MissionItem, ...]:
        """The stored rally points, empty if there are none."""
        return _load(self._rally, lambda plan: plan.items or rally_items(plan))

    def save_rally(self, items: Sequence[MissionItem]) -> None:
        """Replace the stored rally points."""
        _save(self._rally, lambda: with_rally(Plan(items=tuple(items)), items))

    def flight_plan(self) -> bytes | None:
        """The file of the flight plan that was sent last; None if none ever was."""
        if not self._flight_plan.exists():
            return None
        try:
            with self._flight_plan.open("rb") as file:
                return file.read(MAX_FLIGHT_PLAN_SIZE + 1)
        except OSError as error:
            raise StateFolderError(
                f"{self._flight_plan}: {error.strerror} (delete the file to start without a flight plan)"
            ) from error

    def save_flight_plan(self, data: bytes) -> None:
        """Replace the stored flight plan."""
        _write(self._flight_plan, data, "flight plan not saved")

    def clear_plans(self, kinds: Iterable[int]) -> None:
        """Clear the plans of these MAV_MISSION_TYPEs, all of them or, after a crash, none.

        Raises:
            StateFolderError: The folder cannot be written.
        """
        _write(self._clearing, " ".join(self._plans[kind].name for kind in kinds).encode(), "plans not cleared")
        try:
            self._finish_clearing()
        except OSError as error:
            raise StateFolderError(f"plans not cleared: {self.folder}: {error.strerror}") from error

    def parameters(self) -> dict[str, float]:
        """The stored parameters by name."""
        stored = _read_table(self._parameters, "defaults")
        for name, value in stored.items():
            if not _is_number(value):
                raise StateFolderError(f"{self._parameters}: {name} is {value!r}, not a number")
        return stored

    def save_parameters(self, values: Mapping[str, float]) -> None:
        """Replace the stored parameters."""
        _write(self._parameters, json.dumps(dict(sorted(values.items())), indent=1).encode(), "parameters not saved")

    def home_and_origin(self) -> HomeAndOrigin | None:
        """The stored home and origin; None if neither was ever moved."""
        stored = _read_table(self._home, "--home")
        if not stored:
            return None
        places = [_geodetic(self._home, name, stored.get(name)) for name in HomeAndOrigin._fields]
        return HomeAndOrigin(*places)

    def save_home_and_origin(self, places: HomeAndOrigin) -> None:
        """Replace the stored home and origin, both or neither."""
        table = {name: asdict(place) for name, place in places._asdict().items()}
        _write(self._home, json.dumps(table, indent=1).encode(), "home not saved")

    def add_error(self, text: str) -> None:
        """Add to the log of errors; the oldest go as it grows."""
        try:
            before = self.errors.read_bytes() if self.errors.exists() else b""
        except OSError as error:
            raise StateFolderError(f"errors not logged: {self.errors}: {error.strerror}") from error
        _write(self.errors, (before + text.encode("utf-8", errors="replace"))[-MAX_ERROR_LOG:], "errors not logged")

    def _tidy(self) -> None:
        """Finish what a crash has cut short."""
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
    """A JSON object, empty if there is no file; ``otherwise`` says what the vehicle starts from without it."""
    if not path.exists():
        return {}
    try:
        with path.open("rb") as file:
            content = file.read(MAX_TABLE_SIZE + 1)
        if len(content) > MAX_TABLE_SIZE:
            raise StateFolderError(f"{path}: too long (delete the file to start from {otherwise})")
        stored = json.loads(content.decode("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise StateFolderError(f"{path}: {error} (delete the file to start from {otherwise})") from error
    if not isinstance(stored, dict):
        raise StateFolderError(f"{path}: not a table (delete the file to start from {otherwise})")
    return stored


def _geodetic(path: Path, name: str, stored: object) -> Geodetic:
    if isinstance(stored, dict) and stored.keys() == {"lat_deg", "lon_deg", "alt"}:
        place = Geodetic(**stored)
        if all(_is_number(value) for value in stored.values()) and abs(place.lat_deg) <= 90.0:
            return place
    raise StateFolderError(
        f"{path}: {name} is {stored!r}, not a place (delete the file to start from the home of the command line)"
    )


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max


def _write(path: Path, data: bytes, what: str) -> None:
    try:
        write_atomically(path, data)
    except FileError as error:
        raise StateFolderError(f"{what}: {error}") from error


def _load(path: Path, read: Callable[[Plan], tuple[MissionItem, ...]]) -> tuple[MissionItem, ...]:
    if not path.exists():
        return ()
    try:
        return tuple(read(load(path)))
    except FileError as error:
        raise StateFolderError(f"{error} (delete the file to start without a {path.stem})") from error


def _save(path: Path, make: Callable[[], Plan]) -> None:
    try:
        save(make(), path)
    except (OSError, FileError, LocalProtocolError) as error:
        raise StateFolderError(f"{path.stem} not saved: {path}: {error}") from error


# Flight plans as a user names them: a file, and a file of what its names mean.


class CheckedPlan(NamedTuple):
    """A plan that was looked through."""

    check: PlanCheck
    mapping: NameMapping

    @property
    def origin(self) -> Geodetic:
        """The plan's origin, on its ground."""
        plan = self.check.plan
        return Geodetic(plan.lat0, plan.lon0, plan.ground_alt)

    def require_flown(self) -> None:
        """Refuse a plan that cannot be flown at all.

        Raises:
            SitlError: The first construct outside of blocks that is not flown.
        """
        try:
            self.check.require_flown()
        except ProtocolError as error:
            raise SitlError(str(error)) from None


def load_checked_plan(path: Path, names: Path | None = None, procedures: Path | None = None) -> CheckedPlan:
    """Read a plan, and what its names mean.

    Args:
        path: Of the plan.
        names: TOML file of what the names of its build mean.
        procedures: A folder beside its own that the procedures it includes may lie in.

    Raises:
        SitlError: A file cannot be read or is not valid; the message says where.
    """
    try:
        mapping = NameMapping() if names is None else load_name_mapping(names)
        return CheckedPlan(check_flown(load_flight_plan(path, procedures), mapping), mapping)
    except ProtocolError as error:
        raise SitlError(str(error)) from None
