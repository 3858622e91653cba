"""The operator's actions in one table: key, text and effect. Bindings, command palette and help are made from it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from darko_gcs.state.fence_shapes import leg_dangers
from darko_gcs.state.map_overlay import Overlay
from darko_gcs.state.mission_legs import (
    LOW_LEG,
    distance_to_start,
    known_predictions,
    low_words,
    mission_legs,
    start_item,
)
from darko_gcs.state.return_goal import return_goal
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.station.station import Station
from protocol.dialect import mavlink

if TYPE_CHECKING:
    from darko_gcs.tui.app import GroundStationApp


def why_unreachable(station: Station | None, s: Snapshot) -> str:
    """Reason why nothing can be sent to a vehicle; empty if it can.

    Args:
        station: Of the vehicle; None in a replay.
        s: What is known of it.
    """
    if station is None:
        return "This is a recording: there is no vehicle to command"
    if s.identity.source is None:
        return "No vehicle has been heard yet: nothing was sent"
    return "The vehicle is silent: nothing was sent" if s.link.lost else ""


FAR_START = 50.0  # from the vehicle to where its mission begins, which is worth a word [m]
Request = Callable[[Station, float], None]  # sends one request of the station, at a time [s]


def _no_question(_s: Snapshot) -> str | None:
    return None


@dataclass(frozen=True, kw_only=True)
class Action:
    """One action of the operator."""

    key: str
    name: str
    label: str  # in the footer; an empty one is not shown there, or, with a short label, on a wide screen only
    help: str
    run: Callable[[GroundStationApp], None]
    question: Callable[[Snapshot], str | None] = _no_question  # to confirm first; None: nothing to confirm
    needs_vehicle: bool = True  # commands it: only from the flight screen, never in a recording
    refusal: Callable[[Snapshot], str | None] = _no_question  # why it makes no sense now: nothing is asked or sent
    short: str = ""  # what a wide footer calls it
    title: str = ""  # in the command palette; an empty one: what the help says up to its colon

    @property
    def palette_title(self) -> str:
        """Title in the command palette."""
        return self.title or self.help.split(":")[0]


# One rule: a command that moves, stops or drops the vehicle asks first, by a question or by a form.


def _question_arm(s: Snapshot) -> str | None:
    return "Arm? The propellers will turn." if not s.status.armed else None


HARDLY_UP = 1.0  # height above home of a take-off that has not left the ground yet [m]


def disarm_question(s: Snapshot) -> str | None:
    """The question to ask before disarming; None if there is nothing to stop."""
    if s.status.is_airborne:
        height = None if s.position.from_home is None else -s.position.from_home[2]
        is_low = height is not None and height < HARDLY_UP
        if is_low and s.status.landed_state == mavlink.MAV_LANDED_STATE_TAKEOFF:
            return f"Disarm? It is taking off, {max(height or 0.0, 0.0):.1f} m up: the propellers will stop."
        return "Disarm IN THE AIR? The vehicle will fall."
    return "Disarm? The propellers will stop." if s.status.armed is not False else None


def _question_move(what: str) -> Callable[[Snapshot], str]:
    def question(s: Snapshot) -> str:
        is_active = s.mission.state == mavlink.MISSION_STATE_ACTIVE
        return f"{what}? This interrupts the mission." if is_active else f"{what}?"

    return question


def start_question(s: Snapshot, overlay: Overlay = (), low_leg: float = LOW_LEG) -> str:
    """The question before the mission is begun, or goes on: it names the item that the vehicle begins with.

    Args:
        s: Has the vehicle, its mission and its fence.
        overlay: Its areas that have a height stand in the way.
        low_leg: Height above home below which a leg flown forward is low [m].
    """
    away = distance_to_start(s) or 0.0
    far = f" It is {away:.0f} m from here to {'that' if start_item(s) else 'its first'} item."
    legs = mission_legs(s.plans.mission, s)
    dangers = leg_dangers(s, legs, overlay).words
    dangers += low_words(s.plans.mission, s, known_predictions(legs, s), low_leg)
    far = "".join([far if away >= FAR_START else "", *(f" {words}." for words in dangers)])
    return f"{armed_first(s, _start_words(s))}{far}"


def _start_words(s: Snapshot) -> str:
    """The effect of a start, by the state of the mission, as a question."""
    first = start_item(s)
    if s.mission.state == mavlink.MISSION_STATE_COMPLETE:
        return "Fly the mission again from its first item?"
    which = f" from item {first}" if first and s.mission.total else ""
    if s.mission.state == mavlink.MISSION_STATE_ACTIVE:
        return f"Fly on with the mission{which}? It is being flown."
    is_paused = s.mission.state == mavlink.MISSION_STATE_PAUSED
    if not is_paused or s.status.is_airborne:
        return f"{'Resume' if is_paused else 'Fly'} the mission{which}?"
    if not first:
        return "Fly the mission from its first item?"
    if first + 1 == s.mission.total:  # told alike: chosen as the current one, or broken off there
        return f"Fly the mission{which}? If it was broken off there, it begins with its first item."
    return f"Resume the mission{which}?"


def must_arm(s: Snapshot) -> bool:
    """True if the vehicle has to be armed before it flies a mission."""
    return s.status.armed is False


def armed_first(s: Snapshot, question: str) -> str:
    """A question before a flight, which says that the vehicle is armed first if it has to be."""
    return f"Arm and {question[0].lower()}{question[1:]} The propellers will turn." if must_arm(s) else question


def _question_return(s: Snapshot) -> str:
    """It names the place that the return leads to."""
    here = s.position.p or s.position.home_p
    goal = return_goal(s.plans.mission, len(s.plans.mission), here, s).name
    names = {"rally": "rally point", "item": "the mission's landing from item"}
    kind, _, number = goal.partition(" ")
    return _question_move(f"Return to {names[kind]} {number} and land" if goal else "Return home and land")(s)


def _question_cancel(s: Snapshot) -> str | None:
    return "Cancel the transition? The vehicle goes back." if s.operator.in_progress is not None else None


def _on_ground(s: Snapshot) -> str | None:
    on_ground = s.status.landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND
    return "The vehicle is on the ground: nothing was sent" if on_ground else None


def _disarmed(s: Snapshot) -> str | None:
    return None if s.status.armed else "The vehicle is disarmed: arm it first (a)"


def _question_home(s: Snapshot) -> str:
    height = (
        ""
        if s.position.from_home is None or not s.status.is_airborne
        else f", {-s.position.from_home[2]:.1f} m above the present home"
    )
    return f"Move home here{height}? The vehicle will return to this place, and heights will be measured from it."


def control_question(s: Snapshot) -> tuple[str, Request]:
    """The question to ask about control in the present situation, and the request to send after a yes."""
    own = s.session.own_system
    if s.operator.in_control == own and s.operator.control_asked_by:
        question = f"Let ground station {s.operator.control_asked_by} take control? It must ask again."
        return question, lambda station, now: station.share_control(now)
    if s.operator.in_control == own:
        question = "Give control back? Every ground station can command the vehicle then."
        return question, lambda station, now: station.give_control_back(now)
    if s.operator.in_control:
        question = f"Ask ground station {s.operator.in_control} for control?"
    else:
        question = (
            f"Take control as ground station {own}? Stations with other ids cannot command the vehicle then; "
            f"one with the same id still can, the vehicle does not tell them apart (--id)."
        )
    return question, lambda station, now: station.take_control(now)


ACTIONS = (
    Action(
        key="a", name="arm", label="Arm", help="Arm: start the motors at idle",
        title="Arm the vehicle",
        run=lambda app: app.request(lambda station, now: station.arm(now)), question=_question_arm,
    ),
    Action(
        key="d", name="disarm", label="Disarm", help="Disarm: stop the motors; in the air, by force",
        title="Disarm the vehicle",
        run=lambda app: app.ask_disarm(),
    ),
    Action(
        key="t", name="take_off", label="Takeoff", help="Take off to a height above home",
        run=lambda app: app.ask_take_off(),
    ),
    Action(
        key="h", name="hold", label="Hold", help="Hold: stop and hover here",
        title="Stop and hover here",
        run=lambda app: app.request(lambda station, now: station.hold(now)),
        question=_question_move("Stop and hover here"), refusal=_on_ground,
    ),
    Action(
        key="l", name="land", label="Land", help="Land here",
        run=lambda app: app.request(lambda station, now: station.land(now)),
        question=_question_move("Land here"), refusal=_on_ground,
    ),
    Action(
        key="r", name="return", label="RTL", help="Return home and land",
        run=lambda app: app.request(lambda station, now: station.return_home(now)),
        question=_question_return, refusal=_on_ground,
    ),
    Action(
        key="g", name="go_to", label="Goto", help="Go to a point north and east of home",
        run=lambda app: app.ask_go_to(), refusal=_on_ground,
    ),
    Action(
        key="v", name="transition", label="Vtol", help="Transition to forward flight, or back to hover",
        run=lambda app: app.ask_transition(), refusal=_on_ground,
    ),
    Action(
        key="s", name="start", label="Run", help="Start or resume the mission",
        run=lambda app: app.ask_start(),
    ),
    Action(
        key="m", name="mission", label="Plan", help="Mission: load, edit, upload, download",
        title="Show the mission",
        run=lambda app: app.show_mission(), needs_vehicle=False,
    ),
    Action(
        key="i", name="preflight", label="", short="Pre-flight", help="Pre-flight list: what hinders arming",
        title="Show what hinders arming", run=lambda app: app.show_preflight(),
    ),
    Action(
        key="e", name="messages", label="", short="Messages", help="Messages: the whole log, with times",
        title="Show all messages",
        run=lambda app: app.show_messages(), needs_vehicle=False,
    ),
    Action(
        key="p", name="parameters", label="", short="Parameters", help="Parameters: find and change them",
        title="Show the parameters",
        run=lambda app: app.show_parameters(), needs_vehicle=False,
    ),
    Action(
        key="C", name="charts", label="", short="Charts", help="Charts: expressions of any fields over time",
        title="Draw charts", run=lambda app: app.show_charts(), needs_vehicle=False,
    ),
    Action(
        key="E", name="inspector", label="", short="Inspect",
        help="Every message: rates, age, loss, and its fields with units",
        title="Inspect every message", run=lambda app: app.show_inspector(), needs_vehicle=False,
    ),
    Action(
        key="V", name="jumps", label="", short="Jumps", help="Jumps: every change of law, when and why",
        title="List the jumps from law to law", run=lambda app: app.show_jumps(), needs_vehicle=False,
    ),
    Action(
        key="b", name="flight_plan", label="", short="Blocks", help="Flight plan: its blocks, waypoints and variables",
        title="Show the flight plan",
        run=lambda app: app.show_flight_plan(), needs_vehicle=False,
    ),
    Action(key="c", name="speed", label="", short="Speed", help="Change the speed", run=lambda app: app.ask_speed()),
    Action(
        key="y", name="by_hand", label="", short="By hand", help="Fly by hand: keyboard, nudges and held keys",
        title="Fly by hand with the keyboard", run=lambda app: app.fly_by_hand(),
        question=_question_move("Fly by hand, with the keyboard"), refusal=_disarmed,
    ),
    Action(
        key="x", name="cancel", label="", short="Cancel", help="Cancel the transition in progress",
        run=lambda app: app.request(lambda station, now: station.cancel(now)), question=_question_cancel,
    ),
    Action(
        key="H", name="set_home", label="", short="Set home", help="Move home to the vehicle's position",
        run=lambda app: app.request(lambda station, now: station.set_home(now)), question=_question_home,
    ),
    Action(
        key="F", name="failure", label="", short="Failure", help="Failure: have something fail on the vehicle",
        title="Inject a failure", run=lambda app: app.ask_failure(),
    ),
    Action(
        key="Y", name="gamepad", label="", short="Gamepad", help="Fly by hand: a gamepad",
        title="Fly by hand with a gamepad", run=lambda app: app.fly_by_gamepad(),
        question=_question_move("Fly by hand, with the gamepad"), refusal=_disarmed,
    ),
    Action(
        key="k", name="control", label="", short="Control", help="Control: take it, share it, give it back",
        title="Take, share or give back control",
        run=lambda app: app.ask_control(),
    ),
    Action(
        key="plus", name="zoom_in", label="", short="Zoom in", help="Map, charts: zoom in",
        title="Zoom the map or the charts in", run=lambda app: app.zoom(1), needs_vehicle=False
    ),
    Action(
        key="minus", name="zoom_out", label="", short="Zoom out", help="Map, charts: zoom out",
        title="Zoom the map or the charts out", run=lambda app: app.zoom(-1),
        needs_vehicle=False,
    ),
    Action(
        key="0", name="zoom_fit", label="", short="Zoom to fit", help="Map, charts: show everything",
        title="Show everything on the map or the charts", run=lambda app: app.zoom(0),
        needs_vehicle=False,
    ),
    Action(
        key="z", name="follow", label="", short="Follow", help="Map: centre on the vehicle and follow it",
        run=lambda app: app.follow_vehicle(), needs_vehicle=False, title="Centre the map on the vehicle",
    ),
    Action(
        key="P", name="panels", label="", short="Panels", help="Panels: show or hide one of the flight screen",
        run=lambda app: app.choose_panels(), needs_vehicle=False, title="Show or hide panels of the flight screen",
    ),
    Action(
        key="n", name="more", label="", short="Page", help="Flight panel: next page",
        title="Turn the page of the flight panel", run=lambda app: app.show_next_page(),
        needs_vehicle=False,
    ),
    Action(
        key="f", name="fleet", label="", short="Fleet", help="Fleet: command all vehicles",
        run=lambda app: app.ask_fleet(),
        needs_vehicle=False,
    ),
    Action(
        key="o", name="next_vehicle", label="", short="Next vehicle",
        help="Other vehicle: show and command the next one on the link",
        run=lambda app: app.choose_next_vehicle(1), needs_vehicle=False,
    ),
    Action(
        key="O", name="previous_vehicle", label="", help="Other vehicle: the one before",
        run=lambda app: app.choose_next_vehicle(-1), needs_vehicle=False,
    ),
    Action(
        key="w", name="strip", label="", short="Vehicles", help="Vehicle list: few lines, all, hidden",
        run=lambda app: app.change_strip(), needs_vehicle=False,
    ),
    Action(
        key="A", name="acknowledge", label="", short="Seen", help="Alerts: you have seen them",
        title="Acknowledge the alerts", run=lambda app: app.acknowledge(), needs_vehicle=False,
    ),
    Action(
        key="question_mark", name="help", label="Help", help="All keys",
        title="Show all keys", run=lambda app: app.show_help(),
        needs_vehicle=False,
    ),
    Action(
        key="ctrl+r", name="restart", label="", help="Reboot the vehicle; with --sitl restart the simulator",
        run=lambda app: app.ask_restart(), needs_vehicle=False,
    ),
    Action(
        key="q", name="quit", label="", short="Quit", help="Quit the ground station", run=lambda app: app.ask_quit(),
        needs_vehicle=False,
    ),
)  # fmt: skip
