"""Commands to all vehicles at once: chosen from a list, and confirmed with how many vehicles they move."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from textual.app import App

from darko_gcs.feed.feed import Feed
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.station.station import Station
from darko_gcs.tui.screens.dialogs import AskScreen, ChooseScreen, confirm
from protocol.dialect import mavlink


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
    return bool(s.landed_state != mavlink.MAV_LANDED_STATE_ON_GROUND)


LEFT = "Running missions are interrupted."
FLEET_COMMANDS = (
    FleetCommand(
        "Arm", "The propellers will turn.", "armed already", lambda s: not s.armed, lambda to, _, now: to.arm(now)
    ),
    FleetCommand(
        "Take off", "", "in the air already", lambda s: not s.is_airborne,
        lambda to, height, now: to.take_off(height, now), asks_height=True,
    ),
    FleetCommand("Hold", LEFT, "on the ground", _is_up, lambda to, _, now: to.hold(now)),
    FleetCommand("Land", LEFT, "on the ground", _is_up, lambda to, _, now: to.land(now)),
    FleetCommand("Return home and land", LEFT, "on the ground", _is_up, lambda to, _, now: to.return_home(now)),
    FleetCommand("Start the mission", "", "", lambda _: True, lambda to, _, now: to.plans.start_mission(now)),
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

    title = f"Command all vehicles that are heard: {len(present)} ({id_words(present)})"
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
        app.push_screen(AskScreen(title, [("Height above home [m]", "3")]), typed)
    else:
        question = " ".join(filter(None, (f"{command.label}: {who}?", command.consequence, rest)))
        confirm(app, question, lambda: send(0.0))


def fleet_snapshots(feed: Feed) -> tuple[Snapshot, ...]:
    """All vehicles on the link, by ascending system id; empty for a recording."""
    stations = {} if feed.fleet is None else feed.fleet.stations
    return tuple(station.snapshot for station in stations.values())


def named(feed: Feed, question: str) -> str:
    """A question to the active vehicle's operator, with its id if there are several vehicles."""
    source = feed.snapshot.source
    return f"Vehicle {source[0]}: {question}" if source is not None and len(fleet_snapshots(feed)) > 1 else question


def armed_words(feed: Feed) -> str:
    """That vehicles are armed, in words; empty if none is."""
    fleet = fleet_snapshots(feed) or (feed.snapshot,)
    armed = sum(bool(s.armed) for s in fleet)
    if len(fleet) == 1:
        return "The vehicle is armed." if armed else ""
    return f"Of {len(fleet)} vehicles {armed} {'is' if armed == 1 else 'are'} armed." if armed else ""


def _present(feed: Feed) -> dict[int, Station]:
    stations = {} if feed.fleet is None else feed.fleet.stations
    return {system: to for system, to in stations.items() if not to.snapshot.lost}


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
