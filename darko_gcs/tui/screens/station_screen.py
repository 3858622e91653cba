"""Base of the station's screens and dialogs: they know how small they are, and outlive an error in their handlers."""

from __future__ import annotations

from typing import ClassVar, TypeVar

from textual import events, on
from textual.screen import ModalScreen, Screen

from darko_gcs.tui.containment import ContainingPump

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
