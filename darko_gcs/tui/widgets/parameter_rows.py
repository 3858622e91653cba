"""Rows of parameters, as text in cells: those of the vehicle, and how they differ from a file."""

from __future__ import annotations

import math
from collections.abc import Collection

from darko_gcs.state.parameter_change import ChangeState
from darko_gcs.state.parameter_table import Difference, is_changed, metadata_of
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import printable
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.widgets.panel import styled_line
from darko_gcs.tui.widgets.row_list import padded

MARKS, NAME, UNIT, DEFAULT = 3, 16, 6, 18  # widths [cells]
NARROW_VALUE, VALUE = 20, 28
WIDE_FROM = 110  # narrower lists have no column for the default [cells]
CHANGE_MARKS = {ChangeState.WAITING: "…", ChangeState.REFUSED: "!", ChangeState.SET: " "}
CHANGE_STYLES = {ChangeState.WAITING: "dim", ChangeState.REFUSED: "warn", ChangeState.SET: "good"}


def parameter_heading(width: int) -> StyledLine:
    """Names of the columns."""
    return [(_cells(width, "", "name", "value", "unit", "default", "description"), "label")]


def parameter_row(s: Snapshot, name: str, favourites: Collection[str], width: int) -> StyledLine:
    """One parameter: marks of a favourite, of a value that is not the default and of a change, then its cells."""
    metadata = metadata_of(s, name)
    change = s.parameter_changes.get(name)
    changed = is_changed(s, name)
    marks = ("★" if name in favourites else " ") + ("*" if changed else " ")
    marks += CHANGE_MARKS[change.state] if change is not None else " "
    default = "" if math.isnan(metadata.default) else metadata.shown(metadata.default)
    value = metadata.shown(s.parameters[name])
    text = _cells(width, marks, printable(name), value, metadata.unit, default, metadata.text)
    is_refused = change is not None and change.state is ChangeState.REFUSED
    return styled_line((text, "warn" if is_refused else "accent" if changed else ""))


def _cells(width: int, marks: str, name: str, value: str, unit: str, default: str, text: str) -> str:
    is_wide = width >= WIDE_FROM
    cells = [padded(marks, MARKS), padded(name, NAME), padded(value, VALUE if is_wide else NARROW_VALUE)]
    cells.append(padded(unit, UNIT))
    if is_wide:
        cells.append(padded(default, DEFAULT))
    used = sum(map(len, cells)) + len(cells)
    return " ".join([*cells, padded(text, max(0, width - used))])


def difference_heading(width: int, other: str) -> StyledLine:
    """Names of the columns of a comparison."""
    return [(_compared(width, "", "name", other, "vehicle", ""), "label")]


def difference_row(s: Snapshot, each: Difference, width: int, *, is_chosen: bool) -> StyledLine:
    """One difference: whether it is chosen, what the file and the vehicle have, and what became of a change."""
    metadata, change = metadata_of(s, each.name), s.parameter_changes.get(each.name)
    vehicle = s.parameters.get(each.name)
    here = "missing" if vehicle is None else metadata.shown(vehicle)
    is_ours = change is not None and change.value == each.other
    state = change.words if change is not None and is_ours else ""
    style = CHANGE_STYLES[change.state] if change is not None and is_ours else "dim" if vehicle is None else ""
    box = "   " if vehicle is None else "[x]" if is_chosen else "[ ]"
    return styled_line((_compared(width, box, printable(each.name), metadata.shown(each.other), here, state), style))


def _compared(width: int, box: str, name: str, other: str, vehicle: str, state: str) -> str:
    value_width = max(10, (width - MARKS - NAME - 5) * 3 // 10)
    cells = [padded(box, MARKS), padded(name, NAME), padded(other, value_width), padded(vehicle, value_width)]
    used = sum(map(len, cells)) + len(cells)
    return " ".join([*cells, padded(state, max(0, width - used))])
