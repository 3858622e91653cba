"""A command that missions are made of, as the operator reads it."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["MissionCommand", "Params"]

Params = tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class MissionCommand:
    """A command that missions are made of. A parameter without a name is not used."""

    command: int  # MAV_CMD
    label: str
    params: tuple[str, str, str, str]  # names of param1 to param4
    defaults: Params
    has_place: bool = True
