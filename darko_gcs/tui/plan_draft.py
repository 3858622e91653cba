"""The plan that the operator edits, how it compares with the vehicle's, and the files that were opened lately."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field, replace
from pathlib import Path

from darko_gcs.state.mission_legs import FLOWN_MISSION, LOW_LEG, beginning
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.values import FENCE, Items
from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.frames import Vector
from protocol.plans import Plan
from protocol.plans.fence_rally import fence_items, rally_items, with_fence, with_rally
from protocol.tools.files import write_atomically

MAX_FILES = 10


class RecentFiles:
    """Paths, newest first; those that are gone are left out.

    Args:
        file: Where they are kept, a path a line; None: only until the program ends.
    """

    def __init__(self, file: Path | None = None) -> None:
        self._file = file
        self._paths: list[str] | None = None if file is not None else []

    @property
    def paths(self) -> tuple[str, ...]:
        """The files that are there, newest first."""
        if self._paths is None:
            self._paths = self._read()
        return tuple(path for path in self._paths if Path(path).is_file())

    def add(self, path: Path | str) -> None:
        """Put a file first. A disk that fails costs the memory of it, nothing else."""
        newest = str(Path(path).expanduser().resolve())
        self._paths = [newest, *(other for other in self.paths if other != newest)][:MAX_FILES]
        if self._file is not None:
            with contextlib.suppress(FileError, OSError):
                self._file.parent.mkdir(parents=True, exist_ok=True)
                write_atomically(self._file, "\n".join(self._paths).encode())

    def _read(self) -> list[str]:
        try:
            text = self._file.read_text(encoding="utf-8") if self._file is not None else ""
        except (OSError, UnicodeDecodeError):
            return []
        return [line for line in text.splitlines() if line][:MAX_FILES]


def short_path(path: Path | str) -> str:
    """A path as short as it can be typed: below the working folder, or below the user's."""
    full = Path(path).expanduser().resolve()
    for folder, sign in ((Path.cwd(), ""), (Path.home(), "~/")):
        if full.is_relative_to(folder.resolve()):
            return f"{sign}{full.relative_to(folder.resolve())}"
    return str(full)


MAX_UNDONE = 100  # edits that can be taken back


@dataclass(kw_only=True)
class PlanDraft:
    """The plan being edited. The app owns it, so leaving the mission screen loses nothing."""

    plan: Plan = field(default_factory=Plan)
    path: str = ""
    changed: bool = False  # differs from the vehicle's plan
    saved: bool = True  # in a file, as it is
    fence: Items = ()  # of the plan
    rally: Items = ()  # of the plan
    before: list[Plan] = field(default_factory=list)  # plans before each edit, newest last
    taken_back: list[Plan] = field(default_factory=list)  # plans that ``undo`` left, newest last
    recent: RecentFiles = field(default_factory=RecentFiles, compare=False)  # opened and saved ones
    low_leg: float = LOW_LEG  # height above home below which a leg flown forward is low [m]
    begins_at: Vector | None = None  # where the mission begins, or began; NED in the vehicle's local frame [m]
    vehicle_plans: tuple[Items, ...] = ()  # the vehicle's mission, fence and rally points, as last seen

    def note_beginning(self, s: Snapshot) -> None:
        """Keep where the mission begins: its legs stay what they are once it is flown."""
        if s.mission.state not in FLOWN_MISSION:
            self.begins_at = None if s.position.p is None else beginning(s)

    def take(self, plan: Plan, path: str) -> None:
        """Begin with the plan of a file.

        Raises:
            FileError: Its fence or its rally points cannot be read; the draft stays as it was.
        """
        fence, rally = fence_items(plan), rally_items(plan)
        self.plan, self.path, self.fence, self.rally = plan, path, fence, rally
        self.before.clear()
        self.taken_back.clear()
        self.changed = self.saved = True

    def edit(self, items: Items) -> None:
        """Replace the mission's items; ``undo`` takes it back."""
        self.before = [*self.before[-MAX_UNDONE + 1 :], self.plan]
        self.taken_back.clear()
        self._become(self.plan.with_items(items))

    def edit_limits(self, kind: int, items: Items) -> None:
        """Replace fence or rally points, by MAV_MISSION_TYPE; ``undo`` takes it back.

        Raises:
            LocalProtocolError: They cannot be written to a file; the draft stays as it was.
        """
        plan = with_fence(self.plan, items) if kind == FENCE else with_rally(self.plan, items)
        self.before = [*self.before[-MAX_UNDONE + 1 :], self.plan]
        self.taken_back.clear()
        self._become(plan)

    def undo(self) -> bool:
        """Take the last edit back; False if there is none."""
        if not self.before:
            return False
        self.taken_back.append(self.plan)
        self._become(self.before.pop())
        return True

    def redo(self) -> bool:
        """Make the edit again that ``undo`` took back last; False if there is none."""
        if not self.taken_back:
            return False
        self.before.append(self.plan)
        self._become(self.taken_back.pop())
        return True

    def _become(self, plan: Plan) -> None:
        old, self.plan, self.saved = self.plan, plan, False
        if plan.geo_fence is not old.geo_fence:  # of a vehicle's fence that no file can hold the plan has none
            self.fence = fence_items(plan)
        if plan.rally_points is not old.rally_points:
            self.rally = rally_items(plan)
        self.changed = not (self.vehicle_plans and self._is_held(*self.vehicle_plans))

    def is_on_vehicle(self, s: Snapshot) -> bool:
        """True if the vehicle has all of the plan. A fence or rally points that only the vehicle has do not count."""
        mission = self.plan.items if self.leaves_mission(s) else s.plans.mission
        return self._is_held(mission, s.plans.fence, s.plans.rally)

    def leaves_mission(self, s: Snapshot) -> bool:
        """True if the vehicle's mission stays: the plan has the same, or none for a flight plan's leg."""
        return self.plan.items == s.plans.mission or (not self.plan.items and s.flight_plan is not None)

    def changes_single_items_of(self, s: Snapshot) -> bool:
        """True if the vehicle takes single items, and has the fence and the rally points of the plan."""
        is_known = s.is_darko or s.identity.autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
        return is_known and self._is_held(self.plan.items, s.plans.fence, s.plans.rally)

    def _is_held(self, mission: Items, fence: Items, rally: Items) -> bool:
        limits = ((self.fence, fence), (self.rally, rally))
        return self.plan.items == mission and all(not own or own == held for own, held in limits)

    def follow_vehicle(self, s: Snapshot) -> None:
        """Become the vehicle's plan. If it is the draft already, as after an upload, its edits can still be taken back.

        Raises:
            LocalProtocolError: The vehicle's fence cannot be written to a file; the draft follows it nevertheless.
        """
        if (self.plan.items, self.fence, self.rally) == (s.plans.mission, s.plans.fence, s.plans.rally):
            return
        plan = self.plan.with_items(s.plans.mission)
        self.before.clear()
        self.taken_back.clear()
        old, self.fence, self.rally = (self.fence, self.rally), s.plans.fence, s.plans.rally
        self.plan = plan
        if old != (s.plans.fence, s.plans.rally):
            self.plan = with_rally(with_fence(plan, s.plans.fence), s.plans.rally)

    def to_save(self, s: Snapshot) -> Plan:
        """The plan as it is saved: with the vehicle's home if it has none, for QGroundControl loads none without."""
        return self.plan if self.plan.planned_home is not None else replace(self.plan, planned_home=s.position.home)

    @property
    def limit_names(self) -> str:
        """Words for the limits of the plan: "the fence and the rally points"; empty without any."""
        return " and ".join([*(["the fence"] if self.fence else []), *(["the rally points"] if self.rally else [])])

    @property
    def is_at_risk(self) -> bool:
        """True if quitting would lose the plan: neither saved nor on the vehicle."""
        return bool(self.plan.items or self.fence or self.rally) and self.changed and not self.saved
