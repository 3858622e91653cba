"""The colours that the station writes with: those of the theme, made to read on each of its backgrounds.

Ratio and relative luminance: WCAG 2.2, success criterion 1.4.3 (https://www.w3.org/TR/WCAG22/#contrast-minimum).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from textual.color import Color

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
