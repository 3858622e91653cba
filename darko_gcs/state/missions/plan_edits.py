"""Edits of a mission's list of items. Jumps keep to the item that they lead to, whatever number it gets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from darko_gcs.state.missions.plan_parts import Items
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.plans import MissionItem

TRANSITION = mavlink.MAV_CMD_DO_VTOL_TRANSITION
WAY_STATES = {
    LegMode.NONE: mavlink.MAV_VTOL_STATE_UNDEFINED,
    LegMode.HOVER: mavlink.MAV_VTOL_STATE_MC,
    LegMode.FORWARD: mavlink.MAV_VTOL_STATE_FW,
}  # param1 of DO_VTOL_TRANSITION; undefined leaves the choice to the vehicle again
WAY_OF_STATE = {float(state): leg_mode for leg_mode, state in WAY_STATES.items()}
LEG_ENDS = frozenset(
    {
        mavlink.MAV_CMD_NAV_WAYPOINT,
        mavlink.MAV_CMD_NAV_LOITER_TIME,
        mavlink.MAV_CMD_NAV_LOITER_TURNS,
        mavlink.MAV_CMD_NAV_LOITER_UNLIM,
        mavlink.MAV_CMD_NAV_LOITER_TO_ALT,
        mavlink.MAV_CMD_NAV_LAND,
        mavlink.MAV_CMD_NAV_VTOL_LAND,
        mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH,
    }
)  # commands to which a leg leads that may be flown either way


def replaced(items: Items, row: int, item: MissionItem) -> Items:
    """Another item in the place of one."""
    return (*items[:row], item, *items[row + 1 :])


def inserted(items: Items, row: int, new: Sequence[MissionItem]) -> Items:
    """New items before the one of a row; at the end if there is none."""
    return _renumbered([*enumerate(items[:row]), *((None, item) for item in new), *enumerate(items[row:], row)])


def removed(items: Items, row: int) -> Items:
    """Without the item of a row; jumps to it lead to the next one."""
    return _renumbered([(seq, item) for seq, item in enumerate(items) if seq != row])


def moved(items: Items, row: int, to: int) -> Items:
    """The item of a row in another one."""
    rest = [(seq, item) for seq, item in enumerate(items) if seq != row]
    return _renumbered([*rest[:to], (row, items[row]), *rest[to:]])


def asked_ways(items: Items) -> tuple[LegMode, ...]:
    """Flight state (hover or forward) that the plan asks for on the leg to each item."""
    ways, leg_mode = [], LegMode.NONE
    for item in items:
        if item.command == TRANSITION:
            leg_mode = WAY_OF_STATE.get(item.params[0], leg_mode)
        ways.append(leg_mode)
    return tuple(ways)


def with_way(items: Items, row: int, leg_mode: LegMode) -> tuple[Items, int]:
    """The mission with another way of flying the leg to one item; all other legs keep theirs.

    Transition items are put in and taken out as needed.

    Returns:
        The items, and the row of the item now.
    """
    ways = list(asked_ways(items))
    ways[row] = leg_mode
    kept: list[tuple[int | None, MissionItem]] = []
    present, new_row = LegMode.NONE, row
    for seq, item in enumerate(items):
        if item.command == TRANSITION and item.params[0] in WAY_OF_STATE:
            continue
        if item.command in LEG_ENDS and ways[seq] != present:
            present = ways[seq]
            kept.append((_transition_before(items, seq), _transition(present)))
        if seq == row:
            new_row = len(kept)
        kept.append((seq, item))
    return _renumbered(kept), new_row


def _transition_before(items: Items, seq: int) -> int | None:
    """Number of a transition directly before an item, to which jumps may lead."""
    return seq - 1 if seq and items[seq - 1].command == TRANSITION else None


def _transition(leg_mode: LegMode) -> MissionItem:
    params = (float(WAY_STATES[leg_mode]), 0.0, 0.0, 0.0)
    return MissionItem(command=TRANSITION, frame=mavlink.MAV_FRAME_MISSION, params=params, x=0, y=0, z=0.0)


def _renumbered(kept: Sequence[tuple[int | None, MissionItem]]) -> Items:
    """The items with their jumps to the new numbers; each comes with its old number, None for a new one."""
    old = [seq for seq, _ in kept if seq is not None]
    number = {seq: place for place, (seq, _) in enumerate(kept) if seq is not None}

    def led(item: MissionItem) -> MissionItem:
        if item.command != mavlink.MAV_CMD_DO_JUMP or not item.params[0] >= 0.0:
            return item
        target = next((number[seq] for seq in sorted(old) if seq >= item.params[0]), None)
        return item if target is None else replace(item, params=(float(target), *item.params[1:]))

    return tuple(item if seq is None else led(item) for seq, item in kept)
