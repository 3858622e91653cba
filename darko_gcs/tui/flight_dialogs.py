"""Dialogs of the flight screen: heights, points, speeds, the choice of panels, and commands to all vehicles at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from textual.app import App

from darko_gcs.feed.feed import Feed
from darko_gcs.state.map_overlay import Overlay
from darko_gcs.state.mission_legs import FLOWN_MISSION
from darko_gcs.state.number_ranges import DISTANCE, HEIGHT, MIN_CLIMB, speed_range, take_off_range
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.speed_in_force import (
    CRUISE_PARAMETER,
    flown_speeds,
    is_for_later_legs,
    speed_in_force,
    speed_problem,
    speed_words,
)
from darko_gcs.station.station import Station
from darko_gcs.tui.actions import Request, must_arm, start_question
from darko_gcs.tui.plan_draft import PlanDraft
from darko_gcs.tui.render.map_drawing import NorthEast
from darko_gcs.tui.screens.dialogs import (
    EAST_LABEL,
    NORTH_LABEL,
    SOUTH_HELP,
    WEST_HELP,
    AskScreen,
    ChooseScreen,
    FormField,
    confirm,
)
from darko_gcs.tui.screens.flight_screen import OPTIONAL_PANELS, FlightScreen
from protocol.dialect import mavlink
from protocol.ranges import MIN_FORWARD_HEIGHT


@dataclass(frozen=True)
class FleetCommand:
    """A command that all vehicles can be given."""

    label: str
    consequence: str  # after the question
    excuse: str  # of a vehicle that it makes no sense for
    makes_sense: Callable[[Snapshot], bool]
    send: Callable[[Station, float, float], None]  # to a vehicle, with the height if one is asked, at a time [s]
    asks_height: bool = False


def _is_up(s: Snapshot) -> bool:
    return bool(s.status.landed_state != mavlink.MAV_LANDED_STATE_ON_GROUND)


HEIGHT_LABEL, CLIMB_HELP = "Height above home [m]", "It climbs straight up to it, and hovers there"
LEFT = "Running missions are interrupted."
FLEET_COMMANDS = (
    FleetCommand(
        "Arm", "The propellers will turn.", "armed already", lambda s: not s.status.armed,
        lambda to, _, now: to.arm(now),
    ),
    FleetCommand(
        "Take off", "", "in the air already", lambda s: not s.status.is_airborne,
        lambda to, height, now: to.take_off(height, now), asks_height=True,
    ),
    FleetCommand("Hold", LEFT, "on the ground", _is_up, lambda to, _, now: to.hold(now)),
    FleetCommand("Land", LEFT, "on the ground", _is_up, lambda to, _, now: to.land(now)),
    FleetCommand("Return home and land", LEFT, "on the ground", _is_up, lambda to, _, now: to.return_home(now)),
    FleetCommand(
        "Start the mission", "", "disarmed", lambda s: s.status.armed is not False,
        lambda to, _, now: to.plans.start_mission(now),
    ),
)  # fmt: skip


def ask_fleet(app: App[int], feed: Feed) -> None:
    """Let the operator choose a command, confirm it, and send it to every vehicle that it makes sense for."""
    present = _present(feed)
    if not present:
        app.notify("No vehicle is heard: nothing was sent", severity="warning")
        return

    def chosen(index: int | None) -> None:
        if index is not None:
            _ask(app, feed, FLEET_COMMANDS[index])

    title = f"Command all vehicles that are heard: {'vehicle' if len(present) == 1 else 'vehicles'} {id_words(present)}"
    app.push_screen(ChooseScreen(title, [command.label for command in FLEET_COMMANDS]), chosen)


def _ask(app: App[int], feed: Feed, command: FleetCommand) -> None:
    present = _present(feed)
    meant = {system: to for system, to in present.items() if command.makes_sense(to.snapshot)}
    if not meant:
        app.notify(f"{command.label}: nothing was sent, all are {command.excuse}", severity="warning")
        return

    def send(height: float) -> None:
        for system, to in _present(feed).items():
            if system in meant:
                command.send(to, height, feed.now)

    def typed(values: tuple[str, ...] | None) -> None:
        if values is not None:
            send(float(values[0]))

    left_out = len(present) - len(meant)
    who = f"{len(meant)} vehicle{'s' * (len(meant) > 1)} ({id_words(meant)})"
    rest = f"{left_out} {'is' if left_out == 1 else 'are'} {command.excuse}: not commanded." if left_out else ""
    if command.asks_height:
        title = " ".join(filter(None, (f"{command.label}: {who}.", rest)))
        fields = [FormField(HEIGHT_LABEL, "3", CLIMB_HELP)]
        app.push_screen(AskScreen(title, fields, ranges=[take_off_range(None)]), typed)
    else:
        question = " ".join(filter(None, (f"{command.label}: {who}?", command.consequence, rest)))
        confirm(app, question, lambda: send(0.0))


def fleet_snapshots(feed: Feed) -> tuple[Snapshot, ...]:
    """All vehicles on the link, by ascending system id; empty for a recording."""
    stations = {} if feed.fleet is None else feed.fleet.stations
    return tuple(station.snapshot for station in stations.values())


def named(feed: Feed, question: str) -> str:
    """A question to the active vehicle's operator, with its id if there are several vehicles."""
    source = feed.snapshot.identity.source
    return f"Vehicle {source[0]}: {question}" if source is not None and len(fleet_snapshots(feed)) > 1 else question


def armed_words(feed: Feed) -> str:
    """That vehicles are armed, in words; empty if none is."""
    fleet = fleet_snapshots(feed) or (feed.snapshot,)
    armed = sum(bool(s.status.armed) for s in fleet)
    if len(fleet) == 1:
        return "The vehicle is armed." if armed else ""
    return f"Of {len(fleet)} vehicles {armed} {'is' if armed == 1 else 'are'} armed." if armed else ""


def _present(feed: Feed) -> dict[int, Station]:
    stations = {} if feed.fleet is None else feed.fleet.stations
    return {system: to for system, to in stations.items() if not to.snapshot.link.lost}


def id_words(systems: Iterable[int]) -> str:
    """System ids in words, with neighbours as spans: "1-3, 7"."""
    spans: list[list[int]] = []
    ids: Sequence[int] = sorted(systems)
    for before, system in pairwise([-1, *ids]):
        if system == before + 1 and spans:
            spans[-1][1:] = [system]
        else:
            spans.append([system])
    return ", ".join("-".join(map(str, span)) for span in spans)


FORWARD_STATES = frozenset({mavlink.MAV_VTOL_STATE_FW, mavlink.MAV_VTOL_STATE_TRANSITION_TO_FW})

SPEED_KINDS = {"air": False, "a": False, "0": False, "ground": True, "g": True, "1": True}  # whether over ground

USUAL_CLIMB = 3.0  # of a take-off, that the form offers [m]
WAY_PARAMETER = "DRK_WAY"  # how legs are flown
Send = Callable[[Request], None]  # sends a request to the vehicle


def ask_take_off(app: App[int], feed: Feed, request: Send) -> None:
    """Ask for the height, then take off; a vehicle that is disarmed is armed first, as the form says."""
    if feed.snapshot.status.is_airborne:
        app.notify("The vehicle is in the air: g goes to another height", severity="warning")
        return
    must_arm = feed.snapshot.status.armed is False
    title = "Arm and take off: the propellers will turn" if must_arm else "Take off"

    def answered(values: tuple[str, ...] | None) -> None:
        if values is not None:
            height = float(values[0])
            request(lambda station, now: station.take_off(height, now, arm=must_arm))

    place = feed.snapshot.position.from_home
    allowed = take_off_range(None if place is None else place[2])
    fields = [FormField(HEIGHT_LABEL, f"{allowed.minimum - MIN_CLIMB + USUAL_CLIMB:g}", CLIMB_HELP)]
    app.push_screen(AskScreen(named(feed, title), fields, ranges=[allowed]), answered)


def _way_words(s: Snapshot) -> str:
    """The way in which a vehicle flies to a point, as far as it is known; empty of others than DarkO."""
    if not s.is_darko:
        return ""
    ways = {
        1.0: f"It hovers all the way ({WAY_PARAMETER}).",
        2.0: f"It is flown forward where that is possible ({WAY_PARAMETER}).",
    }
    cheaper = "It is flown forward where that needs less energy; the speed of c is for the hover."
    return ways.get(s.parameters.values.get(WAY_PARAMETER, math.nan), cheaper)


def ask_go_to(app: App[int], feed: Feed, request: Send) -> None:
    """Ask for the point, then go there."""
    p = feed.snapshot.position.from_home or (0.0, 0.0, -3.0)
    fields = [
        FormField(NORTH_LABEL, f"{round(p[0], 1) + 0.0:.1f}", SOUTH_HELP),
        FormField(EAST_LABEL, f"{round(p[1], 1) + 0.0:.1f}", WEST_HELP),
        FormField(HEIGHT_LABEL, f"{-p[2]:.1f}", "At which it flies there, and hovers then"),
    ]

    def answered(values: tuple[str, ...] | None) -> None:
        if values is not None:
            north, east, height = (float(value) for value in values)
            request(lambda station, now: station.go_to(north, east, height, now))

    title = ". ".join(filter(None, ("Go to", _way_words(feed.snapshot))))
    app.push_screen(AskScreen(named(feed, title), fields, ranges=(DISTANCE, DISTANCE, HEIGHT)), answered)


def ask_speed(app: App[int], feed: Feed, request: Send) -> None:
    """Ask for the speed, then fly at it; the vehicle answers if it can."""
    allowed = speed_range(is_ours=feed.snapshot.is_darko)
    s = feed.snapshot
    present = speed_in_force(s)
    is_ours = s.is_darko
    fields = [
        FormField(
            "Speed [m/s]" if is_ours else f"Speed [m/s], {allowed.minimum:g} to {allowed.maximum:g}",
            "" if present is None else f"{present.speed:g}",
            flown_speeds(s) if is_ours else "For the flight under way, until another one is commanded",
        ),
        FormField(
            "air or ground speed",
            "ground" if present is not None and present.over_ground else "air",
            "ground: over the ground, as a hover's always is",
        ),
    ]

    def check(values: tuple[str, ...]) -> str | None:
        kind = SPEED_KINDS.get(values[1].lower())
        if kind is None:
            return "Type air for an airspeed, ground for a ground speed"
        return speed_problem(s, float(values[0]), over_ground=kind) or None

    def answered(values: tuple[str, ...] | None) -> None:
        if values is not None:
            speed, over_ground = float(values[0]), SPEED_KINDS[values[1].lower()]
            if is_for_later_legs(s, speed):
                request(lambda station, now: station.set_parameter(CRUISE_PARAMETER, speed, now))
                return
            request(lambda station, now: station.change_speed(speed, now, over_ground=over_ground))

    title = "Change speed" if present is None else f"Change speed (asked for: {speed_words(present)})"
    app.push_screen(AskScreen(named(feed, title), fields, check, ranges=[allowed]), answered)


def ask_start(app: App[int], feed: Feed, draft: PlanDraft, request: Send, overlay: Overlay) -> None:
    """Ask, then fly the mission that the vehicle has; a plan that was edited and not uploaded is another one."""
    s, question = feed.snapshot, start_question(feed.snapshot, overlay, draft.low_leg)
    if s.mission.total == 0:
        app.notify("The vehicle has no mission: nothing was sent. m shows the plan, u sends it", severity="warning")
        return
    if draft.changed and draft.plan.items:
        if s.mission.state not in FLOWN_MISSION:
            words = "The vehicle does not have the plan that you edited: m shows it, u sends it. Nothing was sent"
            app.notify(words, severity="warning")
            return
        question += " This is the vehicle's own mission, not the plan that you edited."
    arm = must_arm(s)
    confirm(app, named(feed, question), lambda: request(lambda station, now: station.plans.start_mission(now, arm=arm)))


def ask_transition(app: App[int], feed: Feed, request: Send) -> None:
    """Ask, then transition in the direction of the question, whatever the state is by then."""
    s = feed.snapshot
    forward = s.status.vtol_state not in FORWARD_STATES
    question = "Transition to forward flight?" if forward else "Transition back to hover?"
    height = None if s.position.from_home is None else -s.position.from_home[2]
    if forward and s.is_darko and height is not None and round(height, 1) < MIN_FORWARD_HEIGHT:
        question += f" It needs {MIN_FORWARD_HEIGHT:g} m of height; the vehicle is at {height:.1f} m."
    if s.mission.state == mavlink.MISSION_STATE_ACTIVE:
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
    if not s.status.is_airborne or s.position.from_home is None:
        app.notify("The vehicle is not in the air: nothing was sent", severity="warning")
        return
    north, east, height = place[0] - s.position.home_p[0], place[1] - s.position.home_p[1], -s.position.from_home[2]

    def go(station: Station, now: float) -> None:
        station.go_to(north, east, height, now)

    left = " This interrupts the mission." if s.mission.state == mavlink.MISSION_STATE_ACTIVE else ""
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
