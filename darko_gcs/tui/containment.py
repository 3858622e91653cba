"""Errors of the station's own code end a panel or a dialog, never the station of a vehicle that flies."""

from __future__ import annotations

import contextlib
import inspect
import os
import traceback
from collections.abc import Awaitable, Callable, Iterable
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from platformdirs import user_state_path
from textual import events, on
from textual.app import App
from textual.message import Message
from textual.message_pump import MessagePump
from textual.screen import ModalScreen, Screen
from textual.widget import Widget

MAX_ERRORS = 20  # of a session that are written: an error may come with every frame
MAX_TEXT = 200  # of an error that a line has room for [characters]


class ErrorLog:
    """Writes the traceback of each error once, all of a session into one file.

    Args:
        folder: Where the file is made with the first error.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._known: set[str] = set()
        self.file: Path | None = None  # None until a traceback was written

    def add(self, error: BaseException, where: str) -> bool:
        """Write an error's traceback; False if the same error was written before, or too many others.

        Args:
            error: As it was raised.
            where: The part of the station that it happened in.
        """
        key = f"{where} {type(error).__name__} {error_place(error)}"
        if key in self._known or len(self._known) >= MAX_ERRORS:
            return False
        self._known.add(key)
        now = datetime.now().astimezone()
        path = self.file or self._folder / f"darko-gcs-{now:%Y%m%d-%H%M%S}-{os.getpid()}.txt"
        with contextlib.suppress(OSError):  # a disk that fails costs the traceback, nothing else
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("a", encoding="utf-8") as file:
                file.write(f"{now:%Y-%m-%d %H:%M:%S}  {where}\n{''.join(traceback.format_exception(error))}\n")
            self.file = path
        return True

    @property
    def words(self) -> str:
        """Path of the tracebacks, in words."""
        return f"{self._folder}: cannot be written" if self.file is None else f"traceback: {self.file}"


def error_words(error: BaseException) -> str:
    """An error in a line: "ZeroDivisionError: float division by zero (map_drawing.py:196)"."""
    text = " ".join(str(error).split())[:MAX_TEXT]
    return ": ".join(filter(None, (type(error).__name__, text))) + f" ({error_place(error)})"


def error_place(error: BaseException) -> str:
    """File and line that an error was raised in."""
    frames = traceback.extract_tb(error.__traceback__)
    return f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else "nowhere"


def failed_pump(error: BaseException) -> MessagePump | None:
    """The screen, widget or app that an error came out of: the outermost one that its traceback passed."""
    owners = (frame.f_locals.get("self") for frame, _ in traceback.walk_tb(error.__traceback__))
    return next((owner for owner in owners if isinstance(owner, MessagePump)), None)


ERRORS_FOLDER = "errors"  # in the user's state folder
LEAVING_DELAY = 0.1  # after which a widget that failed has ended, if Textual ends it [s]


def is_contained(app: App[Any], error: Exception, where: str, *, is_drawing: bool = False) -> bool:
    """Tell an app's operator an error and go on; False if it has to end the app."""
    return isinstance(app, ContainingApp) and app.contain(error, where, is_drawing=is_drawing)


class ContainingPump(MessagePump):
    """A screen or widget that goes on after an error in one of its handlers: Textual would end it, and the app."""

    async def _dispatch_message(self, message: Message) -> None:
        try:
            await super()._dispatch_message(message)
        except Exception as error:
            if not is_contained(self.app, error, self._where(message)):
                raise

    def _get_dispatch_methods(
        self, method_name: str, message: Message
    ) -> Iterable[tuple[type, Callable[[Message], Awaitable[None]]]]:
        """The handlers of a message; the next one is called after an error in one of them, too."""
        for owner, handler in super()._get_dispatch_methods(method_name, message):
            yield owner, partial(self._guarded, handler)

    async def _guarded(self, handler: Callable[..., object], message: Message) -> None:
        try:
            done = handler(message) if inspect.signature(handler).parameters else handler()
            if inspect.isawaitable(done):
                await done
        except Exception as error:
            if not is_contained(self.app, error, self._where(message)):
                raise

    def _where(self, message: Message) -> str:
        return f"{type(self).__name__}, {type(message).__name__}"


class ContainingApp(ContainingPump, App[int]):
    """An app that goes on after an error in what draws, and, while ``must_go_on``, after any other.

    Each error is told once, and its traceback is in a file; what fails ten times a second is told once, too.
    """

    ALLOW_SELECT: ClassVar[bool] = False  # a press on a widget that just leaves the screen ends Textual's selecting
    crash: str = ""  # the error that ended it

    def __init__(self) -> None:
        super().__init__()
        self.errors = ErrorLog(user_state_path("darko") / ERRORS_FOLDER)

    def must_go_on(self) -> bool:
        """Whether an end would cost more than a part that does not work."""
        return False

    def tell_error(self, text: str) -> None:
        """Tell the operator an error."""
        self.notify(text, severity="error", markup=False)

    def contain(self, error: Exception, where: str, *, is_drawing: bool = False) -> bool:
        """Tell an error and go on; False if it has to end the app.

        Args:
            error: As it was raised.
            where: The part of the station that it happened in.
            is_drawing: Nothing but a picture is missing.
        """
        if not (is_drawing or self.must_go_on()):
            return False
        if self.errors.add(error, where):
            self.tell_error(f"Error of the ground station in {where}: {error_words(error)}; {self.errors.words}")
        return True

    def guarded(self, step: Callable[[], object], where: str) -> None:
        """Take a step that the next ones do not need."""
        try:
            step()
        except Exception as error:
            if not self.contain(error, where):
                raise

    def _handle_exception(self, error: Exception) -> None:
        """Contain an error in a timer, a worker or one of Textual's own widgets; Textual calls this."""
        pump = failed_pump(error)
        if self.is_running and self.contain(error, type(pump).__name__):
            if isinstance(pump, Widget) and pump.is_attached:
                self.set_timer(LEAVING_DELAY, partial(self._leave_broken, pump, pump.screen))
            return
        self.errors.add(error, type(pump).__name__)
        self.crash = self.crash or error_words(error)
        super()._handle_exception(error)
        self._exit_renderables.clear()  # a traceback with all variables, over the pilot's shell

    def _leave_broken(self, widget: Widget, screen: Screen[Any]) -> None:
        """Close the screen of a widget that Textual has ended; the flight screen below all others stays."""
        while not widget.is_running and screen in self.screen_stack[2:]:
            self.pop_screen()


Result = TypeVar("Result")
THIN = 60  # columns below which no panel has another beside it
LOW, TINY = 20, 9  # rows below which panels give way to each other, and below which they have no borders


class StationScreen(ContainingPump, Screen[Result]):
    """A screen with the classes ``-thin``, ``-low`` and ``-tiny`` where there is little room."""

    EXTRA_ROWS: ClassVar[int] = 0  # that bars take beside those of every screen

    @on(events.Resize)
    def _mark_size(self, event: events.Resize) -> None:
        width, height = event.size.width, event.size.height - self.EXTRA_ROWS
        for name, holds in (("-thin", width < THIN), ("-low", height < LOW), ("-tiny", height < TINY)):
            self.set_class(holds, name)


class Dialog(ModalScreen[Result], StationScreen[Result]):
    """A screen above another one."""
