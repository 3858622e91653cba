"""Flight plans as a user names them: a file, and a file of what its names mean."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from protocol.errors import ProtocolError
from protocol.flight_plans import load_flight_plan
from protocol.flight_plans.plan_check import PlanCheck, check_flown
from protocol.flight_plans.plan_names import NameMapping, load_name_mapping
from protocol.frames import Geodetic
from sitl.errors import SitlError

__all__ = ["CheckedPlan", "load_checked_plan"]


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
