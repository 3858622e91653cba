"""The station's colours on each theme's background, and theme and panels as the operator chose them.

Ratio and relative luminance: WCAG 2.2, success criterion 1.4.3 (https://www.w3.org/TR/WCAG22/#contrast-minimum).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from textual.app import App
from textual.color import Color
from textual.constants import DEFAULT_THEME

from darko_gcs.preferences import FAULT_SHOWN_TIME, PreferencesFile
from darko_gcs.tui.screens.flight_screen import OPTIONAL_PANELS, FlightScreen
from protocol.errors import FileError

MIN_CONTRAST = 4.5  # of text, and of the marks of a chart or a map, against what is behind it [-]
GROUNDS = ("background", "surface")  # theme colours behind panels, bars and dialogs
FOOTER_GROUND = "footer-background"
INKS = {  # by the name in the stylesheet: the theme's colour, or one of our own
    "ink": "foreground", "ink-good": "success", "ink-warn": "warning", "ink-bad": "error",
    "ink-plan": "primary-lighten-2", "ink-now": "#d75fd7", "ink-hover": "#5fd7d7", "ink-forward": "#af87ff",
}  # fmt: skip
FOOTER_INKS = {"ink-key": "primary-lighten-3", "ink-footer": "footer-foreground"}
DIM = 0.4  # of the way from text to background, as far as it reads [-]
STEPS = 40  # from a colour to black or white


def with_inks(variables: Mapping[str, str]) -> dict[str, str]:
    """The variables of a theme, and the inks made of them. Colours of the terminal's own are left as they are."""

    def colour(name: str) -> Color:
        return Color.parse(variables.get(name, name))

    grounds = [colour(name) for name in GROUNDS]
    inks = {name: readable(colour(source), grounds) for name, source in INKS.items()}
    inks |= {name: readable(colour(source), [colour(FOOTER_GROUND)]) for name, source in FOOTER_INKS.items()}
    is_known = _is_known([inks["ink"], *grounds])
    inks["ink-dim"] = readable(inks["ink"].blend(grounds[0], DIM), grounds) if is_known else inks["ink"]
    inks["ink-on-cursor"] = readable(Color.parse("white"), [colour("primary")])
    return {**variables, **{name: ink.css if ink.ansi is not None else ink.hex for name, ink in inks.items()}}


def readable(colour: Color, grounds: Sequence[Color], ratio: float = MIN_CONTRAST) -> Color:
    """The colour, moved towards black or white as far as it must be to read on all grounds."""
    if not _is_known([colour, *grounds]):
        return colour
    ends = [Color(0, 0, 0), Color(255, 255, 255)]
    end = max(ends, key=lambda end: _worst(end, grounds))
    steps = (colour.blend(end, step / STEPS) for step in range(STEPS + 1))
    return next((shade for shade in steps if _worst(shade, grounds) >= ratio), end)


def contrast(first: Color, second: Color) -> float:
    """Contrast ratio of two colours, 1..21."""
    dark, light = sorted((_luminance(first), _luminance(second)))
    return (light + 0.05) / (dark + 0.05)


def _worst(colour: Color, grounds: Sequence[Color]) -> float:
    return min(contrast(colour, ground) for ground in grounds)


def _luminance(colour: Color) -> float:
    parts = (part / 255.0 for part in colour.rgb)
    red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def _is_known(colours: Sequence[Color]) -> bool:
    """False if one is a colour of the terminal, whatever that is."""
    return all(colour.ansi is None for colour in colours)


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
