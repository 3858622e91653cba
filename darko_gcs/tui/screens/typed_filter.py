"""A list that is filtered by what is typed: its field says so, and Esc first clears it, then leads back.

Whoever types a flight key there must see that it became a part of the filter.
"""

from __future__ import annotations

from textual.binding import Binding
from textual.screen import Screen
from textual.widgets import Input

TYPING = "typing filters, Esc goes back"
TYPING_KEYS = (
    Binding("escape", "clear_filter", "Clear", priority=True, tooltip="Clear the filter; then Esc goes back"),
    Binding("escape", "close", "Back", priority=True),
)
TYPED = "-typed"  # class of a field with text, which stands out


def is_filtered(screen: Screen[None]) -> bool:
    """True while something is typed into the screen's filter."""
    return any(field.value for field in screen.query("#filter").results(Input))


def can_leave(screen: Screen[None], action: str) -> bool:
    """False of the one of Esc's two actions that does not hold now; true of any other action."""
    if action == "clear_filter":
        return is_filtered(screen)
    return action != "close" or not is_filtered(screen)


def show_typing(screen: Screen[None]) -> None:
    """Let the field stand out while it has text, and the footer say what Esc does."""
    screen.query_one("#filter", Input).set_class(is_filtered(screen), TYPED)
    screen.refresh_bindings()


def typed_words(screen: Screen[None]) -> str:
    """The filter, for the line that counts what is left: "filter 'ab'"; empty without one."""
    text = screen.query_one("#filter", Input).value
    return f"filter {text!r} (Esc clears it): " if text else ""
