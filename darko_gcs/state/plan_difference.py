"""Differences of two plans: items changed, added and removed, with the fields that differ."""

from __future__ import annotations

import math
from dataclasses import dataclass
from difflib import SequenceMatcher
from enum import Enum

from darko_gcs.state.fence_edits import CIRCLE_IN, CIRCLE_OUT, STAY_IN, STAY_OUT
from darko_gcs.state.fence_shapes import CIRCLE_STATES
from darko_gcs.state.mission_items import FRAME_LABELS, coordinate_texts, field_text, item_summary, mission_command_of
from darko_gcs.state.values import PLAN_TITLES, Items
from protocol.names import is_global_frame
from protocol.plans import MissionItem

MAX_CHANGES_LISTED = 3  # of a plan that was read back


class Kind(Enum):
    """Kind of an item's change; the value is its sign."""

    CHANGED = "~"
    ADDED = "+"
    REMOVED = "-"


@dataclass(frozen=True, kw_only=True)
class ItemChange:
    """One item that differs between an old and a new plan."""

    kind: Kind
    old_seq: int | None  # None: only in the new plan
    new_seq: int | None  # None: only in the old plan
    fields: tuple[str, ...]  # what differs, "alt 3 -> 5"; of an item in one plan only, what it is


def plan_changes(old: Items, new: Items) -> tuple[ItemChange, ...]:
    """Items changed, added and removed from an old plan to a new one, in the order of the new one."""
    changes: list[ItemChange] = []
    for tag, i, i_end, j, j_end in SequenceMatcher(None, old, new, autojunk=False).get_opcodes():
        if tag == "equal":
            continue
        paired = min(i_end - i, j_end - j)
        for k in range(paired):
            fields = field_differences(old[i + k], new[j + k])
            changes.append(ItemChange(kind=Kind.CHANGED, old_seq=i + k, new_seq=j + k, fields=fields))
        changes += [
            ItemChange(kind=Kind.REMOVED, old_seq=seq, new_seq=None, fields=(_item_text(old[seq]),))
            for seq in range(i + paired, i_end)
        ]
        changes += [
            ItemChange(kind=Kind.ADDED, old_seq=None, new_seq=seq, fields=(_item_text(new[seq]),))
            for seq in range(j + paired, j_end)
        ]
    return tuple(changes)


def changed_range(old: Items, new: Items) -> range | None:
    """Numbers from the first to the last changed item; None if the plans differ in length or not at all."""
    differing = [seq for seq, (before, after) in enumerate(zip(old, new, strict=False)) if before != after]
    return range(differing[0], differing[-1] + 1) if differing and len(old) == len(new) else None


def item_now(old: Items, new: Items, seq: int) -> int | None:
    """Number of an old plan's item in a new plan, also if it was changed; None if it is not there any more."""
    for tag, i, i_end, j, j_end in SequenceMatcher(None, old, new, autojunk=False).get_opcodes():
        if i <= seq < i_end:
            return j + seq - i if tag in {"equal", "replace"} and j + seq - i < j_end else None
    return None


def field_differences(old: MissionItem, new: MissionItem) -> tuple[str, ...]:
    """The fields that differ, "alt 3 -> 5"."""
    pairs = dict.fromkeys((*_fields(old), *_fields(new)))
    before, after = _fields(old), _fields(new)
    shown = ((name, before.get(name, "none"), after.get(name, "none")) for name in pairs)
    texts = tuple(f"{name} {was} -> {now}" for name, was, now in shown if was != now)
    return texts or _bit_differences(old, new)


def change_text(change: ItemChange) -> str:
    """One line: "~ 3  alt 3 -> 5"."""
    seq = change.old_seq if change.new_seq is None else change.new_seq
    was = "" if change.kind is not Kind.CHANGED or change.old_seq == change.new_seq else f" (was {change.old_seq})"
    return f"{change.kind.value} {seq}{was}  {', '.join(change.fields)}"


def _fields(item: MissionItem) -> dict[str, str]:
    kind = mission_command_of(item)
    names = [name.split(" [")[0].split(",")[0].lower() or f"param{n}" for n, name in enumerate(kind.params, 1)]
    place = ("lat", "lon", "alt") if is_global_frame(item.frame) else ("x", "y", "z")
    values = (*coordinate_texts(item), field_text(item.z))
    return {
        "command": kind.label,
        "frame": FRAME_LABELS.get(item.frame, str(item.frame)),
        **dict(zip(names, map(field_text, item.params), strict=True)),
        **(dict(zip(place, values, strict=True)) if kind.has_place else {}),
        "autocontinue": "on" if item.autocontinue else "off",
    }


def _bit_differences(old: MissionItem, new: MissionItem) -> tuple[str, ...]:
    """Differences that rounded texts do not show, and those of fields that the command does not use."""
    raw = {"frame": (old.frame, new.frame), "x": (old.x, new.x), "y": (old.y, new.y), "z": (old.z, new.z)}
    raw |= {f"param{n}": pair for n, pair in enumerate(zip(old.params, new.params, strict=True), 1)}
    return tuple(f"{name} {was:.10g} -> {now:.10g}" for name, (was, now) in raw.items() if not _is_same(was, now))


def _is_same(a: float, b: float) -> bool:
    return a == b or (math.isnan(a) and math.isnan(b))


LIMIT_WORDS = {
    STAY_IN: "corner of an area to stay inside",
    STAY_OUT: "corner of an area to stay outside",
    CIRCLE_IN: "circle to stay inside",
    CIRCLE_OUT: "circle to stay outside",
}


def _item_text(item: MissionItem) -> str:
    shown = _fields(item)
    if item.command in LIMIT_WORDS:
        radius = f", r {field_text(item.params[0])} m" if item.command in CIRCLE_STATES else ""
        return f"{LIMIT_WORDS[item.command]}{radius}  {' '.join(coordinate_texts(item))}"
    place = [f"{name} {shown[name]}" for name in ("lat", "lon", "alt", "x", "y", "z") if name in shown]
    return " ".join(part for part in (shown["command"], item_summary(item), *place) if part)


def read_back_fault(kind: int, sent: Items, held: Items) -> str:
    """Difference of the vehicle's plan of a MAV_MISSION_TYPE from the plan that was sent; empty if there is none."""
    changes = plan_changes(sent, held)
    if not changes:
        return ""
    listed = [change_text(change) for change in changes[:MAX_CHANGES_LISTED]]
    more = f"; {len(changes) - len(listed)} more" if len(changes) > len(listed) else ""
    return f"{PLAN_TITLES[kind]} read back: the vehicle holds something else: {'; '.join(listed)}{more}"
