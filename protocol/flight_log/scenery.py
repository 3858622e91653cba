"""Obstacles around a flight, for its picture: prisms of any footprint."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Prism"]


@dataclass(frozen=True, slots=True)
class Prism:
    """A solid, or a room of which only the edges are drawn."""

    name: str
    corners: tuple[tuple[float, float], ...]  # north, east [m], in order
    bottom: float  # above the origin [m]
    top: float  # [m]
    hollow: bool = False  # only its edges are drawn: an arena, a net
