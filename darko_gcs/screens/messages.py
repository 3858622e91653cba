"""Every message that is kept, with its time: what happened, and in which order."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.reactive import reactive
from textual.screen import Screen
from textual.widgets import Footer, RichLog

from darko_gcs.snapshot import EMPTY, Line, Snapshot
from darko_gcs.widgets.panels import SEVERITY
from darko_gcs.widgets.status import StatusBar

__all__ = ["MessagesScreen"]


class MessagesScreen(Screen[None]):
    """The log, newest last; it follows the flight while its end is in sight.

    Args:
        stamp: A line's time on the feed's clock [s] in words.
    """

    COMPONENT_CLASSES: ClassVar[set[str]] = {f"messages--{name}" for name in ("dim", *filter(None, SEVERITY))}
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,e", "dismiss", "Back"),
        Binding("end", "end", "Newest"),
        Binding("home", "home", "Oldest"),
    ]
    snapshot: reactive[Snapshot] = reactive(EMPTY, repaint=False)
    now: reactive[float] = reactive(0.0, repaint=False)

    def __init__(self, stamp: Callable[[float], str]) -> None:
        super().__init__()
        self._stamp = stamp
        self._filled = False  # the app hands out snapshots as soon as a screen is pushed, before it is mounted

    def compose(self) -> ComposeResult:
        """Status bar, log, footer."""
        yield StatusBar().data_bind(MessagesScreen.snapshot, MessagesScreen.now)
        yield RichLog(id="log", wrap=True, auto_scroll=False, min_width=20)
        yield Footer(compact=True, show_command_palette=False)

    def on_mount(self) -> None:
        """Begin at the newest."""
        self.log_view.focus()
        self._filled = True
        self.call_after_refresh(self._show, at_end=True)

    @property
    def log_view(self) -> RichLog:
        """The scrolling lines."""
        return self.query_one("#log", RichLog)

    def watch_snapshot(self, old: Snapshot, s: Snapshot) -> None:
        """Follow the flight."""
        if self._filled and s.messages is not old.messages:
            self._show(at_end=self.log_view.is_vertical_scroll_end)

    def action_end(self) -> None:
        """To the newest."""
        self.log_view.scroll_end(animate=False)

    def action_home(self) -> None:
        """To the oldest that is kept."""
        self.log_view.scroll_home(animate=False)

    def _show(self, *, at_end: bool) -> None:
        view, height = self.log_view, self.log_view.scroll_y
        view.clear()
        for line in self.snapshot.messages:
            view.write(self._text(line), scroll_end=False)
        if at_end:
            view.scroll_end(animate=False)
        else:
            view.scroll_to(y=height, animate=False)

    def _text(self, line: Line) -> Text:
        style = SEVERITY[min(line.severity, 7)]
        stamp = Text(f"{self._stamp(line.time)}  ", style=self.get_component_rich_style("messages--dim", partial=True))
        words = self.get_component_rich_style(f"messages--{style}", partial=True) if style else ""
        return stamp.append(line.text, style=words)
