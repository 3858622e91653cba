"""The vehicle's flight plan as the ground station knows it: its table, where it is, and what happened in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from protocol.frames import Geodetic, Vector


class PlanButton(NamedTuple):
    """A block, to which the operator may jump (DARKO_PLAN_BLOCK)."""

    number: int
    name: str
    label: str  # of its button; its name if the plan gives none
    key: str  # that the plan gives it; empty: none
    group: str
    locked: str  # why it is not flown; empty: it is
    has_button: bool


class PlanPoint(NamedTuple):
    """A waypoint where it is now (DARKO_PLAN_WAYPOINT)."""

    number: int
    name: str
    position: Vector  # east, north and up of the plan's origin [m]
    place: Geodetic | None
    is_shown: bool  # whether the plan lets an operator drag it


class PlanSetting(NamedTuple):
    """A variable (DARKO_PLAN_VARIABLE); NaN for a limit that there is not."""

    number: int
    name: str
    label: str
    value: float
    low: float
    high: float
    step: float
    unit: str


class PlanArea(NamedTuple):
    """A sector (DARKO_PLAN_SECTOR)."""

    number: int
    name: str
    corners: tuple[int, ...]  # numbers of waypoints
    is_fence: bool  # the plan stays inside


class PlanHappening(NamedTuple):
    """Something that happened (DARKO_PLAN_EVENT)."""

    number: int
    time: float  # since boot [s]
    kind: int  # PlanEventKind
    line: int  # in the plan's file; 0: none
    from_block: int
    to_block: int
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightPlanState:
    """One plan. Tables are by number; they fill while the plan is downloaded."""

    plan_id: int
    entries: int = 0  # that its table has
    name: str = ""
    block: int = 0  # in force
    stage: int = 0
    line: int = 0  # of the stage in the plan's file; 0: none
    stage_text: str = ""
    aim: int = 0  # PlanAim
    block_time: float = 0.0  # [s]
    stage_time: float = 0.0  # [s]
    flight_time: float = 0.0  # [s]
    blocks: Mapping[int, PlanButton] = field(default_factory=dict)
    points: Mapping[int, PlanPoint] = field(default_factory=dict)
    settings: Mapping[int, PlanSetting] = field(default_factory=dict)
    areas: Mapping[int, PlanArea] = field(default_factory=dict)
    happenings: tuple[PlanHappening, ...] = ()  # oldest first

    @property
    def received(self) -> int:
        """Entries of the table that have arrived."""
        return len(self.blocks) + len(self.points) + len(self.settings) + len(self.areas)

    @property
    def is_complete(self) -> bool:
        """True once all of the table has arrived."""
        return self.received >= self.entries

    def block_name(self, number: int) -> str:
        """The name of a block, or its number until that is known."""
        return self.blocks[number].name if number in self.blocks else f"block {number}"
