"""Theme and panels as the operator chose them, kept between sessions."""

from __future__ import annotations

from textual.app import App
from textual.constants import DEFAULT_THEME

from darko_gcs.preferences import FAULT_SHOWN_TIME, PreferencesFile
from darko_gcs.tui.screens.flight_screen import OPTIONAL_PANELS, FlightScreen
from protocol.errors import FileError


class KeptLook:
    """Restores the look at the beginning, then keeps what changes.

    Args:
        app: Has the theme, and the flight screen at the bottom.
        preferences: Where it is kept; None keeps nothing.
    """

    def __init__(self, app: App[int], preferences: PreferencesFile | None) -> None:
        self._app, self.preferences = app, preferences
        self._is_restored = False

    def restore(self) -> None:
        """Show the kept theme and panels; an error of the file is shown instead, and the file stays as it is."""
        if self.preferences is None:
            return
        try:
            known = self.preferences.load()
        except FileError as error:
            self._app.notify(str(error), severity="warning", timeout=FAULT_SHOWN_TIME)
            return
        wrong = [f"theme {known.theme!r}"] if known.theme and known.theme not in self._app.available_themes else []
        wrong += [f"panel {name!r}" for name in sorted(known.hidden_panels - OPTIONAL_PANELS.keys())]
        if wrong:
            self._app.notify(
                f"{self.preferences.path}: there is no {', no '.join(wrong)}",
                severity="warning",
                timeout=FAULT_SHOWN_TIME,
            )
            return
        if known.theme:
            self._app.theme = known.theme
        for screen in self._screens():
            screen.show_panels(known.hidden_panels)
        self._is_restored = True

    def keep(self) -> None:
        """Keep theme and panels, if they have changed."""
        if self.preferences is None or not self._is_restored:
            return
        known = self.preferences.load()
        hidden = next((screen.hidden for screen in self._screens()), known.hidden_panels)
        is_own = known.theme or self._app.theme != DEFAULT_THEME
        look = known._replace(hidden_panels=hidden, theme=self._app.theme if is_own else "")
        try:
            if look != known:
                self.preferences.save(look)
        except FileError as error:
            self._app.notify(f"Theme and panels not saved: {error}", severity="warning", timeout=FAULT_SHOWN_TIME)

    def _screens(self) -> list[FlightScreen]:
        return [screen for screen in self._app.screen_stack if isinstance(screen, FlightScreen)]
