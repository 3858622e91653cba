"""Texts of the help beside the keys."""

from __future__ import annotations

from collections.abc import Iterable

from textual.binding import Binding
from textual.screen import Screen

from darko_gcs.tui.actions import Action

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


Rows = list[tuple[str, str]]  # keys, text


def help_sections(
    screen: Screen[object], actions: Iterable[Action], player_keys: Rows, *, is_live: bool
) -> list[tuple[str, Rows]]:
    """Title and rows of each section of a screen's help; a key stands in the first one that has it.

    Args:
        screen: Below the help.
        actions: Those that can be done there.
        player_keys: Of a recording.
        is_live: Whether there may be a vehicle.
    """
    here = screen_keys(screen)
    known = {key for keys, _ in (*here, *player_keys) for key in keys.split()}
    rows = [(KEY_SYMBOLS.get(action.key, action.key), action.help) for action in actions if action.key not in known]
    sections = [("Keys of this screen", here), ("Recording", player_keys), ("Keys", rows)]
    sections += [("Confirmations and exits", QUESTION_RULES if is_live else []), ("Colours", COLOUR_MEANINGS)]
    return [(title, rows) for title, rows in sections if rows]


def screen_keys(screen: Screen[object]) -> Rows:
    """Keys and texts of a screen's own bindings."""
    bindings = (binding for binding in screen.BINDINGS if isinstance(binding, Binding) and binding.description)
    return [
        (
            binding.key_display or binding.key.split(",")[0].replace("escape", "esc"),
            binding.tooltip or binding.description,
        )
        for binding in bindings
    ]
