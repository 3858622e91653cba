"""Help beside the keys, and the command palette: every action and key, found by its words or by another word."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from textual.actions import parse
from textual.app import App
from textual.binding import Binding, BindingType
from textual.command import DiscoveryHit, Hit, Hits, Provider
from textual.dom import DOMNode
from textual.screen import Screen
from textual.widgets import Input

from darko_gcs.state.arena import net_words
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.actions import Action
from darko_gcs.tui.help_words import Rows, screen_words
from darko_gcs.tui.screens.charts_screen import ChartsScreen
from darko_gcs.tui.screens.flight_plan_screen import FlightPlanScreen
from darko_gcs.tui.screens.inspector_screen import InspectorScreen
from darko_gcs.tui.screens.jumps_screen import JumpsScreen
from darko_gcs.tui.screens.messages_screen import MessagesScreen
from darko_gcs.tui.screens.mission_screen import MissionScreen
from darko_gcs.tui.screens.parameters_screen import ParametersScreen

KEY_SYMBOLS = {
    "question_mark": "?",
    "plus": "+",
    "minus": "-",
    "equals_sign": "=",
    "less_than_sign": "<",
    "greater_than_sign": ">",
}
ARROWS = {"←": "left", "→": "right", "↑": "up", "↓": "down"}
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


def help_sections(
    screen: Screen[object], actions: Iterable[Action], player_keys: Rows, own: Mapping[str, str], *, is_live: bool
) -> list[tuple[str, Rows]]:
    """Title and rows of each section of a screen's help; a key stands in the first one that has it.

    Where a field of the screen takes what is typed, only keys that are no letters stand in it.

    Args:
        screen: Below the help.
        actions: Those that can be done there.
        player_keys: Of a recording.
        own: The pilot's own keys, by the names of bindings.
        is_live: Whether there may be a vehicle.
    """
    first = {binding.key for binding in _player_bindings(screen.app) if binding.priority}
    here = _without(screen_keys(screen, own), first if player_keys else set())
    player_keys = _without(player_keys, _single_keys(here))
    keys = {action.help: own.get(action.name, action.key) for action in actions}
    shown = [(KEY_SYMBOLS.get(key, key), text) for text, key in keys.items()]
    rows = _without(shown, _single_keys((*here, *player_keys)))
    if isinstance(screen.focused, Input):
        rows = [(key, text) for key, text in rows if len(key) > 1]
    sections = [("Keys of this screen", here), ("Recording", player_keys), ("Keys", rows)]
    sections.append(("Words and signs", screen_words(screen)))
    sections += [("Confirmations and exits", QUESTION_RULES if is_live else []), ("Colours", COLOUR_MEANINGS)]
    return [(title, rows) for title, rows in sections if rows]


def _single_keys(rows: Iterable[tuple[str, str]]) -> set[str]:
    """Each key of the rows by itself, arrows by their names."""
    return {ARROWS.get(key, key) for keys, _ in rows for key in keys.split()}


def _without(rows: Rows, taken: set[str]) -> Rows:
    """The rows that have a key that is not taken."""
    return [row for row in rows if not _single_keys([row]) <= taken]


def screen_bindings() -> list[BindingType]:
    """Bindings of the screens that actions open, with names for the file of the pilot's own keys."""
    return [binding for kind, _ in SCREENS.values() for binding in kind.BINDINGS]


def _shown_key(binding: Binding, own: Mapping[str, str]) -> str:
    if binding.id is not None and binding.id in own:
        key = own[binding.id]
        return KEY_SYMBOLS.get(key, key)
    return binding.key_display or KEY_SYMBOLS.get(binding.key, binding.key.split(",")[0].replace("escape", "esc"))


def screen_keys(screen: Screen[object], own: Mapping[str, str]) -> Rows:
    """Keys and texts of the bindings of a screen and its parts that hold now."""
    parts = (part for part in screen.walk_children(with_self=True) if not type(part).__module__.startswith("textual."))
    rows = (
        (_shown_key(binding, own), binding.tooltip or binding.description)
        for part in parts
        for binding in _own_bindings(part, (type(part),) if part is screen else type(part).__mro__)
        if binding.description and holds(part, binding)
    )
    return list(dict(rows).items())


def _own_bindings(part: DOMNode, kinds: Iterable[type]) -> list[Binding]:
    """Bindings that some of our own classes of a part declare."""
    own = (kind for kind in kinds if kind.__module__.startswith(type(part).__module__.split(".")[0]))
    return [binding for kind in own for binding in kind.__dict__.get("BINDINGS", ()) if isinstance(binding, Binding)]


def holds(part: DOMNode, binding: Binding) -> bool:
    """Whether a binding does something as the screen is now."""
    _, name, parameters = parse(binding.action)
    return part.check_action(name, parameters) is not False


SCREENS: Mapping[str, tuple[type[Screen[Any]], str]] = {  # by the action that opens each
    "mission": (MissionScreen, "Plan"),
    "parameters": (ParametersScreen, "Parameters"),
    "flight_plan": (FlightPlanScreen, "Flight plan"),
    "messages": (MessagesScreen, "Messages"),
    "inspector": (InspectorScreen, "Inspector"),
    "charts": (ChartsScreen, "Charts"),
    "jumps": (JumpsScreen, "Jumps"),
}
OTHER_WORDS = {  # what people call it elsewhere, by the action's name
    "arm": "start motors engines spin",
    "disarm": "stop motors engines kill cut emergency",
    "take_off": "takeoff launch climb ascend height altitude",
    "hold": "loiter pause brake wait",
    "land": "descend down touchdown",
    "return": "rtl launch home back",
    "set_home": "origin position",
    "go_to": "goto fly reposition guided waypoint north east height altitude climb descend higher lower",
    "transition": "vtol forward hover cruise backtransition",
    "cancel": "abort stop vtol",
    "speed": "airspeed velocity slower faster",
    "by_hand": "manual sticks posctl joystick keyboard nudge wasd",
    "gamepad": "manual sticks posctl joystick controller xbox",
    "preflight": "checklist preflight prearm checks ready",
    "failure": "fail inject fault test",
    "other_plan": "fence geofence rally polygon circle keep out",
    "control": "operator authority handover",
    "start": "run fly auto resume begin",
    "mission": "plan waypoints route survey",
    "flight_plan": "paparazzi blocks",
    "parameters": "params settings gains tuning configuration wind gusts",
    "messages": "log statustext events errors warnings console",
    "inspector": "mavlink messages rates fields bits inspector telemetry",
    "jumps": "lyapunov jump law laws supervisor automaton switch hybrid decision",
    "charts": "lyapunov plot graph curve expression time history scope",
    "acknowledge": "ack alarm bell seen silence",
    "follow": "center",
    "panels": "layout hide view",
    "fleet": "swarm all vehicles",
    "next_vehicle": "switch select",
    "help": "keys shortcuts manual",
    "restart": "reboot simulator sitl reset",
    "quit": "exit close leave",
    "upload": "send write transfer",
    "fetch": "download read load",
    "clear": "delete erase remove wipe",
    "open": "load file import read",
    "save": "write file export store",
    "compare": "difference diff",
}


TITLE_WEIGHT = 3.0  # of a word of the title, beside one that it is called elsewhere


def _words(text: str) -> list[str]:
    return re.findall(r"[^\s,:;()/]+", text.lower())


def _rank(part: str, words: Sequence[str]) -> float:
    """2 for a whole word, more than 1 for the beginning of one, the more the nearer to the front; 0: none."""
    found = [
        (2.0 if word == part else 1.0) / (1.0 + 0.01 * at) for at, word in enumerate(words) if word.startswith(part)
    ]
    return max(found, default=0.0)


@dataclass(frozen=True)
class PaletteEntry:
    """A line of the palette."""

    title: str
    help: str
    run: Callable[[], object]
    words: str = ""  # other ones that it is found by

    def score(self, query: str) -> float:
        """Rank for a query, whose parts all begin words of the title, or of the other words; 0: not found.

        Letters within words find nothing: "arm" is not in "warm".
        """
        asked = _words(query)
        title, others = _words(self.title), _words(f"{self.words} {self.help}")
        ranks = [_rank(part, title) * TITLE_WEIGHT + _rank(part, others) for part in asked]
        return sum(ranks) if ranks and all(ranks) else 0.0


class StationCommands(Provider):
    """Looks the entries of the app up."""

    def _entries(self) -> Iterable[PaletteEntry]:
        app: Any = self.app
        entries: Iterable[PaletteEntry] = app.palette_entries(self.screen)
        return entries

    async def discover(self) -> Hits:
        """All of them, before anything is typed."""
        for entry in sorted(self._entries(), key=lambda entry: entry.title):
            yield DiscoveryHit(entry.title, entry.run, help=entry.help)

    async def search(self, query: str) -> Hits:
        """Those that a query names."""
        for entry in self._entries():
            score = entry.score(query)
            if score > 0.0:
                yield Hit(score, entry.title, entry.run, help=entry.help)


def action_entries(
    actions: Iterable[Action], run: Callable[[str], object], own: Mapping[str, str]
) -> list[PaletteEntry]:
    """An entry for each of the table's actions.

    Args:
        actions: Those that can be done.
        run: Runs one by its name.
        own: The pilot's own keys, by the names of actions.
    """
    return [
        PaletteEntry(
            action.palette_title, _key_text(action, own), partial(run, action.name), OTHER_WORDS.get(action.name, "")
        )
        for action in actions
    ]


def _key_text(action: Action, own: Mapping[str, str]) -> str:
    used = own.get(action.name, action.key)
    key = f"Key {KEY_SYMBOLS.get(used, used)}"
    return key if action.help == action.palette_title else f"{key}: {action.help}"


def screen_entries(
    app: App[Any], shown: Screen[object], openers: Mapping[str, Action], own: Mapping[str, str]
) -> list[PaletteEntry]:
    """An entry for each key of the screens. On another screen it opens the key's own one and tells the key.

    Args:
        app: Runs it.
        shown: The screen below the palette.
        openers: The actions that open screens, by name.
        own: The pilot's own keys, by the names of bindings.
    """
    entries = []
    here = {} if any(isinstance(shown, kind) for kind, _ in SCREENS.values()) else {"": (type(shown), "Here")}
    for name, (kind, title) in {**SCREENS, **here}.items():
        if name not in openers and not isinstance(shown, kind):
            continue
        for binding in kind.BINDINGS:
            told = isinstance(binding, Binding) and (binding.tooltip or binding.description)
            if isinstance(shown, kind) and isinstance(binding, Binding) and not holds(shown, binding):
                continue
            if isinstance(binding, Binding) and told and not binding.action.startswith("app."):
                key = _shown_key(binding, own)
                words = f"{binding.description} {OTHER_WORDS.get(_bare(binding.action), '')}"
                run: Callable[[], object] = partial(app.run_action, binding.action, shown)
                how = f"Key {key}"
                if not isinstance(shown, kind):
                    run = partial(_open, app, name, f"{key}: {told}")
                    how = f"Keys {own.get(name, openers[name].key)} {key}"
                entries.append(PaletteEntry(f"{title}: {told}", how, run, words))
    return entries


def place_entries(
    app: App[Any], s: Snapshot, live_page: str, recording: str, open_overlay: Callable[[], object]
) -> list[PaletteEntry]:
    """Entries about what has no key: pages, files and shell commands.

    Args:
        app: Shows where it is.
        s: Has the net that is flown under.
        live_page: Address of the page in 3-D; empty without one.
        recording: File of this flight; empty without one.
        open_overlay: Asks for a file of shapes.
    """
    told = (
        ("Arena: net and walls", net_words(s) or "The vehicle tells of no net", "net walls cage voliere limits fence"),
        ("Live 3-D page", live_page or "Not open: start darko-gcs with --live-3d", "3d browser view"),
        ("Recording of this flight", recording or "There is none", "record tlog file"),
        ("Replay of a flight", f"In a shell: darko-gcs replay {recording or 'FILE'}", "play recording again"),
        ("Report of a flight", f"In a shell: darko-gcs log report {recording or 'FILE'}", "report summary html"),
    )
    entries = [
        PaletteEntry(title, text, partial(app.notify, text, title=title, markup=False), words)
        for title, text, words in told
    ]
    words = "overlay geojson kml shapes buildings"
    return [*entries, PaletteEntry("Lay a file of shapes over the maps", "GeoJSON or KML", open_overlay, words)]


def player_entries(app: App[Any]) -> list[PaletteEntry]:
    """An entry for each key of a recording's player, which are the app's own."""
    return [
        PaletteEntry(
            f"Recording: {binding.tooltip}",
            f"Key {_shown_key(binding, {})}",
            partial(app.run_action, binding.action),
            "seek jump time" if binding.action.startswith(("seek", "go", "mark")) else "",
        )
        for binding in _player_bindings(app)
    ]


def _player_bindings(app: App[Any]) -> list[Binding]:
    own = (kind for kind in type(app).__mro__ if not kind.__module__.startswith("textual."))
    bindings = (binding for kind in own for binding in kind.__dict__.get("BINDINGS", ()))
    return [
        binding
        for binding in bindings
        if isinstance(binding, Binding) and binding.tooltip and not binding.action.startswith("act(")
    ]


async def _open(app: App[Any], name: str, told: str) -> None:
    """Open the screen of a key, which acts on what is chosen there: nothing is done unseen."""
    await app.run_action(f"act('{name}')")
    app.notify(told)


def _bare(action: str) -> str:
    """The name of an action, of an edit without its arguments."""
    name, _, arguments = action.partition("(")
    return arguments.split("'")[1] if name == "edit_plan" else name
