"""The keys of the mission screen, in the order of the lower line; a small terminal has room for the first of them."""

from __future__ import annotations

from textual.binding import Binding, BindingType

__all__ = ["MISSION_KEYS", "NOT_IN_A_REPLAY"]

NOT_IN_A_REPLAY = frozenset({"edit_plan", "upload", "start", "fly_from", "fetch", "set_current", "clear"})

MISSION_KEYS: list[BindingType] = [
    Binding("tab", "other_part", "Map", tooltip="From the table to the map, and back"),
    Binding("e,enter", "edit_plan('edit')", "Edit", priority=True, key_display="e", tooltip="Edit the item"),
    Binding("i", "edit_plan('insert', 1)", "Ins", tooltip="Insert an item below"),
    Binding("x,delete", "edit_plan('remove')", "Del", key_display="x", tooltip="Remove the item"),
    Binding("u", "upload", "Upload", tooltip="Send the plan to the vehicle, and read it back"),
    Binding("s", "start", "Run", tooltip="Fly the mission from its first item, or resume it"),
    Binding("o", "open", "Open", tooltip="Open a plan file"),
    Binding("m,escape", "close", "Back", tooltip="Back to the flight; Esc, too"),
    Binding("question_mark", "app.act('help')", "Help", key_display="?", tooltip="These keys"),
    Binding("w", "save", "Save", tooltip="Write the plan to a file"),
    Binding("space", "edit_plan('way')", "Way", tooltip="Fly the leg in hover, in cruise, or let the vehicle choose"),
    Binding("z,ctrl+z", "edit_plan('undo')", "Undo", key_display="z", tooltip="Undo the last edit"),
    Binding("equals_sign", "compare", "Differ", key_display="=", tooltip="What differs from vehicle and file"),
    Binding("f", "fetch", "Fetch", tooltip="Fetch the vehicle's plans"),
    Binding("S", "fly_from", "Run from", show=False, tooltip="Fly the mission from the item"),
    Binding("j", "set_current", "Jump", show=False, tooltip="Continue the running mission at this item"),
    Binding("c", "clear", "Clear", show=False, tooltip="Delete a plan on the vehicle"),
    Binding("I", "edit_plan('insert', 0)", "Insert above", show=False, tooltip="Insert an item above"),
    Binding("D", "edit_plan('duplicate')", "Duplicate", show=False, tooltip="Duplicate the item"),
    Binding("Z,ctrl+y", "edit_plan('redo')", "Redo", show=False, tooltip="Redo the last undone edit"),
    Binding("shift+up", "edit_plan('move', -1)", "Move up", show=False, tooltip="Move the item up"),
    Binding("shift+down", "edit_plan('move', 1)", "Move down", show=False, tooltip="Move the item down"),
    Binding(
        "less_than_sign", "edit_plan('step', -1)", "Finer", show=False, key_display="<", tooltip="Map: smaller steps"
    ),
    Binding(
        "greater_than_sign", "edit_plan('step', 1)", "Wider", show=False, key_display=">", tooltip="Map: larger steps"
    ),
]
