"""Errors of the station's own code end a panel or a dialog, never the station of a vehicle that flies."""

from __future__ import annotations

import contextlib
import inspect
import os
import traceback
from collections.abc import Awaitable, Callable
from datetime import datetime
from functools import partial, wraps
from pathlib import Path
from typing import Any, ClassVar, TypeVar, cast

import textual
from platformdirs import user_state_path
from textual import events
from textual.app import App, ScreenStackError
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


EXIT_CRASHED = 1  # as Python's after an error that nobody expected
ERRORS_FOLDER = "errors"  # in the user's state folder
LEAVING_DELAY = 0.1  # after which a widget that failed has ended, if Textual ends it [s]

Handler = TypeVar("Handler", bound=Callable[..., object])


def is_contained(app: App[Any], error: Exception, where: str, *, is_drawing: bool = False) -> bool:
    """Tell an app's operator an error and go on; False if it has to end the app."""
    return isinstance(app, ContainingApp) and app.contain(error, where, is_drawing=is_drawing)


def on(message_type: type[Message], selector: str | None = None, **of_controls: str) -> Callable[[Handler], Handler]:
    """Textual's decorator of a handler, which goes on after an error in it."""

    def decorate(handler: Handler) -> Handler:
        return textual.on(message_type, selector, **of_controls)(_contained(handler))

    return decorate


def _contained(handler: Handler) -> Handler:
    """A handler that tells an error in it: Textual calls the next one, and the screen or widget lives."""

    @wraps(handler)
    def begin(pump: MessagePump, *message: Message) -> object:
        try:
            done = handler(pump, *message)
        except Exception as error:
            _tell(pump, error, *message)
            return None
        return _finished(pump, done, *message) if inspect.isawaitable(done) else done

    return cast("Handler", begin)


async def _finished(pump: MessagePump, done: Awaitable[object], *message: Message) -> None:
    try:
        await done
    except Exception as error:
        _tell(pump, error, *message)


def _tell(pump: MessagePump, error: Exception, *message: Message) -> None:
    """Tell an error in a handler, or end the station by it."""
    where = ", ".join(type(part).__name__ for part in (pump, *message))
    if not isinstance(pump.app, ContainingApp):
        raise error
    if pump.app.is_closed_before(error):
        return
    if not pump.app.contain(error, where):
        pump.app.end_by(error, where)


class ContainingPump(MessagePump):
    """A screen or widget that goes on after an error in one of its handlers: Textual would end it, and the app."""

    def __init_subclass__(cls, *args: Any, **options: Any) -> None:  # noqa: ANN401 - Textual's own
        super().__init_subclass__(*args, **options)
        for name, handler in list(vars(cls).items()):
            if name.startswith("on_") and inspect.isfunction(handler):
                setattr(cls, name, _contained(handler))

    async def on_event(self, event: events.Event) -> None:
        """Take an event, also where a handler of Textual's own fails."""
        try:
            await super().on_event(event)
        except Exception as error:
            _tell(self, error, event)


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

    def is_closed_before(self, error: Exception) -> bool:
        """Whether an error says but that the screens have gone: what still comes while the app ends finds none."""
        return isinstance(error, ScreenStackError) and not self.screen_stack

    def end_by(self, error: Exception, where: str) -> None:
        """End by an error, without its variables on the pilot's terminal."""
        self.errors.add(error, where)
        self.crash = self.crash or error_words(error)
        self.exit(return_code=EXIT_CRASHED)

    def _handle_exception(self, error: Exception) -> None:
        """Contain an error in a timer, a worker or one of Textual's own widgets; Textual calls this.

        The one private name of Textual's that is used: such an error comes to nothing public, and ends the app.
        """
        if self.is_closed_before(error):
            return
        pump = failed_pump(error)
        where = type(pump).__name__
        if not (self.is_running and self.contain(error, where)):
            self.end_by(error, where)
        elif isinstance(pump, Widget) and pump.is_attached:
            self.set_timer(LEAVING_DELAY, partial(self._leave_broken, pump, pump.screen))

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
