"""The message log with times, newest last."""

from __future__ import annotations

from collections.abc import Callable
from textwrap import wrap
from typing import ClassVar

from rich.text import Text
from textual import events
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.reactive import reactive
from textual.widgets import Input, RichLog

from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.state.values import LogLine
from darko_gcs.tui.containment import StationScreen, on
from darko_gcs.tui.key_footer import KeyFooter
from darko_gcs.tui.own_keys import named_keys
from darko_gcs.tui.widgets.panel import SEVERITY_STYLES, severity_style
from darko_gcs.tui.widgets.status_bar import StatusBar
from protocol.dialect import mavlink

SEVERITY_WORDS = ("emerg", "alert", "crit", "error", "warn", "note", "info", "debug")  # by MAV_SEVERITY


MIN_TEXT_WIDTH = 20  # of a text beside its time, on the smallest terminal [cells]


class MessagesScreen(StationScreen[None]):
    """The log; it scrolls with new messages as long as its end is in view.

    Args:
        time_text: The text of a line's time, which is on the feed's clock [s].
    """

    COMPONENT_CLASSES: ClassVar[set[str]] = {f"messages--{name}" for name in ("dim", *filter(None, SEVERITY_STYLES))}
    BINDINGS: ClassVar[list[BindingType]] = named_keys(
        "messages",
        [
            Binding("escape", "clear_filter", "All", key_display="esc", tooltip="Show all messages again"),
            Binding("escape,e", "back", "Back", key_display="esc"),
            Binding("end", "end", "Newest"),
            Binding("home", "home", "Oldest"),
            Binding(
                "slash", "filter", "Filter", key_display="/", tooltip="Only lines with what is typed; Esc shows all"
            ),
            Binding("w", "warnings", "Warnings", tooltip="Only warnings and worse, or all again"),
        ],
    )
    snapshot: reactive[Snapshot] = reactive(EMPTY_SNAPSHOT, repaint=False)
    now: reactive[float] = reactive(0.0, repaint=False)

    def __init__(self, time_text: Callable[[float], str]) -> None:
        super().__init__()
        self._time_text = time_text
        self._has_warnings_only = False
        self._is_ready = False  # the app hands out snapshots as soon as a screen is pushed, before it is mounted

    def compose(self) -> ComposeResult:
        """Status bar, log, footer."""
        yield StatusBar().data_bind(MessagesScreen.snapshot, MessagesScreen.now)
        yield Input(placeholder="only lines with this: Enter keeps it, Esc shows all", id="filter", compact=True)
        yield RichLog(id="log", wrap=True, auto_scroll=False, min_width=20)
        yield KeyFooter()

    def on_mount(self) -> None:
        """Begin at the newest message."""
        self.query_one(Input).display = False
        self.log_view.focus()
        self._is_ready = True
        self.call_after_refresh(self._show, at_end=True)

    @property
    def log_view(self) -> RichLog:
        """The scrolling lines."""
        return self.query_one("#log", RichLog)

    def watch_snapshot(self, old: Snapshot, s: Snapshot) -> None:
        """Show new messages."""
        if self._is_ready and s.log.lines is not old.log.lines:
            self._show(at_end=self.log_view.is_vertical_scroll_end)

    @on(events.Resize)
    def _wrap_anew(self) -> None:
        if self._is_ready:
            self.call_after_refresh(self._show, at_end=self.log_view.is_vertical_scroll_end)

    def action_filter(self) -> None:
        """Type what the lines shall have in them."""
        field = self.query_one(Input)
        field.display = True
        field.focus()
        self.refresh_bindings()

    @on(Input.Changed)
    def _filter(self) -> None:
        self._show(at_end=True)

    @on(Input.Submitted)
    def _leave_filter(self) -> None:
        self.log_view.focus()

    def action_warnings(self) -> None:
        """Show warnings and worse alone, or all again."""
        self._has_warnings_only = not self._has_warnings_only
        self._show(at_end=True)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Esc does one thing at a time, and the footer says which."""
        if action in {"clear_filter", "back"}:
            is_filtered = self._is_ready and self.query_one(Input).display
            return is_filtered == (action == "clear_filter")
        return super().check_action(action, parameters)

    def action_clear_filter(self) -> None:
        """Show all lines again."""
        field = self.query_one(Input)
        field.value, field.display = "", False
        self.log_view.focus()
        self.refresh_bindings()

    def action_back(self) -> None:
        """Back to the flight."""
        self.dismiss(None)

    def action_end(self) -> None:
        """Scroll to the newest message."""
        self.log_view.scroll_end(animate=False)

    def action_home(self) -> None:
        """Scroll to the oldest message."""
        self.log_view.scroll_home(animate=False)

    def _show(self, *, at_end: bool) -> None:
        view, height = self.log_view, self.log_view.scroll_y
        view.clear()
        wanted = list(filter(self._is_wanted, self.snapshot.log.lines))
        for line in wanted:
            view.write(self._styled(line), scroll_end=False)
        if self.snapshot.log.lines and not wanted:
            view.write("no warning so far: w shows all" if self._has_warnings_only else "no message has this text")
        if at_end:
            view.scroll_end(animate=False)
        else:
            view.scroll_to(y=height, animate=False)

    def _is_wanted(self, line: LogLine) -> bool:
        is_severe = not self._has_warnings_only or line.severity <= mavlink.MAV_SEVERITY_WARNING
        severity = SEVERITY_WORDS[min(line.severity, len(SEVERITY_WORDS) - 1)]
        return is_severe and self.query_one(Input).value.casefold() in f"{severity} {line.text}".casefold()

    def _styled(self, line: LogLine) -> Text:
        name = severity_style(line.severity)
        dim = self.get_component_rich_style("messages--dim", partial=True)
        style = self.get_component_rich_style(f"messages--{name}", partial=True) if name else ""
        severity = SEVERITY_WORDS[min(line.severity, len(SEVERITY_WORDS) - 1)]
        head = f"{self._time_text(line.time)}  {severity:<{max(map(len, SEVERITY_WORDS))}}  "
        room = max(self.log_view.scrollable_content_region.width - len(head), MIN_TEXT_WIDTH)
        text = f"\n{' ' * len(head)}".join(wrap(line.text, room) or [""])
        return Text(head, style=dim).append(text, style=style)
