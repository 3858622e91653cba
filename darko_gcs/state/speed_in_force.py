"""The speed that is asked of the vehicle now: by the operator, the mission, or the vehicle's own parameter."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.values import SpeedOrder
from protocol.dialect import mavlink
from protocol.ranges import MAX_AIRSPEED, MIN_AIRSPEED, MIN_SPEED

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
    is_ours = s.is_darko
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


def flown_speeds(s: Snapshot) -> str:
    """The speeds that a DarkO flies, in words: "0.1 to 3 in the hover, 7 to 22 forward; now 3 and 15"."""
    if not (_is_mission_flown(s) or s.status.vtol_state not in CRUISE_STATES):
        return f"{MIN_AIRSPEED:g} to {MAX_AIRSPEED:g}, as it flies forward; the hover's speed is asked for in the hover"
    later = ", from the next leg on" if is_for_later_legs(s, MIN_AIRSPEED) else ""
    hover, cruise = (s.parameters.values.get(name) for name in (HOVER_PARAMETER, CRUISE_PARAMETER))
    slow = f"up to {HOVER_PARAMETER}" if hover is None else f"{MIN_SPEED:g} to {hover:g}"
    now = "" if hover is None or cruise is None else f"; now {hover:g} and {cruise:g}"
    return f"{slow} in the hover, {MIN_AIRSPEED:g} to {MAX_AIRSPEED:g} forward{later}{now}"


def is_for_later_legs(s: Snapshot, speed: float) -> bool:
    """Whether a speed [m/s] is one of forward legs to come: a DarkO that hovers keeps it as its parameter.

    A mission takes both speeds at any time.
    """
    hovers = s.status.vtol_state == mavlink.MAV_VTOL_STATE_MC
    return s.is_darko and hovers and speed >= MIN_AIRSPEED and not _is_mission_flown(s)


def speed_problem(s: Snapshot, speed: float, *, over_ground: bool) -> str:
    """The reason why a DarkO would refuse a speed [m/s] now; empty if it would not."""
    if not s.is_darko:
        return ""
    if is_between_speeds(s, speed):
        return f"{speed:g} m/s is too fast for the hover and too slow for forward flight"
    if is_for_later_legs(s, speed) and over_ground:
        return "Of legs to come only the airspeed can be chosen"
    if s.status.vtol_state in CRUISE_STATES and speed < MIN_AIRSPEED and not _is_mission_flown(s):
        return f"{speed:g} m/s is a speed of the hover, and it flies forward"
    return ""


def _is_mission_flown(s: Snapshot) -> bool:
    return s.mission.state == mavlink.MISSION_STATE_ACTIVE


def is_between_speeds(s: Snapshot, speed: float) -> bool:
    """Whether a speed [m/s] is too fast for the hover of a DarkO and too slow for its wing."""
    hover = s.parameters.values.get(HOVER_PARAMETER)
    return s.is_darko and hover is not None and hover < speed < MIN_AIRSPEED


def _commanded(s: Snapshot, holds: Callable[[float], bool]) -> SpeedOrder | None:
    order = s.operator.speed_order
    return order if order is not None and order.mode == s.status.mode and holds(order.speed) else None


def _planned(s: Snapshot, holds: Callable[[float], bool]) -> SpeedOrder | None:
    """The last speed of the mission's items up to the current one, while it is flown."""
    if not _is_mission_flown(s) or s.mission.current is None:
        return None
    asked = [
        SpeedOrder(item.params[1], over_ground=item.params[0] == mavlink.SPEED_TYPE_GROUNDSPEED, item=seq)
        for seq, item in enumerate(s.plans.mission[: s.mission.current])
        if item.command == mavlink.MAV_CMD_DO_CHANGE_SPEED and item.params[0] in {0.0, 1.0} and item.params[1] != -1.0
    ]
    return next((order for order in reversed(asked) if holds(order.speed)), None)
