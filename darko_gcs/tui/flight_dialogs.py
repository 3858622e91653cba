"""What the flight screen asks: whether to go to a place of the map, and which panels to show."""

from __future__ import annotations

from collections.abc import Callable

from textual.app import App

from darko_gcs.feed.feed import Feed
from darko_gcs.station.station import Station
from darko_gcs.tui.actions import Request
from darko_gcs.tui.fleet_dialogs import named
from darko_gcs.tui.render.map_drawing import NorthEast
from darko_gcs.tui.screens.dialogs import ChooseScreen, ConfirmScreen
from darko_gcs.tui.screens.flight_screen import OPTIONAL_PANELS, FlightScreen
from protocol.dialect import mavlink

__all__ = ["ask_go_to_place", "choose_panels"]


def ask_go_to_place(app: App[int], feed: Feed, place: NorthEast, request: Callable[[Request], None]) -> None:
    """Ask, then go to a place of the map at the present height.

    Args:
        app: Shows the question.
        feed: Of the vehicle.
        place: North and east in its local frame [m].
        request: Sends a request to it.
    """
    s = feed.snapshot
    if not s.is_airborne or s.from_home is None:
        app.notify("The vehicle is not in the air: nothing was sent", severity="warning")
        return
    north, east, height = place[0] - s.home_p[0], place[1] - s.home_p[1], -s.from_home[2]

    def go(station: Station, now: float) -> None:
        station.go_to(north, east, height, now)

    def answered(yes: bool | None) -> None:
        if yes:
            request(go)

    left = " The mission that is being flown is left." if s.mission_state == mavlink.MISSION_STATE_ACTIVE else ""
    question = f"Go to {north:.1f} m north, {east:.1f} m east of home at {height:.1f} m above it?{left}"
    app.push_screen(ConfirmScreen(named(feed, question)), answered)


def choose_panels(app: App[int], screen: FlightScreen, changed: Callable[[], None]) -> None:
    """Ask which panel to show or hide, do so, and tell that it was done."""
    names = list(OPTIONAL_PANELS)
    choices = [f"{'Show' if name in screen.hidden else 'Hide'} {OPTIONAL_PANELS[name]}" for name in names]

    def chosen(index: int | None) -> None:
        if index is not None:
            screen.show_panels(screen.hidden ^ {names[index]})
            changed()

    app.push_screen(ChooseScreen("Panels that are shown where there is room", choices), chosen)
