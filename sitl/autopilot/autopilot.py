"""The autopilot: one tick of its parts after the other, on simulated time.

Requests are made of the parts: ``arming``, ``guided``, ``missions``, ``flight_plan``, ``offboard``, ``manual`` and
``transitions``. Each answers with an :class:`~sitl.autopilot.answers.Answer` (a MAV_RESULT and words for the pilot) and
changes nothing when it refuses. The parts share one :class:`~sitl.autopilot.flight_state.FlightState`.
"""

from __future__ import annotations

import math

from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.names import Mode
from sitl.autopilot.answers import DENIED, Answer, Notice
from sitl.autopilot.arming import Arming, crash_text
from sitl.autopilot.camera import Camera
from sitl.autopilot.failsafes import FailsafeResponse, Failsafes
from sitl.autopilot.flight_plans import FlightPlanRequests
from sitl.autopilot.flight_state import FlightState
from sitl.autopilot.guided import GuidedRequests, TransitionRequests
from sitl.autopilot.manual import ManualRequests
from sitl.autopilot.mission.runner import MissionRunner
from sitl.autopilot.missions import MissionRequests
from sitl.autopilot.offboard import OffboardRequests
from sitl.autopilot.orders import Orders
from sitl.autopilot.settings import Settings
from sitl.autopilot.watches import TakeOffWatch
from sitl.autopilot.world import Fence, World
from sitl.control.reference import Point, Reference, hover_at
from sitl.guidance.headings import SafeHeading
from sitl.guidance.landing import LiftOff
from sitl.guidance.manoeuvres import Hold, Manoeuvre
from sitl.guidance.setpoints import MovingReference
from sitl.guidance.view import VehicleView
from sitl.prediction.chooser import Chooser
from sitl.prediction.mode_choice import Decision

POINTED_MODES = frozenset({Mode.MISSION, Mode.HOLD})
OVERHEAD = 1.0  # nearer than this a region of interest has no bearing [m]


def pointed(reference: Reference, flight: FlightState) -> Reference:
    """The reference with the heading that is asked for; as it is in forward flight and where something lands."""
    view = flight.view
    hovers = flight.flying and not (view.forward or reference.forward or reference.steered or flight.landing)
    if not hovers or flight.mode not in POINTED_MODES:
        return reference
    turn = flight.mission.turn if flight.mode is Mode.MISSION and flight.mission is not None else flight.turn
    if turn is not None:
        return reference._replace(heading=turn.update(view))
    if flight.roi is None or math.dist(flight.roi[:2], view.p[:2]) < OVERHEAD:
        return reference
    return reference._replace(heading=math.atan2(flight.roi[1] - view.p[1], flight.roi[0] - view.p[0]))


CHOSEN_DISARMED = frozenset({Mode.RTL, Mode.LAND, Mode.POSCTL})  # on the ground, where nothing begins with them
WAYS_DOWN = frozenset({Mode.RTL, Mode.LAND})
STEERED_MODES = frozenset({Mode.OFFBOARD, Mode.POSCTL})  # somebody steers the heading


class Autopilot:
    """Modes, arming, requests, missions and failsafes of one vehicle.

    After any call, read ``notices()``, ``reached()`` and ``decisions()``; each hands over what is new.

    Args:
        world: Where it flies.
        settings: By which it flies.
        heading: Of the vehicle [rad].
        chooser: Decides whether a leg is hovered or flown forward; None: every leg is hovered.
    """

    def __init__(self, world: World, settings: Settings, heading: float = 0.0, chooser: Chooser | None = None) -> None:
        self._flight = flight = FlightState(world, settings, heading, chooser)
        self._heading, self._lift_off, self._take_off = SafeHeading(), LiftOff(), TakeOffWatch()
        self._foreign: Manoeuvre | None = None  # from elsewhere
        moving = MovingReference()  # one for both: a velocity goes on where the sticks left the reference
        self.failsafes = Failsafes()
        self.arming = Arming(flight, self.failsafes)
        self.transitions = TransitionRequests(flight)
        self.guided = GuidedRequests(flight, self.arming)
        self.missions = MissionRequests(flight, self.arming)
        self.offboard = OffboardRequests(flight, self.arming, moving)
        self.manual = ManualRequests(flight, moving)
        self.arming.stick_problem = lambda: self.manual.problem
        self.flight_plan = FlightPlanRequests(flight, self.arming, self.failsafes, self.manual)
        flight.plan_lands = lambda: self.flight_plan.landing
        self.orders = Orders(flight, self)
        flight.carry_out = self.orders.carry_out
        self._response = FailsafeResponse(flight, self.failsafes)
        self._fence = Fence()  # as it was loaded, in force or not
        self._fence_enabled = True
        self._apply_fence()

    # State

    @property
    def mode(self) -> Mode:
        """The flight mode."""
        return self._flight.mode

    @property
    def armed(self) -> bool:
        """Whether the motors may turn."""
        return self._flight.armed

    @property
    def flying(self) -> bool:
        """Whether the vehicle is to be in the air."""
        return self._flight.flying and not self._flight.stays_on_ground

    @property
    def landing(self) -> bool:
        """Whether contact with the ground shall end the flight."""
        return self._flight.landing

    @property
    def terminated(self) -> str:
        """The reason why the motors were cut in flight; empty if they were not."""
        return self._flight.terminated

    @property
    def view(self) -> VehicleView:
        """The vehicle at the last tick."""
        return self._flight.view

    @property
    def reference(self) -> Reference:
        """Set-point of the laws at the last tick; the heading that is handed to them may differ."""
        return self._flight.reference

    @property
    def manoeuvre(self) -> Manoeuvre | None:
        """Under way outside of missions; None on the ground and in missions."""
        return self._flight.manoeuvre

    @property
    def mission(self) -> MissionRunner | None:
        """The mission that is loaded, None without one."""
        return self._flight.mission

    def refuse_mission(self, world: World | None = None) -> str | None:
        """The reason why the mission cannot be flown, in this world or another; None if it can, or there is none."""
        return self._flight.refuse_mission(world)

    @property
    def world(self) -> World:
        """The world in which it flies: arena, fence, rally points and home."""
        return self._flight.world

    @property
    def camera(self) -> Camera:
        """On board."""
        return self._flight.camera

    @property
    def settings(self) -> Settings:
        """By which it flies."""
        return self._flight.settings

    @property
    def chooser(self) -> Chooser | None:
        """Decides whether a leg is hovered or flown forward; None: every leg is hovered."""
        return self._flight.chooser

    # What is new

    def say(self, severity: int, text: str) -> None:
        """Queue a line for the pilot, with its MAV_SEVERITY."""
        self._flight.say(severity, text)

    def notices(self) -> list[Notice]:
        """Lines for the pilot since the last call."""
        return self._flight.take_notices()

    def reached(self) -> list[int]:
        """Mission items done since the last call."""
        return self.missions.take_reached()

    def decisions(self) -> list[tuple[int, Decision]]:
        """Decisions how to fly a leg since the last call, each with its mission item."""
        return self._flight.chooser.made() if self._flight.chooser is not None else []

    # The tick

    def update(self, view: VehicleView) -> Reference:
        """Advance by one autopilot tick, and give the reference of the laws.

        Args:
            view: The vehicle as it is now.
        """
        flight = self._flight
        last, flight.view = flight.view.law, view
        if flight.flying:
            self._response.check()
        if flight.mode is Mode.OFFBOARD and (problem := self.offboard.attitude_problem(last)):
            self._response.lose_setpoints(problem.capitalize())
        if flight.mode is Mode.FLIGHT_PLAN:
            self._follow_plan()
        elif not flight.flying:
            self._stand()
        elif flight.mode is Mode.MISSION and flight.mission is not None:
            self.missions.update(flight.mission)
        elif flight.manoeuvre is not None:
            self._fly()
        self.transitions.update()
        flight.camera.update(view, flight.roi)
        if flight.manoeuvre is not None and flight.manoeuvre is self._foreign:
            return flight.reference
        steered = flight.mode in STEERED_MODES
        unaided, landing = self.failsafes.navigation.lost, flight.landing
        self._watch_take_off()
        flight.reference = pointed(flight.reference, flight)
        lifted = self._lift_off.applied(flight.reference, view, flight.settings.climb_rate, landing=landing)
        return self._heading.applied(lifted, view, steered=steered, landing=landing, unaided=unaided)

    def _watch_take_off(self) -> None:
        """Give up a take-off that does not rise; who steers by hand or by attitudes sees to that himself."""
        flight = self._flight
        reason = self._take_off.check(flight.view, flight.reference.position.z, flight.settings.climb_rate)
        flight.has_risen = self._take_off.has_risen
        if reason and self.flying and not flight.landing and flight.mode not in STEERED_MODES:
            self.arming.give_up_take_off(reason)

    def _follow_plan(self) -> None:
        """Fly the plan; on the ground it goes on as well, and may start the motors."""
        if not self._flight.flying:
            self._stand()
        if self._flight.mode is Mode.FLIGHT_PLAN:
            self.flight_plan.update()

    def _stand(self) -> None:
        flight, view = self._flight, self._flight.view
        self.failsafes.rest()
        if not (flight.armed or self._fence_enabled):
            self.enable_fence(enabled=True)
        flight.reference = hover_at(view.p, view.heading, flight.settings.hover_speed)
        self.arming.update()
        if flight.mode is Mode.POSCTL and flight.armed:
            self.manual.stand()

    def _fly(self) -> None:
        flight = self._flight
        if flight.mode is Mode.OFFBOARD and self.offboard.is_stale():
            self._response.lose_setpoints("Set-points stopped")
            return
        if flight.mode is Mode.POSCTL:
            self.manual.update()
        manoeuvre = flight.manoeuvre
        if manoeuvre is None:
            return
        flight.reference = manoeuvre.update(flight.view)
        if flight.mode is Mode.TAKEOFF and manoeuvre.done(flight.view):
            flight.say(mavlink.MAV_SEVERITY_INFO, "Take-off complete: holding")
            flight.enter(Mode.HOLD, Hold(flight.reference))

    def touched_down(self, view: VehicleView) -> None:
        """The supervisor jumped to LANDED by contact: end the landing, or the flight of a vehicle that lies there.

        Args:
            view: The vehicle as it is now.
        """
        flight = self._flight
        flight.view = view
        landing, flight.flying = flight.landing, False
        if not landing:
            self.arming.fell_over("Tipped over on the ground")
            return
        self.arming.touched_down()
        self.missions.touched_down()
        if flight.mode is Mode.FLIGHT_PLAN:
            self.flight_plan.touched_down()
        else:
            flight.enter(Mode.HOLD, None)

    def crashed(self, view: VehicleView) -> None:
        """The supervisor jumped to CRASHED: the flight is over until a reboot.

        Args:
            view: The vehicle as it is now.
        """
        self._flight.view = view
        self._flight.flying = False
        self.arming.fell_over(crash_text(view, self.world.home))

    # What is flown

    def set_mode(self, mode: Mode) -> Answer:
        """Change the mode as a ground station's mode switch does; a disarmed vehicle takes it as well."""
        requests = {
            Mode.HOLD: self.guided.hold,
            Mode.TAKEOFF: self.guided.take_off,
            Mode.MISSION: self.missions.start if self.armed else self.missions.choose,
            Mode.LAND: self.guided.land,
            Mode.RTL: self.guided.return_to_launch,
            Mode.OFFBOARD: self.offboard.start if self.armed else self.offboard.choose,
            Mode.POSCTL: self.manual.start,
            Mode.FLIGHT_PLAN: self.flight_plan.start,
        }
        if mode in CHOSEN_DISARMED and not self.armed and self.view.landed:
            return self.arming.choose(mode)
        request = requests.get(mode)
        if request is None:
            return self._flight.refuse(DENIED, f"Mode {mode.name} is not available on this vehicle")
        return request()

    def fly(self, mode: Mode, manoeuvre: Manoeuvre) -> None:
        """Fly a manoeuvre from elsewhere under a mode; its references are handed to the laws as they are."""
        self._foreign = manoeuvre
        self._flight.enter(mode, manoeuvre)

    def begin_hovering(self, reference: Reference, view: VehicleView) -> None:
        """Begin a simulation in the air: armed, holding at a reference."""
        flight = self._flight
        flight.armed = flight.flying = True
        flight.reference = reference
        self.update(view)
        flight.hold_here()

    def hold_after_error(self) -> None:
        """Hold after an error of the vehicle's own code that does not steer; a return or a landing goes on."""
        flight = self._flight
        if flight.flying and not flight.landing and flight.mode not in WAYS_DOWN:
            flight.hold_here()

    def recover(self) -> Reference:
        """Hold after an error within a tick, whatever was flown: the reference of the laws until the next tick."""
        flight = self._flight
        if flight.mode is not Mode.HOLD or (flight.flying and not isinstance(flight.manoeuvre, Hold)):
            flight.hold_here()
        if isinstance(flight.manoeuvre, Hold):
            flight.reference = flight.manoeuvre.reference
        return flight.reference

    # Where it is flown, and by which settings

    def configure(self, settings: Settings) -> None:
        """Take changed settings; what is under way goes on at their speeds, unless others were asked for."""
        self._flight.configure(settings)
        self._apply_fence()

    def load_fence(self, fence: Fence) -> None:
        """Replace the fence; the settings decide whether it is in force."""
        self._fence = fence
        self._apply_fence()

    def enable_fence(self, *, enabled: bool) -> None:
        """Put the fence that the settings have in force, or out of it until the vehicle is disarmed."""
        self._fence_enabled = enabled
        self._apply_fence()

    def load_rally(self, points: tuple[Point, ...]) -> None:
        """Replace the rally points, world NWU [m]."""
        self._flight.world = self.world._replace(rally=points)
        self._apply_fence()

    def relocate(self, frame: LocalFrame, home: Point) -> None:
        """Put the world frame elsewhere on the globe, or home elsewhere in it.

        What is under way goes on as it began, except for a return that does not land yet: it turns to the new home.

        Args:
            frame: Where the world frame is.
            home: World NWU [m].
        """
        flight = self._flight
        flight.world = flight.world._replace(frame=frame, home=home)
        self._apply_fence()
        if flight.mode is Mode.RTL and flight.flying and not flight.landing:
            flight.enter(Mode.RTL, flight.route_home(flight.view))

    def _apply_fence(self) -> None:
        """Put fence, rally points and home in force, for a mission under way as well."""
        flight, s = self._flight, self._flight.settings
        fence = self._fence._replace(max_distance=s.fence_distance, max_height=s.fence_height, home=flight.world.home)
        arena = flight.world.arena._replace(clearance=s.clearance)
        flight.world = flight.world._replace(
            fence=fence if s.fence_action and self._fence_enabled else Fence(), arena=arena
        )
        if flight.mission is not None:
            flight.mission.world = flight.world
