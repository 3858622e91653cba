"""A flight plan as a mode: loaded once, flown in FLIGHT_PLAN, and what its operator asks of it.

The plan decides where to go and when the motors turn; checks of arming, the arena, the fence, battery, links and
navigation stay in force, and a failsafe that acts leaves the mode.
"""

from __future__ import annotations

import math
from typing import Protocol

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.flight_plans.flight_plan import EnuPoint, FlightPlan, PlanVariable
from protocol.flight_plans.plan_check import PlanCheck
from protocol.flight_plans.plan_names import NameMapping
from protocol.frames import Geodetic
from protocol.names import Mode
from sitl.autopilot.answers import ACCEPTED, DENIED, REJECTED, Answer
from sitl.autopilot.arming import Arming
from sitl.autopilot.failsafes import Failsafes
from sitl.autopilot.flight_plan.aims import (
    AimKind,
    BlockButton,
    ExceptionFired,
    NamedWaypoint,
    PlanEvent,
    PlanRemark,
    PlanStatus,
    PresentLeg,
    VariableSetting,
    WaypointMoved,
    away,
)
from sitl.autopilot.flight_plan.executor import FlightPlanExecutor
from sitl.autopilot.flight_plan.plan_state import MotorRequest, OtherAircraft, PlanFrame, PlanInputs, stage_text
from sitl.autopilot.flight_plan.steering import TOUCHDOWN_HEIGHT, PlanSteering
from sitl.autopilot.flight_state import FlightState
from sitl.control.reference import Point
from sitl.guidance.legs import crosswind_heading

MIN_RISE = 0.3  # an altitude that is wanted by so much higher takes off [m]
TOUCH_HEIGHT = 0.5  # lower than this, stopping the motors is the end of a landing [m]
MAX_EVENTS = 100  # that wait to be taken
MAX_VARIABLE = 1e9  # size of a value that an operator may give a plan's variable


class PilotSticks(Protocol):
    """A pilot's sticks, as a plan reads them."""

    @property
    def silence(self) -> float | None:
        """Since the last ones arrived [s]; None: none ever did."""

    @property
    def velocity(self) -> Point:
        """Velocity that fresh sticks ask for, world NWU [m/s]; zero without any."""


class FlightPlanRequests:
    """Loads and flies the flight plan of a flight, and answers its operator.

    Args:
        flight: The flight.
        arming: Starts and stops its motors.
        failsafes: Know how long the links are silent.
        sticks: Those of a pilot, if there are any.

    Attributes:
        executor: Of the plan that is loaded; None without one.
        others: Aircraft that a plan may follow.
    """

    def __init__(
        self,
        flight: FlightState,
        arming: Arming,
        failsafes: Failsafes,
        sticks: PilotSticks | None = None,
    ) -> None:
        self._flight, self._arming, self._failsafes = flight, arming, failsafes
        self._sticks = sticks
        self.executor: FlightPlanExecutor | None = None
        self.others = OtherAircraft()
        self._steering = PlanSteering()
        self._heading = 0.0  # of the hover [rad]
        self._stops_on_ground = False  # the plan has stopped the motors just above the ground
        self._said = ""
        self._left_on_ground = True  # the plan was last flown on the ground, or not at all
        self._waits = False  # in the air, for the operator to choose a block
        self._events: list[PlanEvent] = []

    # Loading and starting

    def load(self, check: PlanCheck, mapping: NameMapping | None = None) -> None:
        """Replace the plan; one that is being flown ends in a hold.

        Raises:
            FlightPlanError: It cannot be flown at all.
        """
        check.require_flown()
        if self._flight.mode is Mode.FLIGHT_PLAN:
            self._flight.hold_here()
        self.executor = FlightPlanExecutor(check, self._inputs(), mapping)
        self._steering = PlanSteering()
        self._left_on_ground = True

    def start(self) -> Answer:
        """Fly the plan: from its first block, or from where it was left.

        A plan that was left on the ground waits in the air for a block: where it stands it may stop the motors.
        """
        flight, executor = self._flight, self.executor
        if executor is None:
            return flight.refuse(REJECTED, "Flight plan refused: none is loaded")
        self._steering.rest()
        held = flight.stop_point()
        flight.enter(Mode.FLIGHT_PLAN, None)
        self._waits = flight.flying and self._left_on_ground
        if self._waits:
            flight.reference = flight.hover_reference(held)
            self._say("Flight plan waits in the air: choose a block")
        self._heading = flight.reference.heading if flight.flying else flight.view.heading
        self._place_frame(executor.plan)
        return Answer(ACCEPTED)

    # The tick

    @property
    def landing(self) -> bool:
        """Whether contact with the ground shall end the flight."""
        view = self._flight.view
        low = view.p[2] < TOUCHDOWN_HEIGHT and not view.forward
        return self._stops_on_ground or (low and self._steering.sinks_to_ground)

    def update(self) -> None:
        """Fly the plan for one tick, on the ground as well."""
        flight, executor = self._flight, self.executor
        if executor is None:
            return
        if self._waits and flight.flying:
            return
        self._place_frame(executor.plan)
        inputs = self._inputs()
        self._left_on_ground = not flight.flying
        frame = self._steering.frame
        executor.update(inputs, frame.to_plan(flight.view.p), frame.turned(flight.view.v))
        self._obey_motor_requests(executor)
        self._collect(executor)
        if flight.mode is not Mode.FLIGHT_PLAN:
            return
        if not flight.flying and not self._lifts_off(executor):
            self._steering.rest()
            self._heading = flight.view.heading
            return
        self._steer(executor)

    def touched_down(self) -> None:
        """The vehicle touched the ground."""
        self._steering.rest()
        if self._stops_on_ground:
            self._stops_on_ground = False
            self._arming.disarm()

    def _steer(self, executor: FlightPlanExecutor) -> None:
        flight, memory = self._flight, executor.memory
        if memory.heading is not None:
            self._heading = -memory.heading
        elif flight.view.forward:
            self._heading = flight.reference.heading
        elif not self.landing:  # the span along the wind, before it lands there
            self._heading = crosswind_heading(self._heading, flight.view.wind)
        speed = flight.settings.hover_speed
        if memory.max_speed is not None:
            speed = min(speed, memory.max_speed)
        way = LegMode.FORWARD if memory.forces_forward else LegMode.NONE
        aim = executor.aim
        if self._stops_on_ground:
            aim = aim._replace(kind=AimKind.POINT, end=self._steering.frame.to_plan(flight.view.p), climb=-1.0)
        elif aim.kind is AimKind.NOTHING:
            aim = aim._replace(kind=AimKind.POINT, end=self._steering.frame.to_plan(flight.stop_point()))
            executor.aim = aim
        flight.reference = self._steering.update(aim, self._inputs(), flight.reference, self._heading, speed, way)
        if self._steering.refused and self._steering.refused != self._said:
            self._say(f"Flight plan holds: {self._steering.refused}")
        self._said = self._steering.refused

    def _lifts_off(self, executor: FlightPlanExecutor) -> bool:
        """Take off if the motors turn and the plan wants to be higher."""
        flight, aim = self._flight, executor.aim
        if not flight.armed or aim.kind is AimKind.NOTHING:
            return False
        high = aim.climb > 0.0 if aim.climb is not None else aim.end.z > flight.view.p[2] + MIN_RISE
        if high:
            self._steering.rest()
            flight.flying = True
        return high

    def _obey_motor_requests(self, executor: FlightPlanExecutor) -> None:
        flight = self._flight
        for request in executor.take_motor_requests():
            if request is MotorRequest.START:
                self._stops_on_ground = False
                if not flight.armed:
                    self._arming.arm()
            elif not flight.flying or flight.view.landed:
                self._arming.disarm()
            elif flight.view.p[2] < TOUCH_HEIGHT:
                self._stops_on_ground = True
            else:
                flight.terminate("Stopped by the flight plan")

    def _inputs(self) -> PlanInputs:
        flight, silence, sticks = self._flight, self._failsafes.silence, self._sticks
        heard = silence.in_control if silence.in_control is not None else silence.ground
        return PlanInputs(
            view=flight.view,
            world=flight.world,
            settings=flight.settings,
            chooser=flight.chooser,
            armed=flight.armed,
            flying=flight.flying,
            datalink_time=0.0 if heard is None else heard,
            stick_velocity=sticks.velocity if sticks is not None else (0.0, 0.0, 0.0),
            others=self.others,
            frame=self._steering.frame,
            radio_lost=((sticks.silence if sticks else None) or 0.0) > flight.settings.stick_timeout,
        )

    def _place_frame(self, plan: FlightPlan) -> None:
        """Find the plan's origin in the world frame, which may have been moved."""
        origin = self._flight.world.frame.origin
        north, east, _ = self._flight.world.frame.to_ned(Geodetic(plan.lat0, plan.lon0, origin.alt))
        self._steering.frame = PlanFrame(east, north)

    # What happened

    def take_events(self) -> list[PlanEvent]:
        """Events of the plan since the last call."""
        taken, self._events = self._events, []
        return taken

    def _collect(self, executor: FlightPlanExecutor) -> None:
        for event in executor.take_events():
            self._events.append(event)
            if isinstance(event, ExceptionFired):
                text = f"Flight plan: {event.text} (line {event.line}): {event.from_block} -> {event.to_block}"
                self._say(text)
            elif isinstance(event, PlanRemark):
                self._say(event.text)
        del self._events[:-MAX_EVENTS]

    def _say(self, text: str) -> None:
        self._flight.say(mavlink.MAV_SEVERITY_NOTICE, text)

    # What the operator sees

    def blocks(self) -> tuple[BlockButton, ...]:
        """The blocks of the plan, HOME last; empty without a plan."""
        executor = self.executor
        if executor is None:
            return ()
        buttons = []
        for number, steps in enumerate(executor.flow.blocks):
            b = steps.block
            locked = str(executor.check.locked_blocks[steps.name]) if executor.is_locked(number) else ""
            texts = (b.strip_button, b.strip_icon, b.key, b.group, b.description) if b is not None else (None,) * 5
            buttons.append(BlockButton(number, steps.name, *texts, locked))
        return tuple(buttons)

    def status(self) -> PlanStatus | None:
        """Progress of the plan; None without one."""
        executor = self.executor
        if executor is None:
            return None
        flow = executor.flow
        step = flow.step
        return PlanStatus(
            block=flow.block,
            block_name=flow.present.name,
            stage=flow.stage,
            stage_text="" if step is None else stage_text(step.stage),
            line=0 if step is None else step.stage.place.line,
            block_time=flow.block_time,
            stage_time=flow.stage_time,
            flight_time=executor.memory.flight_time,
            aim=executor.aim.kind,
        )

    def waypoints(self) -> tuple[NamedWaypoint, ...]:
        """The waypoints where they are now."""
        executor = self.executor
        if executor is None:
            return ()
        table = executor.waypoints
        return tuple(
            NamedWaypoint(
                number, point.name, table.at(point.name), self._geodetic(table.at(point.name)), point.is_shown
            )
            for number, point in enumerate(executor.plan.waypoints, 1)
        )

    def variables(self) -> tuple[VariableSetting, ...]:
        """The variables of the plan."""
        executor = self.executor
        if executor is None:
            return ()
        return tuple(
            VariableSetting(
                v.var, v.shortname or v.var, float(executor.memory.variables[v.var]), v.min, v.max, v.step, v.unit
            )
            for v in executor.plan.variables
            if isinstance(v, PlanVariable)
        )

    def present_leg(self) -> PresentLeg | None:
        """The leg flown now; None without a plan or before its first stage of movement."""
        executor = self.executor
        if executor is None or executor.aim.kind in {AimKind.NOTHING, AimKind.VELOCITY}:
            return None
        aim = executor.aim
        start = aim.start if aim.kind is AimKind.LEG else self._steering.frame.to_plan(self._flight.view.p)
        name = aim.name if aim.name in executor.waypoints.names else ""
        return PresentLeg(aim.kind, self._geodetic(start), self._geodetic(aim.end), aim.radius, name)

    def _geodetic(self, p: EnuPoint) -> Geodetic:
        north, west, up = self._steering.frame.to_world(p)
        return self._flight.world.frame.to_geodetic((north, -west, -up))

    # What the operator asks

    def jump_to_block(self, block: str | int) -> Answer:
        """Enter a block, by its name or number; while the plan is not flown, it begins there."""
        flight, executor = self._flight, self.executor
        if executor is None:
            return flight.refuse(REJECTED, "Block refused: no flight plan is loaded")
        names = [steps.name for steps in executor.flow.blocks]
        number = names.index(block) if isinstance(block, str) and block in names else block
        if not isinstance(number, int) or not 0 <= number < len(names):
            return flight.refuse(DENIED, f"Block denied: the plan has no block {block!r}"[:100])
        if executor.is_locked(number):
            finding = executor.check.locked_blocks[names[number]]
            return flight.refuse(DENIED, f"Block {names[number]} denied: {finding.construct} is not flown")
        executor.jump(number)
        self._waits = self._left_on_ground = False
        return Answer(ACCEPTED)

    def move_waypoint(self, name: str, position: EnuPoint) -> Answer:
        """Put a waypoint elsewhere, in flight or not.

        Args:
            name: Of the waypoint.
            position: Of the plan's origin [m].
        """
        flight, executor = self._flight, self.executor
        if executor is None:
            return flight.refuse(REJECTED, "Waypoint refused: no flight plan is loaded")
        if name not in executor.waypoints.names:
            return flight.refuse(DENIED, f"Waypoint denied: the plan has no waypoint {name!r}"[:100])
        if not all(map(math.isfinite, position)):
            return flight.refuse(DENIED, f"Waypoint {name} denied: the position is not a number")
        self._place_frame(executor.plan)
        north, west, up = self._steering.frame.to_world(position)
        reason = flight.world.refuse((north, west, max(up, 0.0)))
        limit = executor.plan.max_dist_from_home
        if reason is None and name != "HOME" and away(position, executor.waypoints.home) > limit:
            reason = f"farther than {limit:g} m from HOME"
        if reason is not None:
            return flight.refuse(DENIED, f"Waypoint {name} denied: {reason}")
        executor.waypoints.move(name, position)
        self._events.append(WaypointMoved(flight.view.time, name, position))
        return Answer(ACCEPTED)

    def set_variable(self, name: str, value: float) -> Answer:
        """Set a variable of the plan within its limits."""
        flight, executor = self._flight, self.executor
        if executor is None:
            return flight.refuse(REJECTED, "Variable refused: no flight plan is loaded")
        about = next((v for v in self.variables() if v.name == name), None)
        if about is None:
            return flight.refuse(DENIED, f"Variable denied: the plan has no variable {name!r}"[:100])
        if not math.isfinite(value):
            return flight.refuse(DENIED, f"Variable {name} denied: {value} is not a finite number")
        if abs(value) > MAX_VARIABLE:
            return flight.refuse(DENIED, f"Variable {name} denied: {value:g} is beyond {MAX_VARIABLE:g}")
        low, high = about.low, about.high
        if (low is not None and value < low) or (high is not None and value > high):
            span = f"{'' if low is None else f'{low:g}'}..{'' if high is None else f'{high:g}'}"
            return flight.refuse(DENIED, f"Variable {name} denied: {value:g} is not within {span}")
        executor.names.store(name, value)
        return Answer(ACCEPTED)
