"""Findings about a plan: its refusals, the parts that are left out, and the blocks that a refusal locks."""

from __future__ import annotations

from dataclasses import dataclass

from protocol.flight_plans.flight_plan import FlightPlan
from protocol.flight_plans.place import FlightPlanError, Place

__all__ = ["Finding", "PlanCheck"]


@dataclass(frozen=True, slots=True)
class Finding:
    """One construct that is not flown as it stands."""

    place: Place
    construct: str
    reason: str
    block: str | None = None  # None: outside of blocks
    is_refusal: bool = True
    leaves_out: Place | None = None  # of the statement, stage or exception that is passed over

    def __str__(self) -> str:
        return f"{self.place}: {self.construct}: {self.reason}"


@dataclass(frozen=True, slots=True)
class PlanCheck:
    """Findings about a plan."""

    plan: FlightPlan
    findings: tuple[Finding, ...]
    adopted: frozenset[str] = frozenset()  # variables of a build that are kept as the plan's own

    @property
    def left_out(self) -> frozenset[Place]:
        """The statements, stages and exceptions that are passed over."""
        return frozenset(finding.leaves_out for finding in self.findings if finding.leaves_out is not None)

    @property
    def refusals(self) -> tuple[Finding, ...]:
        """Findings that refuse a part of the plan: it is not flown."""
        return tuple(finding for finding in self.findings if finding.is_refusal)

    @property
    def notices(self) -> tuple[Finding, ...]:
        """Findings about parts that are left out without harm."""
        return tuple(finding for finding in self.findings if not finding.is_refusal)

    @property
    def locked_blocks(self) -> dict[str, Finding]:
        """Blocks that are not flown, each with its first refusal."""
        locked: dict[str, Finding] = {}
        for finding in self.refusals:
            if finding.block is not None:
                locked.setdefault(finding.block, finding)
        return locked

    def require_flown(self) -> None:
        """Refuse a plan that cannot be flown at all.

        Raises:
            FlightPlanError: Something outside of blocks is refused, or every block is.
        """
        for finding in self.refusals:
            if finding.block is None or len(self.locked_blocks) == len(self.plan.blocks):
                raise FlightPlanError(finding.place, f"{finding.construct}: {finding.reason}")
