"""Set-points of the guided mode, which a stage or a call gives: each of four values as the flags say."""

from __future__ import annotations

import math
from collections.abc import Sequence

from protocol.flight_plans.flight_plan import EnuPoint
from sitl.autopilot.flight_plan.aims import Aim
from sitl.autopilot.flight_plan.operator_view import AimKind
from sitl.autopilot.flight_plan.plan_state import PlanState

__all__ = ["guided_aim"]

XY_OFFSET, XY_BODY, Z_OFFSET, YAW_OFFSET, XY_SPEED, Z_SPEED, YAW_RATE = 1, 2, 4, 8, 32, 64, 128


def guided_aim(state: PlanState, flags: int, values: Sequence[float]) -> Aim:
    """The aim of a set-point; offsets count from where the vehicle is now.

    Args:
        state: Of the plan in flight; its heading is set unless the flags say a rate.
        flags: GUIDED_FLAG_...
        values: North, east, down [m or m/s] and yaw [rad or rad/s].
    """
    north, east, down, yaw = values
    view, p = state.inputs.view, state.p
    if flags & XY_BODY:
        psi = -view.heading
        north, east = (
            north * math.cos(psi) - east * math.sin(psi),
            north * math.sin(psi) + east * math.cos(psi),
        )
    turn_rate = yaw if flags & YAW_RATE else 0.0
    if not flags & YAW_RATE:
        state.memory.heading = (-view.heading if flags & YAW_OFFSET else 0.0) + yaw
    z = p.z - down if flags & Z_OFFSET else -down
    climb = -down if flags & Z_SPEED else None
    moved = bool(flags & (XY_OFFSET | XY_BODY))
    if flags & XY_SPEED:
        aim = Aim(AimKind.VELOCITY, start=EnuPoint(0.0, 0.0, z), end=EnuPoint(east, north, z))
    else:
        to = EnuPoint(east + (p.x if moved else 0.0), north + (p.y if moved else 0.0), z)
        aim = Aim(AimKind.POINT, end=to)
    return aim._replace(climb=climb, turn_rate=turn_rate)
