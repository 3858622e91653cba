"""Plans over the link: stored, checked, put in force and predicted."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.events import CurrentItemRequested, MissionCleared, MissionReceived, MissionRefused, PredictionRequested
from protocol.frames import flip
from protocol.plans.plan import MissionItem, Refusal, Validate
from protocol.ranges import LEGS_AHEAD, MAX_AIRSPEED
from protocol.tools.timing import TokenBucket
from protocol.wire.message import Message, target_fields
from sitl.autopilot.answers import SafetyAction
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.failsafes import FENCE_ACTIONS
from sitl.autopilot.mission.items import validate
from sitl.autopilot.world import RETURN_POINT, Fence, make_fence, make_rally
from sitl.control.reference import Point
from sitl.mavlink.broadcast import Broadcast
from sitl.mavlink.handlers import on_event
from sitl.mavlink.telemetry.telemetry_service import TelemetryService
from sitl.prediction.chooser import LegEnd
from sitl.prediction.mode_choice import Decision
from sitl.tools.persistence import StateFolder

# Mission, fence and rally points as peers send them: checked, put in force, saved, and refused with a reason.

# Fence and rally points between MAVLink, the state folder and the autopilot: stored, checked, put in force.


PLAN, FENCE, RALLY = (
    mavlink.MAV_MISSION_TYPE_MISSION,
    mavlink.MAV_MISSION_TYPE_FENCE,
    mavlink.MAV_MISSION_TYPE_RALLY,
)
PLAN_NAMES = {PLAN: "Mission", FENCE: "Fence", RALLY: "Rally points"}


class FenceAndRally:
    """Fence and rally points of one autopilot; the stored ones are put in force from the start.

    Attributes:
        flaws: Why stored ones could not be put in force, for the pilot.

    Raises:
        SitlError: A stored file cannot be read.
    """

    def __init__(self, autopilot: Autopilot, state_folder: StateFolder) -> None:
        self._autopilot, self._state_folder = autopilot, state_folder
        self._checks: dict[int, Validate] = {FENCE: self._check_fence, RALLY: self._check_rally}
        self._items: dict[int, tuple[MissionItem, ...]] = {FENCE: state_folder.fence(), RALLY: state_folder.rally()}
        self.flaws: list[str] = []
        for kind, items in self._items.items():
            refusal = self._checks[kind](items)
            if refusal is None:
                self.load(kind, items)
            else:
                self._items[kind] = ()
                self.flaws.append(f"Stored {PLAN_NAMES[kind].lower()} not loaded: {refusal.text}")

    def plans(self) -> dict[int, tuple[Sequence[MissionItem], Validate]]:
        """Plans in force by MAV_MISSION_TYPE, each with its check."""
        return {kind: (items, self._checks[kind]) for kind, items in self._items.items()}

    def load(self, kind: int, items: Sequence[MissionItem]) -> str:
        """Put valid items in force; a sentence about it for the pilot."""
        self._items[kind] = tuple(items)
        self._put_in_force(kind, items)
        count = f"{len(items)} item{'s' * (len(items) != 1)} received"
        unused = kind == FENCE and self._leaves_return_point_unused
        unused_text = "; its return point is flown to by GF_ACTION 3 alone" if unused else ""
        return f"{PLAN_NAMES[kind]}: {count}{unused_text}" if items else f"{PLAN_NAMES[kind]} cleared"

    @property
    def _leaves_return_point_unused(self) -> bool:
        """Whether the fence has a return point, and what is done at a breach does not lead there."""
        action = FENCE_ACTIONS.get(self._autopilot.settings.fence_action)
        has_return_point = any(item.command == RETURN_POINT for item in self._items[FENCE])
        return has_return_point and action is not SafetyAction.RETURN

    def reload(self) -> list[str]:
        """Put the items in force anew after home or the origin has moved; why some no longer can be."""
        reasons = []
        for kind, items in self._items.items():
            refusal = self._checks[kind](items)
            self._put_in_force(kind, () if refusal else items)
            if refusal is not None:
                reasons.append(f"{PLAN_NAMES[kind]} no longer in force: {refusal.text}")
        return reasons

    def save(self, kind: int, items: Sequence[MissionItem]) -> None:
        """Replace the stored items.

        Raises:
            StateFolderError: They cannot be written.
        """
        writers: dict[int, Callable[[Sequence[MissionItem]], None]] = {
            FENCE: self._state_folder.save_fence,
            RALLY: self._state_folder.save_rally,
        }
        writers[kind](items)

    def _put_in_force(self, kind: int, items: Sequence[MissionItem]) -> None:
        autopilot, world = self._autopilot, self._autopilot.world
        if kind == FENCE:
            fence = make_fence(items, world)
            if isinstance(fence, Fence):
                autopilot.load_fence(fence)
        else:
            points = make_rally(items, world)
            if not isinstance(points, Refusal):
                autopilot.load_rally(points)

    def _check_fence(self, items: Sequence[MissionItem]) -> Refusal | None:
        fence = make_fence(items, self._autopilot.world)
        return fence if isinstance(fence, Refusal) else None

    def _check_rally(self, items: Sequence[MissionItem]) -> Refusal | None:
        points = make_rally(items, self._autopilot.world)
        return points if isinstance(points, Refusal) else None


def recheck_plans(autopilot: Autopilot, fence_and_rally: FenceAndRally) -> list[str]:
    """Put in force anew what is relative to home or origin; what can no longer be flown, in words."""
    reasons = fence_and_rally.reload()
    if reason := autopilot.refuse_mission():
        reasons.append(f"Mission can no longer be flown: {reason}")
    return reasons


class StoredPlans:
    """The plans of the state folder, loaded into the autopilot; ``flaws`` says why some could not be.

    Args:
        autopilot: Flies them.
        state_folder: Stores them.

    Raises:
        SitlError: A file cannot be read.
    """

    def __init__(self, autopilot: Autopilot, state_folder: StateFolder) -> None:
        self._autopilot, self._state_folder = autopilot, state_folder
        self.fence_and_rally = FenceAndRally(autopilot, state_folder)
        stored = state_folder.mission()
        refusal = self.validate(stored)
        self.mission = () if refusal else stored
        autopilot.missions.load(self.mission)
        self.flaws = [f"Stored mission not loaded: {refusal.text}"] if refusal else []
        self.flaws += self.fence_and_rally.flaws

    @property
    def others(self) -> Mapping[int, tuple[Sequence[MissionItem], Validate]]:
        """Fence and rally points in force by MAV_MISSION_TYPE, each with its check."""
        return self.fence_and_rally.plans()

    def validate(self, items: Sequence[MissionItem]) -> Refusal | None:
        """The reason why a mission cannot be flown here; None if it can."""
        return validate(items, self._autopilot.world)


class PlanService:
    """Takes plans from peers.

    Args:
        autopilot: Flies them.
        state_folder: Stores them.
        fence_and_rally: Fence and rally points in force.
        broadcast: Tells everyone a text.
        telemetry: Tells everyone the current item.
    """

    def __init__(
        self,
        *,
        autopilot: Autopilot,
        state_folder: StateFolder,
        fence_and_rally: FenceAndRally,
        broadcast: Broadcast,
        telemetry: TelemetryService,
    ) -> None:
        self._autopilot, self._state_folder, self._fence_and_rally = autopilot, state_folder, fence_and_rally
        self._broadcast, self._telemetry = broadcast, telemetry

    @on_event(MissionReceived)
    def receive(self, event: MissionReceived, _now: float) -> None:
        """A valid plan has arrived."""
        if event.kind:
            self._load_fence_or_rally(event.kind, event.items)
            return
        if event.is_partial:
            self._autopilot.missions.revise(event.items)
            self._broadcast.save(lambda: self._state_folder.save_mission(event.items))
            self._broadcast.info("Mission items replaced")
            return
        self._load_mission(event.items)
        self._broadcast.info(f"Mission of {len(event.items)} item{'s' * (len(event.items) != 1)} received")

    @on_event(MissionRefused)
    def explain_refusal(self, event: MissionRefused, _now: float) -> None:
        """A plan has arrived that cannot be flown."""
        self._broadcast.warn(f"{PLAN_NAMES[event.kind]} refused: {event.reason}")

    @on_event(MissionCleared)
    def clear(self, event: MissionCleared, _now: float) -> None:
        """A peer cleared a plan."""
        if event.kind:
            self._load_fence_or_rally(event.kind, ())
            return
        self._load_mission(())
        self._broadcast.info("Mission cleared")

    @on_event(CurrentItemRequested)
    def choose_item(self, event: CurrentItemRequested, _now: float) -> None:
        """A peer chose the item to go on with."""
        self._autopilot.missions.set_current(event.seq)
        self._telemetry.publish_now(mavlink.MAVLINK_MSG_ID_MISSION_CURRENT)

    def prepare_clearing(self, kinds: set[int]) -> None:
        """Clear several stored plans together: file by file, a crash in between would leave a mixture."""
        if len(kinds) > 1:
            self._broadcast.save(lambda: self._state_folder.clear_plans(kinds))

    def recheck(self) -> None:
        """Home or origin has moved: tell everyone which plans can no longer be flown."""
        for text in recheck_plans(self._autopilot, self._fence_and_rally):
            self._broadcast.warn(text)

    def _load_mission(self, items: Sequence[MissionItem]) -> None:
        self._autopilot.missions.load(items)
        self._broadcast.save(lambda: self._state_folder.save_mission(items))

    def _load_fence_or_rally(self, kind: int, items: Sequence[MissionItem]) -> None:
        self._broadcast.info(self._fence_and_rally.load(kind, items))
        self._broadcast.save(lambda: self._fence_and_rally.save(kind, items))


# Predictions of legs that nobody flies yet: their time and energy in the hover and in forward flight.


PREDICTION_RATE = 20.0  # answers a second at most, to all peers: a prediction takes time that the flight needs
MAX_LEG_COORDINATE = 1e5  # of a leg's end [m]


class PredictionService:
    """Answers DARKO_LEGS_REQUEST; one that makes no sense, or comes too soon, is not answered.

    Args:
        autopilot: Knows laws, settings and wind.
        endpoint: Sends the answers.
    """

    def __init__(self, autopilot: Autopilot, endpoint: VehicleEndpoint) -> None:
        self._autopilot, self._endpoint = autopilot, endpoint
        self._bucket = TokenBucket(capacity=PREDICTION_RATE, rate=PREDICTION_RATE)

    @on_event(PredictionRequested)
    def predict(self, event: PredictionRequested, now: float) -> None:
        """A peer asks about legs."""
        autopilot, request = self._autopilot, event.message
        points, asked, chooser = _points(request), request.asked, autopilot.chooser
        if points is None or chooser is None or not self._bucket.take(now):
            return
        settings = autopilot.settings
        if 0.0 < request.hover_speed < settings.hover_speed:
            settings = settings._replace(hover_speed=request.hover_speed)
        if 0.0 < request.airspeed <= MAX_AIRSPEED:
            settings = settings._replace(airspeed=request.airspeed)
        stops = [
            LegEnd(p, LegMode(way) if way in set(LegMode) else LegMode.NONE)
            for p, way in zip(points[1:], asked, strict=False)
        ]
        heading = -request.heading if math.isfinite(request.heading) else autopilot.view.heading
        made = chooser.predict(autopilot.view.wind, heading, points[0], stops, settings)
        self._endpoint.send(_answer(event, made), event.peer)


def _points(message: Message) -> list[Point] | None:
    """Start of the first leg and end of each, world NWU [m]; None if the request makes no sense."""
    if not 1 <= message.count <= LEGS_AHEAD:
        return None
    points = list(zip(message.x, message.y, message.z, strict=True))[: message.count + 1]
    if not all(abs(part) <= MAX_LEG_COORDINATE for point in points for part in point):  # false for NaN too
        return None
    return [flip(point) for point in points]


def _answer(event: PredictionRequested, made: Sequence[Decision]) -> Message:
    def numbers(values: Sequence[float]) -> list[float]:
        return [*values, *[math.nan] * (LEGS_AHEAD - len(values))]

    def entries(values: Sequence[int]) -> list[int]:
        return [*map(int, values), *[0] * (LEGS_AHEAD - len(values))]

    return mavlink.MAVLink_darko_legs_prediction_message(
        **target_fields(event.peer),
        request=event.message.request,
        count=len(made),
        hover_time=numbers([d.hover.time for d in made]),
        hover_energy=numbers([d.hover.energy for d in made]),
        forward_time=numbers([d.forward.time for d in made]),
        forward_energy=numbers([d.forward.energy for d in made]),
        way=entries([d.leg_mode for d in made]),
        reason=entries([d.reason for d in made]),
    )
