"""A file of parameters beside the vehicle's: what differs is chosen and set, and each refusal is shown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.widgets import Label, Static

from darko_gcs.state.parameter_change import ChangeState
from darko_gcs.state.parameter_table import Difference
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.station.station import Station
from darko_gcs.tui.reachability import why_unreachable
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.screens.station_screen import Dialog
from darko_gcs.tui.widgets.parameter_rows import difference_heading, difference_row
from darko_gcs.tui.widgets.row_list import RowList

KEYS = "Space: choose   a: all or none   Enter: set on the vehicle   Esc: close"


class ComparisonScreen(Dialog[None]):
    """Differences between a file and the vehicle; all that the vehicle has are chosen at first.

    Args:
        title: Names the file.
        rows: What differs.
        s: The vehicle as it is now.
        station: Sets parameters; None in a recording.
        clock: The station's [s].
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "dismiss", "Close"),
        Binding("enter", "load", "Set the chosen ones"),
        Binding("space", "choose", "Choose"),
        Binding("a", "choose_all", "All or none"),
        Binding("up", "move(-1)", show=False),
        Binding("down", "move(1)", show=False),
        Binding("pageup", "page(-1)", show=False),
        Binding("pagedown", "page(1)", show=False),
    ]

    def __init__(
        self, title: str, rows: Sequence[Difference], s: Snapshot, station: Station | None, clock: Callable[[], float]
    ) -> None:
        super().__init__()
        self._title, self._s, self._station, self._clock = title, s, station, clock
        self._rows = {row.name: row for row in rows}
        self._known = frozenset(row.name for row in rows if row.vehicle is not None)
        self.chosen = self._known
        self._sent: frozenset[str] = frozenset()
        self.table = RowList(lambda width: difference_heading(width, "file"), self._draw_row, id="differences")
        self._status = Static(id="difference-status", markup=False)

    def compose(self) -> ComposeResult:
        """Title, rows, the chosen row's state, keys."""
        with Vertical(classes="dialog comparison"):
            yield Label(self._title, id="question", markup=False)
            yield self.table
            yield self._status
            yield Static(KEYS, classes="hint", markup=False)

    def on_mount(self) -> None:
        """Fill the list."""
        self.table.show(tuple(self._rows))
        self._tell()

    def follow(self, s: Snapshot) -> None:
        """Show the vehicle as it is now."""
        is_same = s.parameters is self._s.parameters and s.parameter_changes is self._s.parameter_changes
        self._s = s
        if self.is_mounted and not is_same:
            self.table.redraw()
            self._tell()

    def on_row_list_moved(self) -> None:
        """Tell about the row under the cursor."""
        self._tell()

    def action_move(self, rows: int) -> None:
        """Move the cursor."""
        self.table.move(rows)

    def action_page(self, pages: int) -> None:
        """Move the cursor by pages."""
        self.table.move_page(pages)

    def action_choose(self) -> None:
        """Choose the row under the cursor, or no longer."""
        if self.table.key in self._known:
            self._choose(self.chosen ^ {self.table.key})

    def action_choose_all(self) -> None:
        """Choose all, or none if all are chosen."""
        self._choose(frozenset() if self.chosen == self._known else self._known)

    def action_load(self) -> None:
        """Set the chosen ones on the vehicle."""
        reason = why_unreachable(self._station, self._s) or ("" if self.chosen else "Nothing is chosen")
        if reason:
            self.app.notify(reason, severity="warning")
        elif self._station is not None:
            self._sent |= self.chosen
            self._station.set_parameters({name: self._rows[name].other for name in sorted(self.chosen)}, self._clock())
            self._choose(frozenset())

    def _choose(self, names: frozenset[str]) -> None:
        self.chosen = names
        self.table.redraw()
        self._tell()

    def _draw_row(self, name: str, width: int) -> StyledLine:
        return difference_row(self._s, self._rows[name], width, is_chosen=name in self.chosen)

    def _tell(self) -> None:
        changes = [self._s.parameter_changes[name] for name in self._sent if name in self._s.parameter_changes]
        counts = [(sum(change.state is state for change in changes), state.value) for state in ChangeState]
        parts = [f"{len(self.chosen)} of {len(self._rows)} chosen", *(f"{n} {word}" for n, word in counts if n)]
        under = self._s.parameter_changes.get(self.table.key or "") if self.table.key in self._sent else None
        about = "" if under is None else f"\n{self.table.key}: {under.words}"
        self._status.update(", ".join(parts) + about)
