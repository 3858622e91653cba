"""Keys: the last line of a screen, and each key handled to its end before the next one is looked at.

Textual's own footer has a widget for each key and makes them all anew at every change of focus. With it the tests of
the screens take two thirds longer.

Textual sends a key to the widget that has the focus when the key arrives. Keys that arrive together, over a slow link
or from a paste, would all reach the widget of the first one.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from collections.abc import Callable, Iterable, Mapping
from typing import ClassVar, NamedTuple

from rich.cells import cell_len
from rich.segment import Segment
from textual import events
from textual.app import App, ScreenStackError
from textual.binding import Binding
from textual.dom import DOMNode
from textual.message_pump import MessagePump
from textual.screen import Screen
from textual.strip import Strip
from textual.widget import Widget
from textual.widgets import Input

from darko_gcs.tui.containment import ContainingPump

KEY_STYLE, DESCRIPTION_STYLE = "key-footer--key", "key-footer--description"
HOVERED_STYLE, DISABLED_STYLE = "key-footer--hovered", "key-footer--disabled"
MAX_EXTRA = 13  # of the text of a key that only a wide line has room for [characters]
MORE_LEFT, MORE_RIGHT = "‹", "›"  # at the ends of a line that goes on there
SCROLL_STEP = 2  # that a turn of the wheel moves a line wider than the screen [cells]


class ShownKey(NamedTuple):
    """A key of the line."""

    key: str
    display: str  # as the line names it
    description: str
    enabled: bool
    tooltip: str

    @property
    def width(self) -> int:
        """Cells that it takes, less the gap after it."""
        return cell_len(self.display) + 1 + cell_len(self.description)


class KeyFooter(ContainingPump, Widget):
    """The keys that work now, seldom ones where there is room. A click is the key; the wheel scrolls a long line."""

    ALLOW_SELECT = False
    COMPONENT_CLASSES: ClassVar[set[str]] = {KEY_STYLE, DESCRIPTION_STYLE, HOVERED_STYLE, DISABLED_STYLE}
    DEFAULT_CSS = """
    KeyFooter {
        dock: bottom;
        height: 1;
        color: $footer-foreground;
        background: $footer-background;
        .key-footer--key {
            color: $footer-key-foreground;
            background: $footer-key-background;
            text-style: bold;
        }
        .key-footer--description {
            color: $footer-description-foreground;
            background: $footer-description-background;
        }
        .key-footer--hovered { background: $block-hover-background; }
        .key-footer--disabled { text-style: dim; }
    }
    """

    def __init__(self) -> None:
        super().__init__()
        self._usual: tuple[ShownKey, ...] = ()
        self._rest: tuple[ShownKey, ...] = ()  # shown where there is room
        self._shown: tuple[ShownKey, ...] = ()
        self._left_out = 0  # cells of the line left of the screen
        self._hovered: ShownKey | None = None

    def on_mount(self) -> None:
        """Follow the keys of the screen."""
        self.screen.bindings_updated_signal.subscribe(self, self.show_keys)

    def on_unmount(self) -> None:
        """Follow them no longer."""
        self.screen.bindings_updated_signal.unsubscribe(self)

    def show_keys(self, screen: Screen[object]) -> None:
        """Show the keys of the screen, if they are others than before."""
        if not screen.app.app_focus:  # the terminal is left: nothing is focused until somebody comes back
            return
        first_of: dict[str, ShownKey] = {}  # by action: of several keys for one action the line has one
        extra: dict[str, ShownKey] = {}
        for node, binding, enabled, tooltip in screen.active_bindings.values():
            if binding.show or (0 < len(binding.description) <= MAX_EXTRA and _is_own(node, binding.action)):
                display = self.app.get_key_display(binding)
                (first_of if binding.show else extra).setdefault(
                    binding.action, ShownKey(binding.key, display, binding.description, enabled, tooltip)
                )
        rest = tuple(shown for action, shown in extra.items() if action not in first_of)
        if (tuple(first_of.values()), rest) != (self._usual, self._rest):
            self._usual, self._rest = tuple(first_of.values()), rest
            self._fill()

    def _fill(self) -> None:
        """Show the usual keys, and of the rest those that there is room for."""
        shown, room = list(self._usual), self.size.width - sum(key.width + 1 for key in self._usual)
        for key in self._rest:
            if key.width + 1 <= room:
                shown.append(key)
                room -= key.width + 1
        self._shown = tuple(shown)
        self._scroll(0)
        self.refresh()

    def on_resize(self) -> None:
        """Leave nothing out that there is room for now."""
        self._fill()

    def render_line(self, y: int) -> Strip:  # noqa: ARG002 - there is one
        """The line."""
        own, width = self.rich_style, self.size.width
        styles = [self.get_component_rich_style(name) for name in (KEY_STYLE, DESCRIPTION_STYLE)]
        segments = []
        for shown in self._shown:
            of_key, of_text = styles
            for name, holds in ((HOVERED_STYLE, shown is self._hovered), (DISABLED_STYLE, not shown.enabled)):
                if holds:
                    style = self.get_component_rich_style(name, partial=True)
                    of_key, of_text = of_key + style, of_text + style
            segments += [Segment(shown.display, of_key), Segment(f" {shown.description}", of_text), Segment(" ", own)]
        begin, end = self._left_out, self._left_out + width
        whole = Strip(segments).extend_cell_length(end, own)
        line = whole.crop(begin, end)
        if begin > 0:
            line = Strip.join([Strip([Segment(MORE_LEFT, styles[0])]), line.crop(1)])
        if self._width > end:
            line = Strip.join([line.crop(0, width - 1), Strip([Segment(MORE_RIGHT, styles[0])])])
        return line

    def on_mouse_down(self, event: events.MouseDown) -> None:
        """Press the key."""
        shown = self._key_at(event.x)
        if shown is None:
            return
        if shown.enabled:
            self.app.simulate_key(shown.key)
        else:
            self.app.bell()

    def on_mouse_move(self, event: events.MouseMove) -> None:
        """Say more about the key."""
        self._hover(self._key_at(event.x))

    def on_leave(self) -> None:
        """The mouse is elsewhere."""
        self._hover(None)

    def on_mouse_scroll_down(self, event: events.MouseScrollDown) -> None:
        """Show what is farther right."""
        self._scroll(SCROLL_STEP)
        event.stop()

    def on_mouse_scroll_up(self, event: events.MouseScrollUp) -> None:
        """Show what is farther left."""
        self._scroll(-SCROLL_STEP)
        event.stop()

    def _hover(self, shown: ShownKey | None) -> None:
        if shown is not self._hovered:
            self._hovered = shown
            self.tooltip = None if shown is None else shown.tooltip or None
            self.refresh()

    def _scroll(self, cells: int) -> None:
        self._left_out = max(min(self._left_out + cells, self._width - self.size.width), 0)
        self.refresh()

    @property
    def _width(self) -> int:
        """Cells of the whole line, less the gap after its last key."""
        return max(sum(shown.width + 1 for shown in self._shown) - 1, 0)

    def _key_at(self, x: int) -> ShownKey | None:
        """The key at a cell of the screen; None in the gaps."""
        start = -self._left_out
        for shown in self._shown:
            if start <= x < start + shown.width:
                return shown
            start += shown.width + 1
        return None


def _is_own(node: DOMNode, action: str) -> bool:
    """False for what Textual itself binds, such as the arrows of a list."""
    own = (kind for kind in type(node).__mro__ if not kind.__module__.startswith("textual."))
    bindings = (binding for kind in own for binding in kind.__dict__.get("BINDINGS", ()))
    return any(isinstance(binding, Binding) and binding.action == action for binding in bindings)


BURST_GAP = 0.025  # keys closer to each other come from no finger, which repeats at about 30 a second at most [s]
HANDLING_LIMIT = 2.0  # for one key; the next one follows even if the screens are still busy [s]
TOLD_TIME = 5.0  # that a notice is shown, and not told again [s]
MEANT_TIME = 2.0  # without such keys, behind which they no longer mean the screen that ended [s]
REPEAT_DELAY = 0.7  # at most, from a press to the first repetition of a held key [s]
QUIET_TURNS = 3  # in a row without a waiting message, before a key counts as handled
NAVIGATION = frozenset(
    {"up", "down", "left", "right", "home", "end", "pageup", "pagedown", "escape", "ctrl+c", "ctrl+q"}
)  # keys that give no command


class TypedKeys:
    """The queue of keys and pastes of an app.

    Args:
        app: Gets each of them a second time, by ``post_message``, when it is its turn.
        on_ignored: Called when keys that came together were not taken.
        is_guarded: Whether keys that came together may reach text fields only, beside the first of them.
    """

    def __init__(self, app: App[int], on_ignored: Callable[[], None], *, is_guarded: bool) -> None:
        self._app, self._on_ignored, self._is_guarded = app, on_ignored, is_guarded
        self._waiting: asyncio.Queue[events.Key | events.Paste] = asyncio.Queue()
        self._turn: events.Event | None = None
        self._last_time = -1.0  # of a key, as the terminal gave it [s]
        self._told_at = -math.inf  # of ignored keys [s]
        self._held: dict[str, float] = {}  # keys that may not have been let go yet, and their last repetition [s]
        self._meant: frozenset[str] = frozenset()  # keys that are ignored as long as a screen that ended may be meant
        self._meant_until = -math.inf  # [s]
        self._meant_told_at, self._meant_why = -math.inf, ""  # [s]; why they are ignored
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin to hand out keys."""
        self._task = asyncio.create_task(self._hand_out())

    def stop(self) -> None:
        """Hand out no more."""
        if self._task is not None:
            self._task.cancel()

    def has_turn(self, event: events.Event) -> bool:
        """True for the key that is being handed out; for every key if nobody hands them out."""
        return event is self._turn or self._task is None or self._task.done()

    def ignore_held(self, pressed: Mapping[str, float], meant: Iterable[str], why: str) -> None:
        """Ignore keys that may mean a screen that ended, until Esc, or until none of them came for ``MEANT_TIME``.

        Args:
            pressed: Last press of some of them [s]: a held one is ignored until it is let go.
            meant: All of them: on other screens they may arm, disarm or begin a mission.
            why: Told with the first one that is ignored.
        """
        self._meant_told_at, self._meant_why = -math.inf, why
        self._held, self._meant, self._meant_until = dict(pressed), frozenset(meant), time.monotonic() + MEANT_TIME

    def add(self, event: events.Key | events.Paste) -> None:
        """Take a key or a paste from the terminal."""
        if not (isinstance(event, events.Key) and self._means_ended(event)):
            self._waiting.put_nowait(event)

    def _means_ended(self, key: events.Key) -> bool:
        """True for a key that was meant for the screen that ended: a terminal tells no release, only silence."""
        is_held = key.time - self._held.pop(key.key, -math.inf) <= REPEAT_DELAY
        if is_held:
            self._held[key.key] = key.time
        is_meant = key.key in self._meant and key.time < self._meant_until
        if key.key == "escape" and key.time < self._meant_until:
            self._held, self._meant_until = {}, -math.inf
            return True
        if is_meant:
            self._meant_until = key.time + MEANT_TIME
            if key.time - self._meant_told_at > TOLD_TIME:
                self._meant_told_at = key.time
                words = f"{key.key} is ignored: {self._meant_why}. Esc, or {MEANT_TIME:.0f} s without keys, ends this"
                self._app.notify(words, severity="warning")
        return is_held or is_meant

    async def _hand_out(self) -> None:
        while True:
            event = await self._waiting.get()
            with contextlib.suppress(TimeoutError, ScreenStackError):  # no screen: the app is closing
                if isinstance(event, events.Key) and not self._is_wanted(event):
                    continue
                self._turn = event
                self._app.post_message(event)
                async with asyncio.timeout(HANDLING_LIMIT):
                    await self._until_quiet()

    def _is_wanted(self, key: events.Key) -> bool:
        """False for a key that no text field waits for, if it came together with another or before the question."""
        is_alone = key.time - self._last_time > BURST_GAP
        if key.key != "escape":  # which a terminal tells only after some silence: the next key did not come with it
            self._last_time = key.time
        is_late_enough = key.time >= getattr(self._app.screen, "shown_at", -math.inf)  # of a question
        if (
            (is_alone and is_late_enough)
            or not self._is_guarded
            or key.key in NAVIGATION
            or isinstance(self._app.focused, Input)
        ):
            return True
        if key.time - self._told_at > TOLD_TIME:
            self._told_at = key.time
            self._on_ignored()
        return False

    async def _until_quiet(self) -> None:
        """Until nothing waits in the app, in its uppermost screen or in the widgets there."""
        quiet, shown = 0, None
        while quiet < QUIET_TURNS:
            screen = self._app.screen
            pumps: list[MessagePump] = [self._app, *screen.walk_children(with_self=True)]
            await asyncio.gather(*map(_turn_over, pumps))
            is_quiet = screen is shown and not any(pump.message_queue_size for pump in pumps)
            quiet, shown = quiet + 1 if is_quiet else 0, screen


async def _turn_over(pump: MessagePump) -> None:
    """Until a pump has processed the messages that it has now."""
    reached = asyncio.Event()
    if pump.call_later(reached.set):
        await reached.wait()
