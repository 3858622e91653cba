"""Touching: whether a point of the vehicle is in an obstacle, or in the net."""

from __future__ import annotations

from sitl.compiled import kernel, subroutine
from sitl.enclosure.arena_files import NET, PILLAR
from sitl.model.airframe import Airframe, Array
from sitl.model.ground import foot, nose, wing_tip
from sitl.model.quaternions import rotate
from sitl.model.state import Body
from sitl.model.vectors import Vector, add

SKIN = 0.06  # obstacles are felt from so far, since the vehicle is more than its ten points [m]


@kernel
def _is_in(p: Vector, row: Array) -> bool:
    """Whether a point, world NWU, is in a solid."""
    x, y = p.x - row[1], p.y - row[2]
    ahead, left = x * row[3] + y * row[4], y * row[3] - x * row[4]
    if row[0] == NET:
        return bool(abs(ahead) > row[5] or abs(left) > row[6] or p.z > row[8])
    if p.z < row[7] - SKIN or p.z > row[8] + SKIN:
        return False
    if row[0] == PILLAR:
        reach = row[5] + SKIN
        return bool(ahead * ahead + left * left < reach * reach)
    return bool(abs(ahead) < row[5] + SKIN and abs(left) < row[6] + SKIN)


@subroutine
def _meets(body: Body, at: Vector, row: Array) -> bool:
    return _is_in(add(body.position, rotate(body.attitude, at)), row)


@subroutine
def touched(body: Body, a: Airframe, solids: Array) -> int:
    """The number, from 1, of the solid that the vehicle touches; 0: none.

    Args:
        body: Where it is.
        a: The airframe: its nose, its wing and its feet touch.
        solids: Rows as of :func:`sitl.enclosure.arena_files.solids`, (n, 9).
    """
    for i in range(solids.shape[0]):
        row = solids[i]
        hit = _meets(body, Vector(0.0, 0.0, 0.0), row) or _meets(body, nose(a), row)
        for side in (-1.0, 1.0):
            hit = hit or _meets(body, wing_tip(side, a), row) or _meets(body, wing_tip(0.5 * side, a), row)
            hit = hit or _meets(body, foot(side, 1.0, a), row) or _meets(body, foot(side, -1.0, a), row)
        if hit:
            return i + 1
    return 0
