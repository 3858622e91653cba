"""Dialogs of the flight screen: heights, points and speeds, a place of the map, and the choice of panels."""

from __future__ import annotations

from collections.abc import Callable

from textual.app import App

from darko_gcs.feed.feed import Feed
from darko_gcs.state.missions.mission_legs import FLOWN_MISSION
from darko_gcs.station.station import Station
from darko_gcs.tui.actions import Request, start_question
from darko_gcs.tui.fleet_dialogs import named
from darko_gcs.tui.plan_draft import PlanDraft
from darko_gcs.tui.render.map_drawing import NorthEast
from darko_gcs.tui.screens.dialogs import AskScreen, ChooseScreen, confirm, parse_number
from darko_gcs.tui.screens.flight_screen import OPTIONAL_PANELS, FlightScreen
from protocol.dialect import mavlink
from protocol.limits import MIN_FORWARD_HEIGHT

FORWARD_STATES = frozenset({mavlink.MAV_VTOL_STATE_FW, mavlink.MAV_VTOL_STATE_TRANSITION_TO_FW})

SPEED_KINDS = {"air": False, "a": False, "0": False, "ground": True, "g": True, "1": True}  # whether over ground

Send = Callable[[Request], None]  # sends a request to the vehicle


def ask_take_off(app: App[int], feed: Feed, request: Send) -> None:
    """Ask for the height, then take off."""

    def answered(values: tuple[str, ...] | None) -> None:
        if values is not None:
            height = float(values[0])
            request(lambda station, now: station.take_off(height, now))

    app.push_screen(AskScreen(named(feed, "Take off"), [("Height above home [m]", "3")]), answered)


def ask_go_to(app: App[int], feed: Feed, request: Send) -> None:
    """Ask for the point, then go there."""
    p = feed.snapshot.from_home or (0.0, 0.0, -3.0)
    fields = [
        ("North of home [m]", f"{round(p[0], 1) + 0.0:.1f}"),
        ("East of home [m]", f"{round(p[1], 1) + 0.0:.1f}"),
        ("Height above home [m]", f"{-p[2]:.1f}"),
    ]

    def answered(values: tuple[str, ...] | None) -> None:
        if values is not None:
            north, east, height = (float(value) for value in values)
            request(lambda station, now: station.go_to(north, east, height, now))

    app.push_screen(AskScreen(named(feed, "Go to"), fields), answered)


def ask_speed(app: App[int], feed: Feed, request: Send) -> None:
    """Ask for the speed, then fly at it; the vehicle answers if it can."""
    fields = [("Speed [m/s]", ""), ("Through the air, or over ground", "air")]

    def check(values: tuple[str, ...]) -> str | None:
        if parse_number(values[0]) is None:
            return f"Speed: {values[0]!r} is not a number"
        return None if values[1].lower() in SPEED_KINDS else "Type air for an airspeed, ground for a ground speed"

    def answered(values: tuple[str, ...] | None) -> None:
        if values is not None:
            speed, over_ground = float(values[0]), SPEED_KINDS[values[1].lower()]
            request(lambda station, now: station.change_speed(speed, now, over_ground=over_ground))

    app.push_screen(AskScreen(named(feed, "Change speed"), fields, check), answered)


def ask_start(app: App[int], feed: Feed, draft: PlanDraft, request: Send) -> None:
    """Ask, then fly the mission that the vehicle has; a plan that was edited and not uploaded is another one."""
    s, question = feed.snapshot, start_question(feed.snapshot)
    if s.mission_count == 0:
        app.notify("The vehicle has no mission: nothing was sent. m shows the plan, u sends it", severity="warning")
        return
    if draft.changed and draft.plan.items:
        if s.mission_state not in FLOWN_MISSION:
            words = "The vehicle does not have the plan that you edited: m shows it, u sends it. Nothing was sent"
            app.notify(words, severity="warning")
            return
        question += " This is the vehicle's own mission, not the plan that you edited."
    confirm(app, named(feed, question), lambda: request(lambda station, now: station.plans.start_mission(now)))


def ask_transition(app: App[int], feed: Feed, request: Send) -> None:
    """Ask, then transition in the direction of the question, whatever the state is by then."""
    s = feed.snapshot
    forward = s.vtol_state not in FORWARD_STATES
    question = "Transition to forward flight?" if forward else "Transition back to hover?"
    height = None if s.from_home is None else -s.from_home[2]
    if forward and s.hybrid is not None and height is not None and round(height, 1) < MIN_FORWARD_HEIGHT:
        question += f" It needs {MIN_FORWARD_HEIGHT:g} m of height; the vehicle is at {height:.1f} m."
    if s.mission_state == mavlink.MISSION_STATE_ACTIVE:
        question += " A mission is being flown."
    confirm(app, named(feed, question), lambda: request(lambda station, now: station.transition(now, forward=forward)))


def ask_go_to_place(app: App[int], feed: Feed, place: NorthEast, request: Send) -> None:
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

    left = " This interrupts the mission." if s.mission_state == mavlink.MISSION_STATE_ACTIVE else ""
    question = f"Go to {north:.1f} m north, {east:.1f} m east of home at {height:.1f} m above it?{left}"
    confirm(app, named(feed, question), lambda: request(go))


def choose_panels(app: App[int], screen: FlightScreen, changed: Callable[[], None]) -> None:
    """Ask which panel to show or hide, do so, and tell that it was done."""
    names = list(OPTIONAL_PANELS)
    choices = [f"{'Show' if name in screen.hidden else 'Hide'} {OPTIONAL_PANELS[name]}" for name in names]

    def chosen(index: int | None) -> None:
        if index is not None:
            screen.show_panels(screen.hidden ^ {names[index]})
            changed()

    app.push_screen(ChooseScreen("Panels that are shown where there is room", choices), chosen)
