"""The supervisor's jumps from law to law, newest first: when, from which, to which, why."""

from __future__ import annotations

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.reactive import reactive
from textual.widgets import Static

from darko_gcs.state.law_reason import law_reason
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.state.text import counted, format_time, jump_cause, v_text
from darko_gcs.state.values import Jump
from darko_gcs.tui.containment import StationScreen
from darko_gcs.tui.key_footer import KeyFooter
from darko_gcs.tui.own_keys import named_keys
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.widgets.panel import styled_line
from darko_gcs.tui.widgets.row_list import RowList, padded
from darko_gcs.tui.widgets.status_bar import StatusBar
from protocol.names import law_label

TIME, LAW, NARROW_LAW, V = 9, 22, 17, 7  # widths of columns [cells]
WIDE = 80  # cells from which there is room for the longest names of laws


class JumpsScreen(StationScreen[None]):
    """A list that follows the vehicle."""

    BINDINGS: ClassVar[list[BindingType]] = named_keys(
        "jumps",
        [
            Binding("escape,V", "dismiss", "Back", key_display="esc"),
            Binding("up", "move(-1)", show=False),
            Binding("down", "move(1)", show=False),
            Binding("pageup", "page(-1)", show=False),
            Binding("pagedown", "page(1)", show=False),
        ],
    )
    snapshot: reactive[Snapshot] = reactive(EMPTY_SNAPSHOT, repaint=False)
    now: reactive[float] = reactive(0.0, repaint=False)

    def __init__(self) -> None:
        super().__init__()
        self._rows: dict[str, Jump] = {}
        self.jumps = RowList(_heading, self._row, id="jumps")
        self._status = Static("", id="jumps-status", markup=False)
        self._is_ready = False

    def compose(self) -> ComposeResult:
        """Status bar, list, the law in force, footer."""
        yield StatusBar().data_bind(JumpsScreen.snapshot, JumpsScreen.now)
        yield self.jumps
        yield self._status
        yield KeyFooter()

    def on_mount(self) -> None:
        """Show what is known."""
        self._is_ready = True
        self.watch_snapshot()

    def watch_snapshot(self) -> None:
        """Follow the vehicle."""
        if not self._is_ready:
            return
        rows = {str(jump.number): jump for jump in reversed(self.snapshot.hybrid.jumps)}
        if rows != self._rows or not rows:
            self._rows = rows
            self.jumps.show(tuple(rows))
        self._status.update(_law_words(self.snapshot))

    def action_move(self, rows: int) -> None:
        """Move the cursor."""
        self.jumps.move(rows)

    def action_page(self, pages: int) -> None:
        """Move the cursor by pages."""
        self.jumps.move_page(pages)

    def _row(self, key: str, width: int) -> StyledLine:
        jump = self._rows[key]
        texts = (law_label(jump.source), law_label(jump.target), jump_cause(jump.source, jump.target, jump.reason))
        return styled_line(_cells(width, format_time(jump.time), v_text(jump.v), texts))


def _heading(width: int) -> StyledLine:
    return [(_cells(width, "boot time", "V", ("from", "to", "why")), "label")]


def _cells(width: int, time: str, v: str, texts: tuple[str, str, str]) -> str:
    law = LAW if width >= WIDE else NARROW_LAW
    return f"{time:>{TIME}} {v:>{V}}  {padded(texts[0], law)}{padded(texts[1], law)}{texts[2]}"


def _law_words(s: Snapshot) -> str:
    """The law in force, why it stays, and how many jumps are known."""
    known, state = len(s.hybrid.jumps), s.hybrid.state
    if state is None:
        return "No jump yet" if s.identity.source is not None else "No vehicle yet"
    missing = f" of {state.jumps}: the others were before this began" * (state.jumps > known)
    reason = law_reason(s)
    return f"{law_label(state.law)} in force{f' ({reason})' if reason else ''}; {counted(known, 'jump')}{missing}"
