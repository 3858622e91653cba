"""The flight plan on the link: its table, what happens in it, what its operator asks, and the present leg as a mission.

Stations that know missions only see what is flown now as a mission of one or two items; it cannot be changed.
"""

from __future__ import annotations

import math

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.engines.server.mission_server import MissionInstead
from protocol.engines.table_values import plan_key
from protocol.errors import LocalProtocolError, ProtocolError
from protocol.events import CommandRequested, FlightPlanUploaded
from protocol.flight_plans.flight_plan import EnuPoint
from protocol.flight_plans.plan_check import check_flown
from protocol.flight_plans.plan_package import unpack_plan
from protocol.names import ABSOLUTE_ALTITUDE_FRAMES, Mode
from protocol.plans.plan import MissionItem
from sitl.autopilot.answers import ACCEPTED, DENIED, REJECTED, Answer
from sitl.autopilot.flight_plan.aims import BlockEntered, NamedWaypoint
from sitl.autopilot.flight_plan.executor import FlightPlanExecutor
from sitl.autopilot.world import POSITION_FRAMES
from sitl.mavlink.broadcast import Broadcast
from sitl.mavlink.commands import UNSUPPORTED_FRAME
from sitl.mavlink.handlers import on_command, on_event
from sitl.mavlink.telemetry.flight_plan_messages import (
    ascii_text,
    changing_entries,
    leg_items,
    plan_event,
    table_entries,
)
from sitl.mavlink.telemetry.telemetry_service import TelemetryService
from sitl.tools.persistence import StateFolder
from sitl.vehicle.aircraft import Aircraft

PLAN_FILE = "plan"  # what refusals call a file that was sent
MAX_REASON = 200  # characters of DARKO_PLAN_FILE_ACK.text
LOOK_PERIOD = 0.1  # between looks at what has changed [s]
LEG_PERIOD = 1.0  # between two legs told as missions: stations download each [s]
NO_CHANGE_REASON = "a flight plan is flown, and the mission is its present leg"


class FlightPlanService:
    """Tells everyone about the plan, and carries out what its operator asks.

    Args:
        aircraft: Flies the plan.
        endpoint: Holds the table.
        broadcast: Tells everyone.
        telemetry: Makes messages of the plan's status.
        state_folder: Stores plans that were sent.

    Attributes:
        was_sent: Whether the plan that is loaded was sent by a peer, and not given at the start.
    """

    def __init__(
        self,
        *,
        aircraft: Aircraft,
        endpoint: VehicleEndpoint,
        broadcast: Broadcast,
        telemetry: TelemetryService,
        state_folder: StateFolder,
    ) -> None:
        self.was_sent = False
        self._state_folder = state_folder
        self._aircraft, self._plans = aircraft, aircraft.autopilot.flight_plan
        self._endpoint, self._broadcast, self._telemetry = endpoint, broadcast, telemetry
        self._loaded: FlightPlanExecutor | None = None  # whose table was told
        self._looked = self._leg_told = -math.inf  # on the vehicle's clock [s]
        self._instead: MissionInstead | None = None
        self._plan_id = 0

    def update(self) -> None:
        """Tell what has changed since the last look."""
        now, executor = self._aircraft.vehicle.time, self._plans.executor
        if executor is None or (executor is self._loaded and now - self._looked < LOOK_PERIOD):
            return
        self._looked = now
        if executor is not self._loaded:
            self._loaded = executor
            self._endpoint.flight_plan.load(table_entries(self._plans))
            self._plan_id = self._endpoint.flight_plan.plan_id
        for entry in self._endpoint.flight_plan.update(changing_entries(self._plans)):
            self._broadcast.event(entry)
        self._tell_events()
        if self._instead is not None and now - self._leg_told >= LEG_PERIOD:
            self._show_leg()

    def follow_mode(self) -> None:
        """Show the present leg, or the mission again, before anybody is told of the new mode."""
        if (self._aircraft.autopilot.mode is Mode.FLIGHT_PLAN) != (self._instead is not None):
            self._show_leg()

    def _tell_events(self) -> None:
        events = self._plans.take_events()
        if not events:
            return
        blocks = {block.name: block.number for block in self._plans.blocks()}
        for event in events:
            message = plan_event(event, blocks)
            if message is not None:
                self._broadcast.event(self._endpoint.flight_plan.tell(message))
        if any(isinstance(event, BlockEntered) for event in events):
            self._telemetry.publish_now(mavlink.MAVLINK_MSG_ID_DARKO_PLAN_STATUS)

    def _show_leg(self) -> None:
        shown = self._leg() if self._aircraft.autopilot.mode is Mode.FLIGHT_PLAN else None
        if shown != self._instead:
            self._instead, self._leg_told = shown, self._aircraft.vehicle.time
            self._endpoint.show_instead_of_mission(shown)
            self._telemetry.publish_now(mavlink.MAVLINK_MSG_ID_MISSION_CURRENT)

    def _leg(self) -> MissionInstead:
        items: tuple[MissionItem, ...]
        try:
            items = leg_items(self._plans.present_leg())
        except LocalProtocolError:  # it lies beyond what the wire can tell
            items = ()
        return MissionInstead(items, max(len(items) - 1, 0), NO_CHANGE_REASON)

    # What the operator asks

    def load_stored(self) -> None:
        """Load the plan that was sent before the vehicle was started, or tell why not."""
        data = self._state_folder.flight_plan()
        if data is None:
            return
        if reason := self._refusal_of(data, "stored"):
            self._broadcast.warn(f"Stored flight plan not loaded: {reason}")
        else:
            self.was_sent = True
            self._broadcast.info("Stored flight plan loaded; mode FLIGHT_PLAN flies it")

    @on_event(FlightPlanUploaded)
    def load(self, event: FlightPlanUploaded, _now: float) -> None:
        """A peer sent the file of a plan: it is loaded on the ground, and flown when that is asked for."""
        autopilot = self._aircraft.autopilot
        is_up = autopilot.armed or autopilot.flying
        reason = "land and disarm first" if is_up else self._refusal_of(event.data, PLAN_FILE)
        result = REJECTED if reason else ACCEPTED
        self._endpoint.flight_plan_files.answer(event.peer, result, ascii_text(reason, MAX_REASON))
        if reason:
            self._broadcast.warn(f"Flight plan refused: {reason}")
        else:
            self.was_sent = True
            self._broadcast.save(lambda: self._state_folder.save_flight_plan(event.data))
            self._broadcast.info("Flight plan loaded; it is not flown yet")

    def _refusal_of(self, data: bytes, name: str) -> str:
        """Load a plan, or say why not."""
        try:
            packed = unpack_plan(data, name)
            check = check_flown(*packed)
            check.require_flown()
        except ProtocolError as error:
            return str(error)
        world, plan = self._aircraft.autopilot.world, check.plan
        north, west, _ = world.local(plan.lat0, plan.lon0, 0.0)
        if outside := world.refuse((north, west, 0.0)):
            return f"its origin is out of reach: {outside}"
        self._plans.load(check, packed.mapping)
        return ""

    @on_command(mavlink.MAV_CMD_DARKO_JUMP_TO_BLOCK)
    def jump(self, request: CommandRequested) -> Answer:
        """param1 number of the block, param2 of the plan."""
        number = self._number(request)
        return number if isinstance(number, Answer) else self._plans.jump_to_block(number)

    @on_command(mavlink.MAV_CMD_DARKO_MOVE_WAYPOINT)
    def move(self, request: CommandRequested) -> Answer:
        """param1 number of the waypoint, param2 of the plan, param5 to param7 the place."""
        number = self._number(request)
        if isinstance(number, Answer):
            return number
        point = next((point for point in self._plans.waypoints() if point.number == number), None)
        if point is None:
            return Answer(DENIED, f"Waypoint denied: the plan has no waypoint {number}")
        if request.frame is None:
            return Answer(mavlink.MAV_RESULT_COMMAND_INT_ONLY, "A waypoint is moved with COMMAND_INT")
        if request.frame != mavlink.MAV_FRAME_LOCAL_ENU and request.frame not in POSITION_FRAMES:
            return Answer(UNSUPPORTED_FRAME, f"Waypoint denied: frame {request.frame} is not supported")
        place = self._place(request, point)
        if place is None:
            return Answer(DENIED, f"Waypoint {point.name} denied: the position is not valid")
        return self._plans.move_waypoint(point.name, place)

    @on_command(mavlink.MAV_CMD_DARKO_SET_VARIABLE)
    def set_variable(self, request: CommandRequested) -> Answer:
        """param1 number of the variable, param2 of the plan, param3 the value."""
        number = self._number(request)
        if isinstance(number, Answer):
            return number
        variables = self._plans.variables()
        if not 1 <= number <= len(variables):
            return Answer(DENIED, f"Variable denied: the plan has no variable {number}")
        return self._plans.set_variable(variables[number - 1].name, request.params[2])

    def _number(self, request: CommandRequested) -> int | Answer:
        """param1, if it is a number of the plan that the sender knows."""
        number, key = request.params[:2]
        if self._plans.executor is None:
            return Answer(REJECTED, "Refused: no flight plan is loaded")
        if self._plans.executor is not self._loaded or (not math.isnan(key) and key != plan_key(self._plan_id)):
            return Answer(DENIED, "Denied: another flight plan is loaded than the one meant")
        return int(number)

    def _place(self, request: CommandRequested, point: NamedWaypoint) -> EnuPoint | None:
        """New position of a waypoint, of the plan's origin [m]; an altitude that is left open stays as it is."""
        first, second, up = request.params[4:7]
        if math.isnan(first) or math.isnan(second):
            return None
        if request.frame == mavlink.MAV_FRAME_LOCAL_ENU:
            return EnuPoint(first, second, point.position.z if math.isnan(up) else up)
        world = self._aircraft.autopilot.world
        north, west, _ = world.local(first, second, 0.0)
        here_north, here_west, _ = world.local(point.place.lat_deg, point.place.lon_deg, 0.0)
        x, y = point.position.x - (west - here_west), point.position.y + (north - here_north)
        above_sea = request.frame in ABSOLUTE_ALTITUDE_FRAMES
        return EnuPoint(x, y, point.position.z if math.isnan(up) else world.up(up, above_sea=above_sea))
