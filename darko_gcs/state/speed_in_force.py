"""The speed that is asked of the vehicle now: by the operator, the mission, or the vehicle's own parameter."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.values import SpeedOrder
from protocol.dialect import mavlink
from protocol.ranges import MIN_AIRSPEED

CRUISE_STATES = frozenset({mavlink.MAV_VTOL_STATE_FW, mavlink.MAV_VTOL_STATE_TRANSITION_TO_FW})
HOVER_PARAMETER, CRUISE_PARAMETER = "DRK_HOV_VMAX", "DRK_FWD_SPEED"
OTHER_FLIGHT = frozenset(
    {
        mavlink.MAV_CMD_NAV_TAKEOFF,
        mavlink.MAV_CMD_NAV_LAND,
        mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH,
        mavlink.MAV_CMD_DO_REPOSITION,
        mavlink.MAV_CMD_DO_VTOL_TRANSITION,
        mavlink.MAV_CMD_DO_SET_MODE,
        mavlink.MAV_CMD_MISSION_START,
    }
)  # commands after which a speed that was commanded before holds no more


class SpeedInForce(NamedTuple):
    """A speed, and who asked for it."""

    speed: float  # [m/s]
    over_ground: bool
    source: str  # in words


def asked_speed(s: Snapshot, kind: float, speed: float) -> Snapshot:
    """The snapshot after a speed was commanded, by SPEED_TYPE and [m/s]."""
    if kind not in {mavlink.SPEED_TYPE_AIRSPEED, mavlink.SPEED_TYPE_GROUNDSPEED}:
        return s
    order = SpeedOrder(speed, over_ground=kind == mavlink.SPEED_TYPE_GROUNDSPEED)
    return s._replace(operator=s.operator._replace(speed_asked=order))


def accepted_command(s: Snapshot, command: int) -> Snapshot:
    """The snapshot after the vehicle accepted a MAV_CMD: a new speed, or another flight, which has its own."""
    if command in OTHER_FLIGHT:
        return s._replace(operator=s.operator._replace(speed_order=None))
    asked = s.operator.speed_asked
    if command != mavlink.MAV_CMD_DO_CHANGE_SPEED or asked is None:
        return s
    order = asked._replace(mode=s.status.mode, item=s.mission.current)
    return s._replace(operator=s.operator._replace(speed_order=order, speed_asked=None))


def speed_in_force(s: Snapshot) -> SpeedInForce | None:
    """The speed that the vehicle is to fly at now, in the hover or in forward flight; None where nobody tells one."""
    is_ours = s.hybrid.state is not None
    is_cruise = s.status.vtol_state in CRUISE_STATES

    def holds(speed: float) -> bool:
        return not is_ours or speed <= 0.0 or (speed >= MIN_AIRSPEED) == is_cruise

    asked = filter(None, (_commanded(s, holds), _planned(s, holds)))
    newest = max(asked, key=lambda order: -1 if order.item is None else order.item, default=None)
    if newest is not None and newest.speed > 0.0:
        by = f"item {newest.item}" if newest.mode is None else "command"
        return SpeedInForce(newest.speed, newest.over_ground or (is_ours and not is_cruise), by)
    name = CRUISE_PARAMETER if is_cruise else HOVER_PARAMETER
    own = s.parameters.values.get(name)
    return None if own is None or not is_ours else SpeedInForce(own, not is_cruise, name)


def speed_words(speed: SpeedInForce) -> str:
    """A speed with who asked for it: "12 m/s over ground, item 3"."""
    return f"{speed.speed:g} m/s{' over ground' * speed.over_ground}, {speed.source}"


def _commanded(s: Snapshot, holds: Callable[[float], bool]) -> SpeedOrder | None:
    order = s.operator.speed_order
    return order if order is not None and order.mode == s.status.mode and holds(order.speed) else None


def _planned(s: Snapshot, holds: Callable[[float], bool]) -> SpeedOrder | None:
    """The last speed of the mission's items up to the current one, while it is flown."""
    if s.mission.state != mavlink.MISSION_STATE_ACTIVE or s.mission.current is None:
        return None
    asked = [
        SpeedOrder(item.params[1], over_ground=item.params[0] == mavlink.SPEED_TYPE_GROUNDSPEED, item=seq)
        for seq, item in enumerate(s.plans.mission[: s.mission.current])
        if item.command == mavlink.MAV_CMD_DO_CHANGE_SPEED and item.params[0] in {0.0, 1.0} and item.params[1] != -1.0
    ]
    return next((order for order in reversed(asked) if holds(order.speed)), None)
