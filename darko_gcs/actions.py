"""Everything the operator can do, once: key, words and deed. Bindings, palette and help come from this table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from darko_gcs.snapshot import Snapshot
from protocol.dialect import mavlink
from protocol.endpoint import GROUND_SYSTEM

__all__ = ["ACTIONS", "Action", "Operator", "control_question"]

MISSION_ACTIVE = mavlink.MISSION_STATE_ACTIVE


class Operator(Protocol):
    """What actions are done with: the app."""

    def tell(self, request: str) -> None:
        """One of the station's requests without arguments."""

    def disarm(self) -> None:
        """Stop the motors."""

    def ask_take_off(self) -> None:
        """Ask for a height, then take off."""

    def ask_go_to(self) -> None:
        """Ask for a point, then go there."""

    def ask_transition(self) -> None:
        """Ask whether to, then change between hover and forward flight."""

    def ask_speed(self) -> None:
        """Ask for a speed, then fly at it."""

    def ask_control(self) -> None:
        """Ask whether to, then take control, hand it over or give it back."""

    def show_mission(self) -> None:
        """Open the mission screen."""

    def show_parameters(self) -> None:
        """Open the parameter screen."""

    def show_messages(self) -> None:
        """Open the log of messages."""

    def show_help(self) -> None:
        """Open the list of keys."""

    def zoom(self, step: int) -> None:
        """Zoom the map."""

    def more(self) -> None:
        """Turn the page of the numbers."""

    def leave(self) -> None:
        """Quit."""


@dataclass(frozen=True)
class Action:
    """One thing to do."""

    key: str
    name: str
    label: str  # in the footer; empty keeps it out
    help: str
    do: Callable[[Operator], None]
    confirm: Callable[[Snapshot], str | None] = lambda s: None  # noqa: ARG005 - most need none
    needs_vehicle: bool = True


def _in_air(s: Snapshot) -> bool:
    return s.landed_state in {2, 3, 4}


def _confirm_arm(s: Snapshot) -> str | None:
    return "Arm? The propellers will turn." if not s.armed else None


def _confirm_disarm(s: Snapshot) -> str | None:
    return "Disarm IN THE AIR? The vehicle will fall." if _in_air(s) else None


def _confirm_leaving_mission(what: str) -> Callable[[Snapshot], str | None]:
    return lambda s: f"A mission is being flown. {what} instead?" if s.mission_state == MISSION_ACTIVE else None


def control_question(s: Snapshot) -> tuple[str, str]:
    """What to ask the operator about control as it is now, and the station's request that a yes is."""
    if s.in_control == GROUND_SYSTEM and s.asks_for_control:
        return f"Let ground station {s.asks_for_control} take control? It has to ask once more.", "share_control"
    if s.in_control == GROUND_SYSTEM:
        return "Give control back? Every ground station may steer then.", "give_control_back"
    if s.in_control:
        return f"Ask ground station {s.in_control} for control?", "take_control"
    return "Take control? No other ground station can steer then.", "take_control"


def _confirm_home(s: Snapshot) -> str:
    height = "" if s.from_home is None or not _in_air(s) else f", {-s.from_home[2]:.1f} m up"
    return f"Move home here{height}? Returns will land below this point, and heights count from it."


ACTIONS = (
    Action("a", "arm", "Arm", "Arm: start the motors at idle", lambda app: app.tell("arm"), _confirm_arm),
    Action(
        "d", "disarm", "Disarm", "Disarm: stop the motors; in the air, by force", lambda app: app.disarm(),
        _confirm_disarm,
    ),
    Action("t", "take_off", "Takeoff", "Take off to a height above home", lambda app: app.ask_take_off()),
    Action(
        "h", "hold", "Hold", "Hold: stop and hover here", lambda app: app.tell("hold"), _confirm_leaving_mission("Hold")
    ),
    Action(
        "l", "land", "Land", "Land on the spot", lambda app: app.tell("land"), _confirm_leaving_mission("Land here")
    ),
    Action(
        "r", "return", "Home", "Return home and land", lambda app: app.tell("return_home"),
        _confirm_leaving_mission("Return home"),
    ),
    Action(
        "H", "set_home", "", "Move home to where the vehicle is", lambda app: app.tell("set_home"), _confirm_home,
    ),
    Action("g", "go_to", "Goto", "Go to a point north and east of home", lambda app: app.ask_go_to()),
    Action(
        "v", "transition", "Vtol", "Transition to forward flight, or back to hover", lambda app: app.ask_transition()
    ),
    Action("x", "cancel", "", "Cancel the transition that is under way", lambda app: app.tell("cancel")),
    Action("c", "speed", "", "Change the speed", lambda app: app.ask_speed()),
    Action("k", "control", "", "Control: take it, hand it over, give it back", lambda app: app.ask_control()),
    Action("s", "start", "Run", "Start or resume the mission", lambda app: app.tell("start_mission")),
    Action(
        "m", "mission", "Plan", "Mission: load, edit, upload, download", lambda app: app.show_mission(),
        needs_vehicle=False,
    ),
    Action(
        "p", "parameters", "", "Parameters: see, find and change them", lambda app: app.show_parameters(),
        needs_vehicle=False,
    ),
    Action(
        "e", "messages", "", "Messages: every one that is kept, with its time", lambda app: app.show_messages(),
        needs_vehicle=False,
    ),
    Action("plus", "zoom_in", "", "Map: zoom in", lambda app: app.zoom(1), needs_vehicle=False),
    Action("minus", "zoom_out", "", "Map: zoom out", lambda app: app.zoom(-1), needs_vehicle=False),
    Action("0", "zoom_fit", "", "Map: show everything", lambda app: app.zoom(0), needs_vehicle=False),
    Action("n", "more", "", "Flight panel: next page, where not all fits", lambda app: app.more(), needs_vehicle=False),
    Action("question_mark", "help", "Help", "All keys", lambda app: app.show_help(), needs_vehicle=False),
    Action("q", "quit", "", "Quit the ground station", lambda app: app.leave(), needs_vehicle=False),
)  # fmt: skip
