"""Errors of the station's own code end a panel or a dialog, never the station of a vehicle that flies."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable
from functools import partial
from typing import Any, ClassVar

from platformdirs import user_state_path
from textual._callback import invoke
from textual._context import active_message_pump
from textual.app import App
from textual.message import Message
from textual.message_pump import MessagePump
from textual.screen import Screen
from textual.widget import Widget

from darko_gcs.tui.error_log import ErrorLog, error_words

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

    async def _guarded(self, handler: Callable[[Message], object], message: Message) -> None:
        try:
            await invoke(handler, message)
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
        pump = active_message_pump.get(None)
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
