"""Words and signs of each screen, with their meanings: a section of its help."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from textual.screen import Screen

from darko_gcs.tui.screens.charts_screen import ChartsScreen
from darko_gcs.tui.screens.flight_screen import FlightScreen
from darko_gcs.tui.screens.inspector_screen import InspectorScreen
from darko_gcs.tui.screens.jumps_screen import JumpsScreen
from darko_gcs.tui.screens.mission_screen import MissionScreen
from protocol.flight_log.field_expressions import PANEL_NAMES

Rows = list[tuple[str, str]]  # words, meaning
SCREEN_WORDS: Mapping[type[Screen[Any]], Rows] = {
    FlightScreen: [
        ("V:", "how far the flight is from what a linear law holds (its Lyapunov function); INDI flies at any V"),
        ("hover 0.3 (1/2.5)", "V of the linear hover law: it takes over below 1, and gives up above 2.5"),
        (
            "INDI stays",
            "INDI also flies landings, and in an estimated wind from above 4 m/s until it is below 3 m/s",
        ),
        (
            "fwd 1 (5/20)",
            "the same of the linear law of forward flight, off where DRK_FWD_LIN is 0; h, f: their curves",
        ),
        ("jump", "a change of law, with its cause"),
        ("governor", "how much a far target is held back, so that the law stays in its region"),
        ("ML MR EL ER", "motors and elevons, left and right; bars go to the limits, | is the command"),
        ("nose, tilt", "angle of the nose above the horizon, and from upright"),
        ("speed 2→5", "the speed, and the one asked for: by c, the mission, or the vehicle's parameter"),
        ("±3 unobserved", "standard deviation of the estimated wind, only a guess on the ground and often in a hover"),
        ("lost", "no reading tells north and east: they are dead reckoning, and not drawn as flown"),
        ("worst reading", "the instrument farthest from what the filter expects; up to 1 it is believed"),
        ("off track", "distance from the leg; target: from where it flies to"),
        ("map", "↑ vehicle, H home, + where it flies to, 2 3m item 2 at 3 m above home"),
        ("↗ wind", "as the vehicle estimates it; the arrow goes with the wind. true, in truth: only a simulator knows"),
        ("leg to 2", "how the vehicle flies to item 2, and why; a past leg is not flown any more"),
        ("saturated", "the controller asks an actuator for more than it has, here for some of the thrust or a moment"),
        ("boost", "more thrust than asked for, so that the elevons have the flow that they need"),
        ("mission 1/5", "at item 1, the last one is 5; items count from 0"),
        ("link 180/s", "messages a second; loss: share that did not arrive"),
        ("REC", "this flight is being recorded"),
    ],
    MissionScreen: [
        ("alt", "rel: above home; AMSL: above the sea"),
        ("leg, climb", "length and climb of the leg to the item, in metres"),
        ("then hover", "an item that says how the legs after it are flown; Space puts it in"),
        ("by", "hover, cruise (forward flight), or auto: the vehicle chooses"),
        ("hover s J", "time and energy that the vehicle predicts in hover; cruise: in forward flight; * is chosen"),
        ("flown s J", "what the leg took, beside what was predicted as it began"),
        (
            "map",
            "◆ the chosen item, 2 3m item 2 at 3 m up, ! a low leg, ✗ one through an obstacle or out of the fence",
        ),
        ("predicted", "of the legs alone: loiters, waits and the landing come on top"),
        ("step", "how far an arrow key moves the chosen item: < and > change it"),
    ],
    InspectorScreen: [
        ("1/1 autopilot", "system and component that send"),
        ("now/s, mean/s", "messages a second in the last 5 s, and since the first one"),
        ("→ set", "the set-point: what is asked for, beside what is"),
    ],
    JumpsScreen: [
        ("boot time", "since the vehicle was switched on"),
        ("V:", "of the linear law, at the jump"),
    ],
    ChartsScreen: [
        ("expression", "fields, numbers, + - * / **, and deg rad abs sqrt exp log10 sin cos hypot atan2 min max"),
        ("names", f"for what the panels show: {' '.join(PANEL_NAMES)}"),
        (
            "ATTITUDE",
            "of a DarkO in the hover frame: 0 upright, pitch -90 deg in level forward flight, where nose is 0",
        ),
        ("axes", "at the left; one with a unit is of the curves of this quantity: cm/s share the axis of m/s"),
        ("a b c", "each curve by its letter; marks on the time axis are changes of law and mode"),
    ],
}


def screen_words(screen: Screen[Any]) -> Rows:
    """Words of a screen, with their meanings; none if it has no words of its own."""
    return next((rows for kind, rows in SCREEN_WORDS.items() if isinstance(screen, kind)), [])
