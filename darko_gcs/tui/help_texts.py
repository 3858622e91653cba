"""What the help says beside the keys."""

from __future__ import annotations

from textual.binding import Binding
from textual.screen import Screen

__all__ = ["COLOUR_MEANINGS", "KEY_SYMBOLS", "QUESTION_RULES", "screen_keys"]

KEY_SYMBOLS = {
    "question_mark": "?",
    "plus": "+",
    "minus": "-",
    "equals_sign": "=",
    "less_than_sign": "<",
    "greater_than_sign": ">",
}
QUESTION_RULES = [
    (
        "asks",
        "everything that moves, stops or drops the vehicle, and quitting while it is armed or the plan would be lost "
        "(q, Ctrl+Q, Ctrl+C)",
    ),
    ("does not ask", "edits of the plan: z takes them back, Z makes them again"),
    (
        "typed ahead",
        "keys reach the form that they were typed for, never a question: it is answered after it is on the screen",
    ),
    (
        "closed",
        "terminal: the ground station ends at once and notes it in the recording, and stops the simulator of --sitl. "
        "A vehicle of its own flies on, and acts on the lost link (NAV_DLL_ACT)",
    ),
]
COLOUR_MEANINGS = [
    ("bold", "what holds now: mode, law, choice"),
    ("green", "good, and what was flown"),
    ("blue", "planned"),
    ("magenta", "where it flies to now"),
    ("amber", "warning"),
    ("red", "danger: armed, failed, lost"),
]


def screen_keys(screen: Screen[object]) -> list[tuple[str, str]]:
    """Keys and texts of a screen's own bindings."""
    bindings = (binding for binding in screen.BINDINGS if isinstance(binding, Binding) and binding.description)
    return [
        (
            binding.key_display or binding.key.split(",")[0].replace("escape", "esc"),
            binding.tooltip or binding.description,
        )
        for binding in bindings
    ]
