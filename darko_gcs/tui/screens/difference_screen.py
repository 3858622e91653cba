"""Differences of the plan that is edited from the vehicle's and from the file's, item by item and field by field."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical, VerticalScroll
from textual.widgets import Label, Static

from darko_gcs.state.missions.plan_difference import change_text, plan_changes
from darko_gcs.state.missions.plan_parts import Items
from darko_gcs.tui.screens.station_screen import Dialog
from protocol.plans import load
from protocol.plans.fence_rally import fence_items, rally_items

PlanPair = tuple[str, Items, Items]  # what is compared, in words; the old plan, the new one


class DifferenceScreen(Dialog[None]):
    """Changed (~), added (+) and removed (-) items; the arrows and page keys scroll.

    Args:
        pairs: Plans to compare.
    """

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape,equals_sign,q", "dismiss", "Close")]

    def __init__(self, pairs: Sequence[PlanPair]) -> None:
        super().__init__()
        self._pairs = pairs

    def compose(self) -> ComposeResult:
        """A section for each pair."""
        lines: list[str] = []
        for title, old, new in self._pairs:
            changes = plan_changes(old, new)
            lines += [title, *(f"  {change_text(change)}" for change in changes)]
            lines += [] if changes else ["  the same"]
            lines.append("")
        with Vertical(classes="dialog help"):
            yield Label("Differences: ~ changed, + added, - removed", id="question", markup=False)
            with VerticalScroll():
                yield Static("\n".join(lines), markup=False)
            yield Static("Up/Down/PgUp/PgDn: scroll    Esc: close", classes="hint")

    def on_mount(self) -> None:
        """Let the keys scroll."""
        self.query_one(VerticalScroll).focus()


def file_pairs(path: str, own: tuple[Items, Items, Items]) -> list[PlanPair]:
    """Pairs to compare: a file's mission, fence and rally points with those of the plan that is edited.

    Raises:
        FileError: The file cannot be read; the message names it.
    """
    plan = load(Path(path).expanduser())
    held, names = (plan.items, fence_items(plan), rally_items(plan)), ("", ", fence", ", rally points")
    return [
        (f"From the file {path}{name} to this plan", old, new)
        for name, old, new in zip(names, held, own, strict=True)
        if old or new
    ]
