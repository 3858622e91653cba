"""Every message of every component, with its rates; one opens to its fields."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar

from textual import events
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container
from textual.message import Message as TextualMessage
from textual.reactive import reactive
from textual.widgets import Input, Static

from darko_gcs.state.message_fields import FieldRow, field_rows
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.state.text import format_age
from darko_gcs.state.traffic import Heard, MessageKind, Traffic
from darko_gcs.station.station import Station
from darko_gcs.tui.containment import StationScreen, on
from darko_gcs.tui.key_footer import KeyFooter
from darko_gcs.tui.own_keys import named_keys
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.screens.dialogs import AskScreen, FormField
from darko_gcs.tui.screens.typed_filter import TYPING, TYPING_KEYS, can_leave, show_typing, typed_words
from darko_gcs.tui.widgets.panel import MAX_FRESH_AGE, styled_line
from darko_gcs.tui.widgets.row_list import RowList, padded
from darko_gcs.tui.widgets.status_bar import StatusBar
from protocol.dialect import mavlink
from protocol.ranges import finite
from protocol.wire.codec import SourceStatistics
from protocol.wire.message import Source

RATES_PERIOD = 0.5  # between two looks at the rates: quicker ones cannot be read [s]
FIELDS_BESIDE = 110  # columns from which the fields stand beside the messages
RATE, AGE, SIZE, COUNT = 6, 6, 5, 8  # widths of the numbers [cells]
WIDE_LIST = 50  # cells from which a list has a mean rate, a size and units
FULL_LIST = 62  # cells from which it has every number
NARROW_LIST = 30  # cells from which it has an age
NAME_SHARE, MIN_FIELD_NAME, MAX_FIELD_NAME = 0.4, 8, 26  # of a row of fields
FIELD_VALUE, FIELD_UNIT = 14, 7
MAX_MESSAGE_RATE = 1000.0  # that can be asked for [1/s]
SORTS: tuple[tuple[str, Callable[[Heard], float]], ...] = (
    ("name", lambda _heard: 0.0),
    ("rate", lambda heard: -heard.rate),
    ("age", lambda heard: heard.age),
)
SILENT = 5.0  # after which a message that used to come is dim [s]


class InspectorScreen(StationScreen[None]):
    """Messages by component, and the fields of the one that is chosen.

    Args:
        traffic: What was heard.
        clock: The feed's time [s].
        station: Sets rates; None in a replay.
    """

    class Chart(TextualMessage):
        """The operator wants a chart of a field."""

        def __init__(self, path: str) -> None:
            super().__init__()
            self.path = path

    BINDINGS: ClassVar[list[BindingType]] = named_keys(
        "inspector",
        [
            Binding("escape", "close_message", "Close", priority=True, tooltip="Close the message"),
            *TYPING_KEYS,
            Binding("enter", "open", "Open", priority=True, tooltip="Open the message; of a field, draw its chart"),
            Binding("up", "move(-1)", show=False, priority=True),
            Binding("down", "move(1)", show=False, priority=True),
            Binding("pageup", "page(-1)", show=False, priority=True),
            Binding("pagedown", "page(1)", show=False, priority=True),
            Binding("f1", "app.act('help')", "Help", priority=True, tooltip="These keys"),
            Binding("f2", "active", "Active", priority=True, tooltip="Only messages that come now, or all again"),
            Binding("f3", "chart", "Chart", priority=True, tooltip="Draw a chart of the field under the cursor"),
            Binding("f4", "sort", "Sort", priority=True, tooltip="Sort by name, by rate, by age"),
            Binding("f5", "rate", "Rate", priority=True, tooltip="Have the vehicle send the message at another rate"),
        ],
    )
    snapshot: reactive[Snapshot] = reactive(EMPTY_SNAPSHOT, repaint=False)
    now: reactive[float] = reactive(0.0, repaint=False)

    def __init__(self, traffic: Traffic, clock: Callable[[], float], station: Station | None = None) -> None:
        super().__init__()
        self._traffic, self._clock, self._station = traffic, clock, station
        self._sort = 0  # of SORTS
        self._heard: dict[str, Heard] = {}
        self._losses: dict[str, SourceStatistics] = {}
        self._rows: dict[str, FieldRow] = {}
        self._is_open, self._only_active, self._is_ready = False, False, False
        self._looked_at = -math.inf
        self.messages = RowList(self._message_heading, self._message_row, id="messages-heard")
        self.fields = RowList(_field_heading, self._field_row, id="message-fields")
        self._status = Static("", id="inspector-status", markup=False)
        self._title = Static("", id="inspector-title", markup=False)

    def compose(self) -> ComposeResult:
        """Status bar, filter or the open message, messages beside or instead of fields, counts, footer."""
        yield StatusBar().data_bind(InspectorScreen.snapshot, InspectorScreen.now)
        yield Input(placeholder=f"part of a message, a component or a field: {TYPING}", id="filter", compact=True)
        yield self._title
        with Container(id="inspector-panes"):
            yield self.messages
            yield self.fields
        yield self._status
        yield KeyFooter()

    def on_mount(self) -> None:
        """Show what was heard so far."""
        self._is_ready = True
        self._show()

    @on(events.Resize)
    def _use_room(self, event: events.Resize) -> None:
        self.set_class(event.size.width >= FIELDS_BESIDE, "-side-by-side")

    def watch_now(self) -> None:
        """Follow what is heard."""
        if not self._is_ready:
            return
        if abs(self.now - self._looked_at) >= RATES_PERIOD:
            self._show()
        else:
            self._show_fields()

    def watch_snapshot(self) -> None:
        """A replay that is paused and steps from message to message is followed, too."""
        self.watch_now()

    # Keys. The filter has the focus.

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Esc does one thing at a time, and the footer says which; no rate is set in a recording."""
        if action == "close_message":
            return self._is_open
        if action in {"clear_filter", "close"} and self._is_open:
            return False
        if action == "rate" and self._station is None:
            return False
        return can_leave(self, action) and super().check_action(action, parameters)

    def action_close_message(self) -> None:
        """Close the message."""
        self._set_open(False)

    def action_clear_filter(self) -> None:
        """Show all again."""
        self.query_one("#filter", Input).value = ""

    def action_close(self) -> None:
        """Go back to the flight."""
        self.dismiss(None)

    def action_sort(self) -> None:
        """Sort by the next quantity."""
        self._sort = (self._sort + 1) % len(SORTS)
        self._show()

    def action_rate(self) -> None:
        """Ask for another rate of the message under the cursor."""
        heard, station = self._heard.get(self.messages.key or ""), self._station
        message = None if heard is None else self._traffic.last(heard.kind)
        if heard is None or message is None or station is None:
            self.notify("Choose a message whose rate is to be set", severity="warning")
            return
        if heard.kind.source != self.snapshot.identity.source:
            self.notify("Only the rates of the vehicle that is shown can be set", severity="warning")
            return
        number = message.get_msgId()

        def answered(values: tuple[str, ...] | None) -> None:
            if values is not None:
                station.set_message_rate(number, float(values[0]), self._clock())

        fields = [FormField("Messages a second", f"{heard.rate:.3g}", "0: none any more; -1: the vehicle's own rate")]
        screen = AskScreen(
            f"Rate of {heard.kind.name}", fields, ranges=[finite("rate", -1.0, MAX_MESSAGE_RATE, "", default=False)]
        )
        self.app.push_screen(screen, answered)

    def action_open(self) -> None:
        """Open the message under the cursor; of an open one, draw the field under the cursor."""
        if self._is_open:
            self.action_chart()
        elif self.messages.key in self._heard:
            self._set_open(True)

    def action_chart(self) -> None:
        """Draw a chart of the field under the cursor."""
        row = self._rows.get(self.fields.key or "")
        if not self._is_open:
            self.notify("Open a message (Enter) and choose a field to draw", severity="warning")
        elif row is None or not row.path:
            self.notify("This is no number: it cannot be drawn", severity="warning")
        else:
            self.post_message(self.Chart(row.path))

    def action_move(self, rows: int) -> None:
        """Move the cursor."""
        (self.fields if self._is_open else self.messages).move(rows)

    def action_page(self, pages: int) -> None:
        """Move the cursor by pages."""
        (self.fields if self._is_open else self.messages).move_page(pages)

    def action_active(self) -> None:
        """Show only messages that come now, or all again."""
        self._only_active = not self._only_active
        self._show()

    # Inside

    def _set_open(self, is_open: bool) -> None:
        self._is_open = is_open
        self.set_class(is_open, "-open")
        field = self.query_one("#filter", Input)
        if is_open:
            self.set_focus(None)  # what is typed now filters nothing
        else:
            field.focus()
        self.refresh_bindings()
        self.fields.move_to(0)
        self._show_fields()

    @on(Input.Changed)
    def _filter_changed(self) -> None:
        show_typing(self)
        self._show()
        self.messages.move_to(1)  # the best match; the first row names its component

    @on(RowList.Moved)
    def _moved(self) -> None:
        self._show_fields()

    def _show(self) -> None:
        now = self._clock()
        self._looked_at = self.now
        self._heard = {heard.kind.key: heard for heard in self._traffic.heard(now)}
        self._losses = {_component(source): loss for source, loss in self._traffic.losses().items()}
        words = self.query_one("#filter", Input).value.lower().split()
        keys, last = [], ""

        def rank(entry: tuple[str, Heard]) -> tuple[Source, bool, float]:
            kind = entry[1].kind
            return kind.source, not all(word in kind.name.lower() for word in words), SORTS[self._sort][1](entry[1])

        for key, heard in sorted(self._heard.items(), key=rank):  # names with the text before fields with it
            if not all(word in _searched(heard) for word in words) or (self._only_active and heard.rate == 0.0):
                continue
            if (component := _component(heard.kind.source)) != last:
                keys.append(component)
                last = component
            keys.append(key)
        self.messages.show(keys)
        if keys and self.messages.cursor == 0:  # the first row names a component and opens nothing
            self.messages.move_to(1)
        self._status.update(self._counts(sum(key in self._heard for key in keys)))
        self._show_fields()

    def _counts(self, shown: int) -> str:
        rate = sum(heard.rate for heard in self._heard.values())
        told = f"{typed_words(self)}{shown} of {len(self._heard)} messages, {rate:.0f}/s"
        told += f", by {SORTS[self._sort][0]}" + ", only active" * self._only_active
        unread = self._traffic.unread
        return told + (f"; {unread} frames of messages that no dialect here has" if unread else "")

    def _show_fields(self) -> None:
        """The fields of the message under the cursor, as they are now."""
        heard = self._heard.get(self.messages.key or "")
        message = None if heard is None else self._traffic.last(heard.kind)
        rows = [] if heard is None or message is None else field_rows(message, self._last_beside(heard.kind))
        if heard is not None and self._is_open:
            self._title.update(f"{heard.kind.name} of {_component(heard.kind.source)}, {heard.rate:.1f}/s")
        self._rows = {f"{row.name or row.meaning}#{number}": row for number, row in enumerate(rows)}
        if tuple(self._rows) != self.fields.keys:
            self.fields.show(tuple(self._rows))
        else:
            self.fields.redraw()

    def _last_beside(self, kind: MessageKind) -> Callable[[str], object]:
        return lambda name: self._traffic.last(MessageKind(kind.source, name))

    def _message_row(self, key: str, width: int) -> StyledLine:
        heard = self._heard.get(key)
        if heard is None:
            return self._component_row(key, width)
        style = "dim" if heard.age > max(SILENT, 3.0 / heard.mean if heard.mean > 0.0 else 0.0) else ""
        return styled_line((_cells(width, f" {heard.kind.name}", _numbers(heard)), style))

    def _message_heading(self, width: int) -> StyledLine:
        names = {"rate": "now/s", "age": "age", "name": " message"}
        sorted_by = names[SORTS[self._sort][0]]
        heads = [f"▾{name.strip()}" if name == sorted_by else name for name in (" message", "now/s", "age")]
        return [(_cells(width, heads[0], (heads[1], heads[2], "mean/s", "bytes", "count")), "label")]

    def _component_row(self, component: str, width: int) -> StyledLine:
        loss = self._losses.get(component, SourceStatistics())
        share = 100.0 * loss.lost / max(loss.lost + loss.received, 1)
        text = f"{component}  {loss.received} frames, {loss.lost} lost ({share:.1f} %)"
        return styled_line((padded(text, width), "warn" if share >= 1.0 else "accent"))

    def _field_row(self, key: str, width: int) -> StyledLine:
        row = self._rows.get(key)
        if row is None:
            return []
        name, value, unit, rest = _field_widths(width)
        wanted = f"→ {row.wanted}  " if row.wanted else ""
        meaning = row.meaning if row.value else f"+ {row.meaning}"
        if not unit:
            meaning = row.meaning or row.unit
        return styled_line(
            (padded(row.name, name), "label"),
            f" {row.value:>{value}} " if len(row.value) <= value else f" {padded(row.value, value + rest)} ",
            (padded(row.unit, unit) + " " * bool(unit), "dim"),
            (wanted, "now"),
            (meaning, "accent" if not row.unit else "dim"),
        )


def _component(source: Source) -> str:
    """System and component, with the usual name of the latter: "1/1 autopilot"."""
    entry = mavlink.enums["MAV_COMPONENT"].get(source[1])
    name = "" if entry is None else entry.name.removeprefix("MAV_COMP_ID_").removesuffix("1").lower()
    return f"{source[0]}/{source[1]} {name.replace('_', ' ')}".rstrip()


def _searched(heard: Heard) -> str:
    return f"{heard.kind.key} {' '.join(heard.fields)}".lower()


def _numbers(heard: Heard) -> tuple[str, ...]:
    """Rate now, age, mean, size, count."""
    mean = "" if math.isnan(heard.mean) else f"{heard.mean:.1f}"
    age = f"{heard.age:.1f} s" if heard.age < MAX_FRESH_AGE else format_age(heard.age)
    return f"{heard.rate:.1f}", age, mean, f"{heard.size}", f"{heard.total}"


def _cells(width: int, name: str, numbers: tuple[str, ...]) -> str:
    """A name, and as many of the numbers as there is room for."""
    rate, age, mean, size, count = numbers
    cells = [f"{rate:>{RATE}}"]
    if width >= NARROW_LIST:
        cells.append(f"{age:>{AGE}}")
    if width >= WIDE_LIST:
        cells[1:1] = [f"{mean:>{RATE}}"]
        cells.append(f"{size:>{SIZE}}")
    if width >= FULL_LIST:
        cells.append(f"{count:>{COUNT}}")
    numbers_text = " ".join(cells)
    return f"{padded(name, max(1, width - len(numbers_text) - 1))} {numbers_text}"


def _field_widths(width: int) -> tuple[int, int, int, int]:
    """Cells of name, value, unit, and of what is left [cells]."""
    name = max(MIN_FIELD_NAME, min(MAX_FIELD_NAME, int(NAME_SHARE * width)))
    unit = FIELD_UNIT if width >= WIDE_LIST else 0
    return name, min(FIELD_VALUE, max(4, width - name - 2)), unit, max(0, width - name - FIELD_VALUE - unit - 4)


def _field_heading(width: int) -> StyledLine:
    name, value, unit, rest = _field_widths(width)
    unit_text = padded("unit", unit) + " " if unit else ""
    wanted, meaning = "→ set-point", "  meaning"
    wanted = wanted if rest >= len(wanted) + len(meaning) else "→ set"
    meaning = meaning if rest >= len(wanted) + len(meaning) else ""
    return [(f"{padded('field', name)} {'value':>{value}} {unit_text}", "label"), (wanted, "now"), (meaning, "label")]
