"""Keys one at a time: each is handled to its end, also the dialog that it opens, before the next one is looked at.

Textual sends a key to the widget that has the focus when the key arrives. Keys that arrive together, over a slow link
or from a paste, would all reach the widget of the first one.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections.abc import Callable

from textual import events
from textual.app import App, ScreenStackError
from textual.message_pump import MessagePump
from textual.widgets import Input

BURST_GAP = 0.025  # keys closer to each other come from no finger, which repeats at about 30 a second at most [s]
HANDLING_LIMIT = 2.0  # for one key; the next one follows even if the screens are still busy [s]
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
        self._has_told = False  # about this burst
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

    def add(self, event: events.Key | events.Paste) -> None:
        """Take a key or a paste from the terminal."""
        self._waiting.put_nowait(event)

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
        self._has_told = self._has_told and not is_alone
        is_late_enough = key.time >= getattr(self._app.screen, "shown_at", -math.inf)  # of a question
        if (
            (is_alone and is_late_enough)
            or not self._is_guarded
            or key.key in NAVIGATION
            or isinstance(self._app.focused, Input)
        ):
            return True
        if not self._has_told:
            self._has_told = True
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
