"""The flight under way: the state that all parts of the autopilot share, and the few ways to change it."""

from __future__ import annotations

import math
from collections.abc import Callable

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.names import Mode
from protocol.plans.plan import MissionItem, Refusal
from sitl.autopilot.answers import Answer, Notice
from sitl.autopilot.camera import Camera
from sitl.autopilot.leg_planner import FORWARD_DRIFT, Arrival, LegPlanner, stopping_point
from sitl.autopilot.mission.items import Order, refuse_items
from sitl.autopilot.mission.runner import FlyPattern, LandingPattern, MissionRunner, return_pattern
from sitl.autopilot.mission.speeds import MissionSpeeds
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import World
from sitl.control.reference import CIRCLE, Point, Reference, hover_at
from sitl.enclosure.arena_detours import crossed, crosses_circle
from sitl.guidance.circles import FlyCircle, rim
from sitl.guidance.headings import YawTurn
from sitl.guidance.landing import LandingDescent
from sitl.guidance.legs import FlyLeg, stretches_of
from sitl.guidance.manoeuvre_changes import follow_airspeed, follow_hover_speed
from sitl.guidance.manoeuvres import FlyTo, Hold, Manoeuvre, ManoeuvreSequence, Ramp, StayOnGround, current_step
from sitl.guidance.view import VehicleView
from sitl.guidance.way_ahead import WayStretch
from sitl.prediction.chooser import Chooser


class FlightState:
    """Mode, arming state, mission, manoeuvre and reference.

    Attributes:
        world: Where it flies.
        settings: By which it flies.
        chooser: Decides whether a leg is hovered or flown forward; None: every leg is hovered.
        mode: The flight mode.
        armed: Whether the motors may turn.
        has_risen: It has been clear of the ground since it last stood there.
        flying: Whether it is to be in the air: the supervisor leaves the ground on this.
        mission: The mission that is loaded, None without one.
        manoeuvre: Under way outside of missions; None on the ground and in missions.
        view: The vehicle at the last tick.
        reference: Of the control laws, from the last tick.
        plan_lands: Whether a flight plan is to end on the ground now.
        camera: On board.
        roi: Where camera and, in the hover, belly are turned to, world NWU [m]; None: to nowhere.
        turn: Of the heading, on request outside of missions; ends with the manoeuvre.
        carry_out: Carries out what missions ask of other parts.
        terminated: Why the motors were cut in flight, for good until a reboot; empty if they were not.
    """

    def __init__(self, world: World, settings: Settings, heading: float = 0.0, chooser: Chooser | None = None) -> None:
        self.world = world
        self.settings = settings
        self.chooser = chooser
        self.mode = Mode.HOLD
        self.armed = False
        self.flying = False
        self.has_risen = True  # a simulation may begin in the air
        self.mission: MissionRunner | None = None
        self.manoeuvre: Manoeuvre | None = None
        self.plan_lands: Callable[[], bool] = lambda: False
        self.camera = Camera()
        self.roi: Point | None = None
        self.turn: YawTurn | None = None
        self.carry_out: Callable[[Order], object] = lambda _order: None
        self.terminated = ""
        nowhere = (0.0, 0.0, 0.0)
        self.view = VehicleView(
            time=0.0, p=nowhere, v=nowhere, heading=heading, tilt=0.0, landed=True, battery_remaining=1.0
        )
        self.reference = hover_at(nowhere, heading, settings.hover_speed)
        self._notices: list[Notice] = []
        self._before_change: list[Callable[[Mode], None]] = []

    # Words

    def take_notices(self) -> list[Notice]:
        """Lines for the pilot since the last call."""
        taken, self._notices = self._notices, []
        return taken

    def say(self, severity: int, text: str) -> None:
        """Queue a line for the pilot, with its MAV_SEVERITY."""
        self._notices.append(Notice(severity, text))

    def refuse(self, result: int, text: str) -> Answer:
        """The answer that refuses a request with a MAV_RESULT; the pilot reads why."""
        self.say(mavlink.MAV_SEVERITY_WARNING, text)
        return Answer(result, text)

    # By what it is flown

    def configure(self, settings: Settings) -> None:
        """Take changed settings; a manoeuvre at the speeds of the old ones goes on at those of the new ones."""
        before, self.settings = self.settings, settings
        if self.mission is not None:
            self.mission.configure(settings)
        follow_hover_speed(self.manoeuvre, before.hover_speed, settings.hover_speed)
        follow_airspeed(self.manoeuvre, before.airspeed, settings.airspeed)

    # What is possible

    @property
    def can_fly_forward(self) -> bool:
        """Whether the airframe can make a transition to forward flight."""
        return self.chooser is not None and self.chooser.can_fly_forward

    @property
    def landing(self) -> bool:
        """Whether contact with the ground shall end the flight."""
        if self.mode is Mode.MISSION and self.mission is not None:
            return self.mission.landing
        if self.mode is Mode.FLIGHT_PLAN:
            return self.plan_lands()
        return self.manoeuvre is not None and self.manoeuvre.landing

    @property
    def circle(self) -> FlyCircle | None:
        """The circle under way, in a mission too; None without one."""
        mission = self.mission if self.mode is Mode.MISSION else None
        under_way = self.manoeuvre if mission is None else mission.manoeuvre
        return under_way if isinstance(under_way, FlyCircle) else None

    @property
    def stays_on_ground(self) -> bool:
        """Whether a flight that has begun waits on the ground."""
        mission = self.mission if self.mode is Mode.MISSION else None
        return mission is not None and isinstance(mission.manoeuvre, StayOnGround)

    def stretches_ahead(self) -> tuple[WayStretch, ...]:
        """Legs or the circle that are flown forward by a plan; none in flight by hand or by set-points."""
        path = self.reference.path
        if not self.reference.forward or self.reference.steered:
            return ()
        if self.mode is Mode.MISSION and self.mission is not None:
            return self.mission.stretches_ahead(path)
        if self.mode is Mode.FLIGHT_PLAN:
            return (WayStretch(path),) if path.kind == CIRCLE else ()
        if self.mode not in {Mode.HOLD, Mode.RTL}:
            return ()
        step = current_step(self.manoeuvre)
        return step.runner.stretches_ahead(path) if isinstance(step, FlyPattern) else stretches_of(self.manoeuvre, path)

    def refuse_point(self, p: Point) -> str | None:
        """The reason why the vehicle may not be sent to a point, world NWU [m]; None if it may."""
        if not all(map(math.isfinite, p)):
            return f"position {p} is not a number"
        return self.world.refuse(p)

    def refuse_mission(self, world: World | None = None) -> str | None:
        """The reason why the mission cannot be flown, in this world or another; None if it can, or there is none."""
        if self.mission is None:
            return None
        hovers = self.settings.leg_mode == LegMode.HOVER or not self.can_fly_forward
        radius = 0.0 if hovers else self.settings.loiter_radius
        return refuse_items(self.mission.items, self.world if world is None else world, radius)

    def refuse_climb(self, p: Point) -> str | None:
        """The reason why the vehicle may not climb straight up to a point, world NWU [m]; None if it may."""
        above = crossed(self.world.arena, (p[0], p[1], self.view.p[2]), p, self.settings.clearance)
        return f"'{above[0].name}' is in the way" if above else None

    def refuse_circle(self, centre: Point, radius: float) -> str | None:
        """The reason why the vehicle may not be sent round a centre, world NWU, at a radius [m]; None if it may."""
        outside = next(filter(None, map(self.refuse_point, rim(centre, radius))), None)
        wide = self.settings.clearance + FORWARD_DRIFT
        if outside is None and crosses_circle(self.world.arena, self.view.p, centre, radius, wide):
            return "an obstacle is in its way"
        return outside

    # What is flown

    def runner_of(self, items: tuple[MissionItem, ...]) -> MissionRunner:
        """A runner for a mission, in this world and with these settings."""
        return MissionRunner(items, self.world, self.settings, self.chooser, self.carry_out)

    def before_change(self, call: Callable[[Mode], None]) -> None:
        """Have ``call`` called with the new mode before every change of mode or manoeuvre."""
        self._before_change.append(call)

    def enter(self, mode: Mode, manoeuvre: Manoeuvre | None) -> None:
        """Change the mode and the manoeuvre."""
        for call in self._before_change:
            call(mode)
        if self.mode is Mode.MISSION and mode is not Mode.MISSION:
            self.camera.leave_mission()
        self.mode, self.manoeuvre, self.turn = mode, manoeuvre, None

    def terminate(self, reason: str) -> None:
        """Cut the motors in flight, for a reason the pilot reads: the vehicle comes down, and is not armed again."""
        self.terminated = reason
        self.armed = self.flying = False
        self.say(mavlink.MAV_SEVERITY_EMERGENCY, f"Motors cut: {reason[0].lower()}{reason[1:]}")
        self.enter(Mode.HOLD, None)

    def hold_here(self, retreat: float = 0.0) -> None:
        """Hold where the vehicle can stop, or so much farther inside the net [m]; on the ground, change the mode.

        A vehicle in forward flight that stops to hold already is sent no farther, however often it is told.
        """
        places = [stopping_point(self.view)]
        if isinstance(self.manoeuvre, Hold) and self.view.forward:
            places.append(self.manoeuvre.reference.position)
        place = self.world.arena.clamped(min(places, key=lambda p: math.dist(p, self.view.p)), retreat)
        self.enter(Mode.HOLD, Hold(self.hover_reference(place)) if self.flying else None)

    def land_here(self) -> None:
        """Land where the vehicle can stop."""
        here = self.hover_reference(self.stop_point())
        descent = LandingDescent(here, self.settings.descent_rate, anywhere=True)
        descent.update(self.view)  # what stands lands at once
        self.enter(Mode.LAND, descent)

    def hover_reference(self, p: Point) -> Reference:
        """Hovering at a point, world NWU [m], with the present heading."""
        return hover_at(p, self.reference.heading, self.settings.hover_speed)

    def stop_point(self) -> Point:
        """The point at which the vehicle can stop, inside the net; world NWU [m]."""
        return self.world.arena.clamped(stopping_point(self.view))

    @property
    def _planner(self) -> LegPlanner:
        return LegPlanner(self.settings, self.chooser, self.world.arena, MissionSpeeds())

    def leg_to(
        self, reference: Reference, view: VehicleView | None = None, *, turns: bool = False
    ) -> FlyTo | FlyLeg | ManoeuvreSequence | Refusal:
        """The way from here, or from another view, to a reference, forward if that is better; or why there is none.

        Args:
            reference: The hover at the end.
            view: Where it begins; None: here.
            turns: Whether the heading of the reference was asked for; else a leg flown forward chooses it.
        """
        return self._planner.leg_to(view or self.view, reference, Arrival(turns=turns))

    def find_route_home(self, view: VehicleView) -> ManoeuvreSequence | Refusal:
        """The return from where a vehicle is, by RTL_TYPE; or why there is none."""
        if (pattern := self.landing_pattern(view.p)) is not None:
            return self._to_landing(view, pattern)
        to = self.world.safe_point(view.p, self.settings.return_altitude)
        return self._planner.return_to(view, self.reference, self.world.arena.clamped(to))

    def landing_pattern(self, p: Point) -> LandingPattern | None:
        """The landing of the mission that a return from a point, world NWU [m], flies; None if it goes elsewhere."""
        if self.mission is None:
            return None
        pattern = return_pattern(self.mission.items, self.world, self.settings, p)
        return None if pattern is None or self.refuse_mission() else pattern

    def return_points(self) -> tuple[Point, ...]:
        """Points of a return from here, the last of them the landing point, world NWU [m]."""
        pattern = self.landing_pattern(self.view.p)
        home = self.world.safe_point(self.view.p, self.settings.return_altitude)
        return (home,) if pattern is None else pattern.points

    def _to_landing(self, view: VehicleView, pattern: LandingPattern) -> ManoeuvreSequence:
        """Climb to the height of a return, unless in forward flight, and fly a landing of the mission."""
        assert self.mission is not None  # noqa: S101 - it has the landing
        runner = self.runner_of(self.mission.items)
        runner.jump_to(pattern.start)
        fly = FlyPattern(runner, lambda text: self.say(mavlink.MAV_SEVERITY_NOTICE, text))
        high = self.world.home[2] + self.settings.return_altitude
        above = self.hover_reference((view.p[0], view.p[1], max(view.p[2], high)))
        if view.forward or crossed(self.world.arena, view.p, above.position, self.settings.clearance):
            return ManoeuvreSequence((fly,))
        return ManoeuvreSequence((Ramp(above, self.settings.climb_rate), fly))

    def route_home(self, view: VehicleView) -> ManoeuvreSequence:
        """The same for a vehicle that must return; where there is no way it lands."""
        route = self.find_route_home(view)
        if not isinstance(route, Refusal):
            return route
        self.say(mavlink.MAV_SEVERITY_WARNING, f"No way home, {route.text}: landing here")
        here = self.hover_reference(self.stop_point())
        return ManoeuvreSequence((LandingDescent(here, self.settings.descent_rate, anywhere=True),))
