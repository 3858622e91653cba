"""Modes, arming and guided flight: the discrete decisions of the vehicle, without a clock or a wire.

The autopilot ticks at a fixed rate on simulated time. It answers every request with an
:class:`Outcome` (a MAV_RESULT and words for the pilot) and leaves its state unchanged when it refuses.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.modes import Mode
from protocol.plans.mission import MissionItem
from sitl.autopilot import arming
from sitl.autopilot.alarm import DOING, Action
from sitl.autopilot.attitude import Steer, attitude_of, lost, refuse_attitude
from sitl.autopilot.choice import Chooser
from sitl.autopilot.decision import LEAST_HEIGHT, Decision, Way
from sitl.autopilot.failsafe import OFFBOARD_ACTIONS, Failsafes
from sitl.autopilot.fence import Fence
from sitl.autopilot.guidance import (
    FASTEST,
    SLOWEST,
    Attitude,
    FlyTo,
    Guidance,
    Hold,
    Ramp,
    Setpoint,
    Stop,
    Vector,
    View,
    land_at,
    with_speed,
)
from sitl.autopilot.guidance import Sequence as Steps
from sitl.autopilot.legs import FlyLeg, Orbit, orbit
from sitl.autopilot.link_watch import missing
from sitl.autopilot.manual import Sticks
from sitl.autopilot.mission import MissionRunner, World, fly_to, return_home
from sitl.autopilot.mission_items import out_of_bounds
from sitl.autopilot.progress import Transition, is_reached
from sitl.autopilot.settings import Settings
from sitl.autopilot.streamed import (
    FLOOR,
    KEEP_FACING,
    Facing,
    Streamed,
    is_same_leg,
    level_out,
    refuse_turn,
    refuse_velocity,
)

ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
REJECTED = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
FAILED = mavlink.MAV_RESULT_FAILED
DENIED = mavlink.MAV_RESULT_DENIED
UNSUPPORTED = mavlink.MAV_RESULT_UNSUPPORTED
IN_PROGRESS = mavlink.MAV_RESULT_IN_PROGRESS

COMPASS = tuple((math.cos(k * math.pi / 4.0), math.sin(k * math.pi / 4.0)) for k in range(8))


class Outcome(NamedTuple):
    """The answer to a request."""

    result: int  # MAV_RESULT
    text: str = ""  # why, for the pilot; empty when there is nothing to say

    @property
    def accepted(self) -> bool:
        """Whether the request was carried out, or is being carried out."""
        return self.result in {ACCEPTED, IN_PROGRESS}


class Notice(NamedTuple):
    """A line for the pilot."""

    severity: int  # MAV_SEVERITY
    text: str


class Autopilot:
    """Holds mode, arming state, mission and set-point.

    After any call, read ``notices()`` and ``reached()``; each hands over what is new.
    """

    def __init__(self, world: World, settings: Settings, heading: float = 0.0, chooser: Chooser | None = None) -> None:
        self.world = world
        self.settings = settings
        self.chooser = chooser  # of the way to fly a leg; without one the vehicle hovers
        self.mode = Mode.HOLD
        self.armed = False
        self.flying = False  # asked to be in the air: the supervisor leaves the ground on this
        self.mission: MissionRunner | None = None
        self.view = View(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), heading, 0.0, True, 1.0)
        self.setpoint = Setpoint((0.0, 0.0, 0.0), heading, settings.hover_speed)
        self._guidance: Guidance | None = None
        self.under_way: Transition | None = None  # asked for by command, and not ended
        self._streamed = Streamed(self.setpoint)
        self._landed_at: float | None = None
        self._notices: list[Notice] = []
        self._reached: list[int] = []
        self.failsafes = Failsafes()
        self._fence = Fence()  # as it was loaded, in force or not
        self._bound()

    # What the wire reads

    def notices(self) -> list[Notice]:
        """Lines for the pilot since the last call."""
        said, self._notices = self._notices, []
        return said

    def reached(self) -> list[int]:
        """Mission items done since the last call."""
        done, self._reached = self._reached, []
        return done

    def decisions(self) -> list[tuple[int, Decision]]:
        """How legs are to be flown, decided since the last call; each with its mission item."""
        return self.chooser.made() if self.chooser is not None else []

    @property
    def landing(self) -> bool:
        """Whether contact with the ground shall end the flight."""
        if self.mode is Mode.MISSION and self.mission is not None:
            return self.mission.landing
        return self._guidance is not None and self._guidance.landing

    # The tick

    def update(self, view: View) -> Setpoint:
        """Advance the guidance by one autopilot tick and give the set-point.

        Args:
            view: The vehicle as it is now.
        """
        last, self.view = self.view.law, view
        if self.flying:
            self._watch()
        if self.mode is Mode.OFFBOARD and isinstance(self._guidance, Steer) and (why := lost(view, last)):
            self._lose_setpoints(why.capitalize())
        if not self.flying:
            self.failsafes.rest()
            self._rest()
        elif self.mode is Mode.MISSION and self.mission is not None:
            self._fly_mission(self.mission)
        elif self._guidance is not None:
            self._fly_guidance(self._guidance)
        if self.under_way is not None:
            self._look_at(self.under_way)
        return self.setpoint

    def _rest(self) -> None:
        self.setpoint = Setpoint(self.view.p, self.view.heading, self.settings.hover_speed)
        if not self.armed or self._landed_at is None:
            return
        if self.view.time - self._landed_at >= self.settings.disarm_after:
            self._stop_motors("Disarmed after landing")

    def _fly_mission(self, mission: MissionRunner) -> None:
        self.setpoint = mission.update(self.view)
        self._collect(mission)
        if mission.finished:
            self.say(mavlink.MAV_SEVERITY_NOTICE, "Mission complete: holding")
            self._hold_here()

    def _fly_guidance(self, guidance: Guidance) -> None:
        if self.mode is Mode.OFFBOARD and self._streamed.is_stale(self.view.time, self.settings):
            self._lose_setpoints("Set-points stopped")
            return
        if self.mode is Mode.POSCTL:
            guidance = self._follow_sticks(guidance)
        self.setpoint = guidance.update(self.view)
        if self.mode is Mode.TAKEOFF and guidance.done(self.view):
            self.say(mavlink.MAV_SEVERITY_INFO, "Take-off complete: holding")
            self._enter(Mode.HOLD, Hold(self.setpoint))

    def _lose_setpoints(self, why: str) -> None:
        action = OFFBOARD_ACTIONS[self.settings.setpoint_action]
        self.say(mavlink.MAV_SEVERITY_WARNING, f"{why}: {DOING[action]}")
        self._react(action, stop=False)

    def _watch(self) -> None:
        under_way = self._committed()
        told = self.failsafes.check(
            self.view, self.mode, self.world, self.settings, self.chooser, landing=under_way is Action.LAND
        )
        if not told:
            return
        gravest = max(told, key=lambda alarm: alarm.action or Action.NONE)
        for alarm in told:
            self.say(alarm.severity, alarm.text(gravest.action or Action.NONE, under_way))
        self._react(gravest.action or Action.NONE, stop=gravest.stop)

    def _committed(self) -> Action:
        """What no lesser alarm may stop: a landing also while it still comes to rest above its place."""
        if self.landing or self.mode is Mode.LAND:
            return Action.LAND
        return Action.RETURN if self.mode is Mode.RTL else Action.NONE

    def _react(self, action: Action, *, stop: bool) -> None:
        """Do what an alarm asks for, unless something graver is under way.

        Args:
            action: What it asks for.
            stop: Whether a vehicle on the wing stands still before it turns elsewhere.
        """
        if action <= self._committed():
            return
        if action is Action.HOLD:
            self._hold_here()
            return
        if action is Action.LAND:
            self._land_here()
            return
        here = self._at(self._stop_point())
        first = (Stop(here),) if self.view.forward and stop else ()
        view = self.view._replace(p=here.p, v=(0.0, 0.0, 0.0), forward=False) if first else self.view
        self._enter(Mode.RTL, Steps((*first, *self._way_home(view).steps)))

    def _way_home(self, view: View) -> Steps:
        to = self.world.safe_point(view.p, self.settings.return_altitude)
        return return_home(view, self.setpoint, self.settings, to, self.chooser)

    def _collect(self, mission: MissionRunner) -> None:
        self._reached += mission.reached
        for text in mission.notices:
            self.say(mavlink.MAV_SEVERITY_NOTICE, text)
        mission.reached.clear()
        mission.notices.clear()

    def touched_down(self) -> None:
        """The supervisor jumped to LANDED by contact: end the landing."""
        self.flying = False
        self._landed_at = self.view.time
        if self.mode is Mode.MISSION and self.mission is not None:
            self.mission.touched_down()
            self._collect(self.mission)
        self.say(mavlink.MAV_SEVERITY_INFO, "Landed")
        self._enter(Mode.HOLD, None)

    # Requests

    def pre_arm(self) -> list[str]:
        """Why the vehicle may not be armed now, in words; empty if it may."""
        outside = self.world.fence.breach([self.view.p])
        links = missing(self.failsafes.silence, self.settings)
        return arming.reasons(self.view, self.settings) + links + ([] if outside is None else [outside.text])

    def arm(self, *, force: bool = False) -> Outcome:
        """Start the motors at idle. Refused with the failing checks unless forced."""
        if self.armed:
            return Outcome(ACCEPTED)
        reasons = [] if force else self.pre_arm()
        if reasons:
            return self._refuse(REJECTED, f"Arming refused: {'; '.join(reasons)}")
        self.armed = True
        self._landed_at = None
        self.say(mavlink.MAV_SEVERITY_INFO, "Armed by force" if force else "Armed")
        return Outcome(ACCEPTED)

    def disarm(self, *, force: bool = False) -> Outcome:
        """Stop the motors. Denied in the air unless forced."""
        if not self.armed:
            return Outcome(ACCEPTED)
        if not self.view.landed and not force:
            return self._refuse(DENIED, "Disarming denied: in the air")
        self._stop_motors("Motors stopped in the air" if not self.view.landed else "Disarmed")
        return Outcome(ACCEPTED)

    def take_off(self, height: float | None = None) -> Outcome:
        """Climb straight up to a height above home [m]; None takes the set take-off altitude."""
        target = self.world.up(self.settings.takeoff_altitude if height is None else height, above_sea=False)
        here = self.view.p
        if not self.armed:
            return self._refuse(REJECTED, "Take-off refused: not armed")
        if not self.view.landed:
            return self._refuse(REJECTED, "Take-off refused: already in the air")
        point = (here[0], here[1], target)
        reason = self.world.refuse(point)
        if reason is None and target < here[2] + 0.5:
            reason = f"{target:.1f} m is not above the ground"
        if reason is not None:
            return self._refuse(DENIED, f"Take-off denied: {reason}")
        self._enter(Mode.TAKEOFF, Ramp(self._at(point), self.settings.climb_rate))
        self.flying = True
        return Outcome(ACCEPTED)

    def hold(self) -> Outcome:
        """Stop and stay; on the ground, just change the mode."""
        self._hold_here()
        return Outcome(ACCEPTED)

    def land(self) -> Outcome:
        """Descend on the spot until the ground is reached."""
        if not self.flying:
            return self._refuse(REJECTED, "Landing refused: not in the air")
        self._land_here()
        return Outcome(ACCEPTED)

    def return_to_launch(self) -> Outcome:
        """Climb to the return altitude, fly over home or the nearest rally point, and land."""
        if not self.flying:
            return self._refuse(REJECTED, "Return refused: not in the air")
        self._enter(Mode.RTL, self._way_home(self.view))
        return Outcome(ACCEPTED)

    def go_to(self, p: Vector, heading: float | None = None, speed: float | None = None) -> Outcome:
        """Fly to a point and hold there.

        Args:
            p: Position, world NWU [m].
            heading: Heading at the point [rad]; None keeps the present one.
            speed: Speed limit [m/s]; None takes the set hover speed.
        """
        if not self.flying:
            return self._refuse(REJECTED, "Go-to refused: not in the air")
        reason = self._refuse_point(p)
        if reason is not None:
            return self._refuse(DENIED, f"Go-to denied: {reason}")
        setpoint = Setpoint(
            p,
            self.setpoint.heading if heading is None else heading,
            self.settings.hover_speed if speed is None else speed,
        )
        self._enter(Mode.HOLD, fly_to(self.view, setpoint, self.settings, self.chooser))
        return Outcome(ACCEPTED)

    def transition(self, way: Way) -> Outcome:
        """Go over to the wing or to the hover, now; the rest of a mission is flown that way as well.

        Outside a mission the wing needs somewhere to go: it circles a point ahead. What is answered with IN_PROGRESS
        is ``under_way`` until it has an end; whatever else is ordered meanwhile ends it.
        """
        if not self.flying:
            return self._refuse(REJECTED, "Transition refused: not in the air")
        if way is Way.FORWARD and (self.chooser is None or not self.chooser.can_fly_forward):
            return self._refuse(DENIED, "Transition denied: this airframe has no trim between hover and wing")
        if way is Way.FORWARD and self.view.p[2] < LEAST_HEIGHT:
            return self._refuse(REJECTED, f"Transition refused: {self.view.p[2]:.1f} m is too low to tip over")
        done, before = is_reached(way, self.view, self.setpoint), Way.NONE
        if self.mode is Mode.MISSION and self.mission is not None:
            before = self.mission.transition(way)
        elif way is Way.FORWARD and not done:
            circle = self._circle_ahead()
            reason = self._refuse_rim(circle.setpoint.p, self.settings.loiter_radius)
            if reason is not None:
                return self._refuse(REJECTED, f"Transition refused: no room to circle, {reason}")
            self._enter(Mode.HOLD, circle)
        elif way is Way.HOVER and not done:
            self._hold_here()
        if done:
            return Outcome(ACCEPTED)
        self.under_way = Transition(way, self.view, before)
        return Outcome(IN_PROGRESS)

    def cancel_transition(self) -> None:
        """Stop a transition that was asked for by command: hold upright, or fly the mission as it was flown before.

        Upright is where both kinds end: a vehicle that brakes is not sent back to the wing from a speed at which
        neither carries it.
        """
        transition = self.under_way
        if transition is not None:
            transition.cancel()
            self._end(transition)
            self._take_back(transition)

    def _look_at(self, transition: Transition) -> None:
        transition.look(self.view, self.setpoint)
        if transition.end is not None:
            self._end(transition)
            if transition.end.result == FAILED:
                self._take_back(transition)

    def _end(self, transition: Transition) -> None:
        self.under_way = None
        if transition.end is not None and transition.end.text:
            failed = transition.end.result == FAILED
            self.say(mavlink.MAV_SEVERITY_WARNING if failed else mavlink.MAV_SEVERITY_INFO, transition.end.text)

    def _take_back(self, transition: Transition) -> None:
        if self.mode is Mode.MISSION and self.mission is not None:
            self.mission.transition(transition.before)
        else:
            self._hold_here()

    def _circle_ahead(self) -> Orbit:
        """A circle that is joined at its nearest point, flying straight ahead."""
        radius, h, p = self.settings.loiter_radius, self.view.heading, self.view.p
        ahead, right = 1.5 * radius, radius
        centre = (
            p[0] + ahead * math.cos(h) + right * math.sin(h),
            p[1] + ahead * math.sin(h) - right * math.cos(h),
            p[2],
        )
        return orbit(centre, radius, self._at(p), self.settings.airspeed)

    def circle(self, centre: Vector, radius: float, airspeed: float | None = None) -> Outcome:
        """Fly round a point on the wing, for ever.

        Args:
            centre: World NWU [m].
            radius: [m]; positive: clockwise seen from above.
            airspeed: [m/s]; None takes the set one.
        """
        if not self.flying:
            return self._refuse(REJECTED, "Orbit refused: not in the air")
        if self.chooser is None or not self.chooser.can_fly_forward:
            return self._refuse(DENIED, "Orbit denied: this airframe has no trim between hover and wing")
        speed = self.settings.airspeed if airspeed is None else airspeed
        flown = orbit(centre, radius, self._at(self.view.p), speed)
        route = flown.setpoint.route
        if route is None or route.airspeed < SLOWEST or speed > FASTEST:
            return self._refuse(DENIED, f"Orbit denied: {abs(radius):g} m at {speed:g} m/s cannot be flown")
        if min(centre[2], self.view.p[2]) < LEAST_HEIGHT:
            return self._refuse(REJECTED, f"Orbit refused: below {LEAST_HEIGHT:g} m it is too low to tip over")
        reason = self._refuse_rim(centre, abs(radius))
        if reason is not None:
            return self._refuse(DENIED, f"Orbit denied: {reason}")
        self._enter(Mode.HOLD, flown)
        return Outcome(ACCEPTED)

    def change_speed(self, speed: float | None) -> Outcome:
        """Speed of the manoeuvre under way, or of the mission: of the hover, or from 7 m/s on of the wing.

        Args:
            speed: [m/s]; None takes the set one.
        """
        if self.mode is Mode.MISSION and self.mission is not None:
            self.mission.change_speed(-1.0 if speed is None else speed)
            return Outcome(ACCEPTED)
        if speed is None:
            on_wing = isinstance(self._guidance, FlyLeg | Orbit)
            speed = self.settings.airspeed if on_wing else self.settings.hover_speed
        if speed >= SLOWEST:
            return self._change_airspeed(speed)
        if isinstance(self._guidance, FlyTo | Hold):
            self._guidance = with_speed(self._guidance, speed)
        else:
            return self._refuse(REJECTED, "Speed unchanged: not flying to a point")
        return Outcome(ACCEPTED)

    def _change_airspeed(self, speed: float) -> Outcome:
        if not isinstance(self._guidance, FlyLeg | Orbit):
            return self._refuse(REJECTED, f"Speed {speed:g} m/s refused: not on the wing")
        setpoint = self._guidance.setpoint
        if setpoint.route is not None:
            self._guidance.setpoint = setpoint._replace(route=setpoint.route._replace(airspeed=speed))
        return Outcome(ACCEPTED)

    def level_out(self, v: Vector) -> Vector:
        """What is forward, to the left and up of the vehicle, heading alone counting, in world NWU."""
        return level_out(v, self.view.heading)

    def set_offboard_attitude(self, attitude: Attitude) -> str | None:
        """Take one streamed attitude set-point (flown in OFFBOARD). Returns why not, or None."""
        reason = refuse_attitude(attitude, self.view)
        if reason is not None:
            return reason
        self._streamed.arrived(self.view.time)
        steer = Steer(attitude, self.view.time, self.settings.hover_speed)
        if self.mode is Mode.OFFBOARD:
            self._guidance = steer
        else:
            self._streamed.setpoint = steer.update(self.view)
        return None

    def set_offboard_acceleration(self, a: Vector, facing: Facing) -> str | None:
        """Take one streamed acceleration, world NWU [m/s2], as an attitude. Returns why not, or None."""
        if self.chooser is None:
            return "acceleration set-points need an airframe"
        heading = self.setpoint.heading if facing.heading is None else facing.heading
        if facing.turn:
            heading = self.view.heading
        return self.set_offboard_attitude(attitude_of(a, heading, facing.turn, self.chooser.airframe))

    def set_offboard_offset(self, offset: Vector, facing: Facing, *, body: bool) -> str | None:
        """Take one streamed offset from the vehicle, world NWU or along its heading [m]. Returns why not, or None."""
        if not all(map(math.isfinite, offset)):
            return f"position {offset} is not a number"
        place = self._streamed.lay(offset, body=body, view=self.view, settings=self.settings)
        return self.set_offboard_setpoint(place, facing)

    def set_offboard_velocity(self, v: Vector, facing: Facing = KEEP_FACING) -> str | None:
        """Take one streamed velocity set-point, world NWU [m/s] (flown in OFFBOARD). Returns why not, or None."""
        reason = refuse_velocity(v, self.settings, self.chooser) or refuse_turn(facing)
        if reason is not None:
            return reason
        self._streamed.arrived(self.view.time)
        setpoint = self._streamed.velocity(v, facing, self.setpoint, self.view, self.settings)
        if self.mode is Mode.OFFBOARD:
            self._guidance = Hold(setpoint)
        else:
            self._streamed.setpoint = setpoint
        return None

    def set_offboard_setpoint(self, p: Vector, facing: Facing = KEEP_FACING) -> str | None:
        """Take one streamed position set-point (flown in OFFBOARD). Returns why not, or None."""
        reason = self._refuse_point(p)
        if reason is not None:
            return reason
        self._streamed.arrived(self.view.time)
        target = self._at(p)
        if facing.heading is not None:
            target = target._replace(heading=facing.heading)
        if self.mode is not Mode.OFFBOARD:
            self._streamed.setpoint = target
        elif not is_same_leg(self._guidance, target):
            self._guidance = fly_to(self.view, target, self.settings, self.chooser)
        return None

    def set_mode(self, mode: Mode) -> Outcome:
        """Change the mode as a ground station's mode switch does."""
        requests = {
            Mode.HOLD: self.hold,
            Mode.TAKEOFF: self.take_off,
            Mode.MISSION: self.start_mission,
            Mode.LAND: self.land,
            Mode.RTL: self.return_to_launch,
            Mode.OFFBOARD: self._start_offboard,
            Mode.POSCTL: self._start_manual,
        }
        request = requests.get(mode)
        if request is None:
            return self._refuse(DENIED, f"Mode {mode.name} is not available on this vehicle")
        return request()

    def _start_offboard(self) -> Outcome:
        if self._streamed.is_stale(self.view.time, self.settings):
            return self._refuse(REJECTED, "OFFBOARD refused: no set-points are arriving")
        if not self.armed:
            return self._refuse(REJECTED, "OFFBOARD refused: not armed")
        offboard = self._streamed.setpoint
        moving = offboard.route is not None or offboard.attitude is not None
        leg = fly_to(self.view, offboard, self.settings, self.chooser)
        self._enter(Mode.OFFBOARD, Hold(offboard) if moving else leg)
        self.flying = True
        return Outcome(ACCEPTED)

    # Sticks

    def take_sticks(self, sticks: Sticks) -> None:
        """Take a pilot's sticks, flown in POSCTL."""
        self._streamed.take_sticks(sticks, self.view.time)

    def _start_manual(self) -> Outcome:
        if self._streamed.sticks(self.view.time, self.settings) is None:
            return self._refuse(REJECTED, "POSCTL refused: no sticks are moving: MANUAL_CONTROL is not arriving")
        if not self.flying:
            return self._refuse(REJECTED, "POSCTL refused: not in the air")
        self._enter(Mode.POSCTL, Hold(self._at(self._stop_point())))
        self._streamed.start_moving(self.view.time)
        return Outcome(ACCEPTED)

    def _follow_sticks(self, guidance: Guidance) -> Guidance:
        sticks = self._streamed.sticks(self.view.time, self.settings)
        if sticks is None:
            self.say(mavlink.MAV_SEVERITY_WARNING, "Sticks stopped: holding")
            self._hold_here()
        elif not self.view.forward:  # on the wing it is still standing up
            self._guidance = Hold(self._streamed.follow(sticks, self.setpoint, self.view, self.settings))
        return self._guidance or guidance

    # Missions

    def load_fence(self, fence: Fence) -> None:
        """Replace the fence; the parameters decide whether it is in force."""
        self._fence = fence
        self._bound()

    def load_rally(self, points: tuple[Vector, ...]) -> None:
        """Replace the rally points, world NWU [m]."""
        self.world = self.world._replace(rally=points)
        self._bound()

    def move(self, frame: LocalFrame, home: Vector) -> None:
        """Put the world frame elsewhere on the globe, or home elsewhere in it.

        What is under way goes on as it began, except for a return that does not land yet: it turns to the new home.

        Args:
            frame: Where the world frame is.
            home: World NWU [m].
        """
        self.world = self.world._replace(frame=frame, home=home)
        self._bound()
        if self.mode is Mode.RTL and not self.landing:
            self._enter(Mode.RTL, self._way_home(self.view))

    def _bound(self) -> None:
        """Put fence, rally points and home in force, for a mission under way as well."""
        s = self.settings
        bounds = self._fence._replace(reach=s.fence_reach, ceiling=s.fence_ceiling, home=self.world.home)
        self.world = self.world._replace(fence=bounds if s.fence_action else Fence())
        if self.mission is not None:
            self.mission.world = self.world

    def load_mission(self, items: Sequence[MissionItem]) -> None:
        """Replace the mission by an already validated one; flying the old one ends in a hold."""
        if self.mode is Mode.MISSION:
            self._hold_here()
        self.mission = MissionRunner(tuple(items), self.world, self.settings, self.chooser) if items else None

    def start_mission(self, first: int | None = None) -> Outcome:
        """Fly the mission from an item, or from the current one (from the start if it was complete)."""
        mission = self.mission
        if mission is None:
            return self._refuse(REJECTED, "Mission refused: none is loaded")
        if not self.armed:
            return self._refuse(REJECTED, "Mission refused: not armed")
        if outside := out_of_bounds(mission.items, self.world):
            return self._refuse(DENIED, f"Mission denied: {outside}")
        if first is not None and not 0 <= first < len(mission.items):
            return self._refuse(DENIED, f"Mission denied: no item {first} among {len(mission.items)}")
        if first is not None or mission.finished:
            mission.jump_to(first or 0)
        mission.interrupt()
        self._enter(Mode.MISSION, None)
        self.flying = True
        return Outcome(ACCEPTED)

    def set_current_item(self, seq: int) -> Outcome:
        """Make an item the current one, flying or not."""
        if self.mission is None or not 0 <= seq < len(self.mission.items):
            count = len(self.mission.items) if self.mission else 0
            return self._refuse(DENIED, f"No mission item {seq} among {count}")
        self.mission.jump_to(seq)
        return Outcome(ACCEPTED)

    # Helpers

    def say(self, severity: int, text: str) -> None:
        """Queue a line for the pilot."""
        self._notices.append(Notice(severity, text))

    def apply(self, settings: Settings) -> None:
        """Take changed settings; a mission under way flies its next items by them."""
        self.settings = settings
        self._bound()
        if self.mission is not None:
            self.mission.settings = settings

    def _refuse(self, result: int, text: str) -> Outcome:
        self.say(mavlink.MAV_SEVERITY_WARNING, text)
        return Outcome(result, text)

    def _refuse_rim(self, centre: Vector, radius: float) -> str | None:
        rim = [(centre[0] + radius * x, centre[1] + radius * y, centre[2]) for x, y in COMPASS]
        return next(filter(None, map(self._refuse_point, rim)), None)

    def _refuse_point(self, p: Vector) -> str | None:
        if not all(map(math.isfinite, p)):
            return f"position {p} is not a number"
        return self.world.refuse(p)

    def _enter(self, mode: Mode, guidance: Guidance | None) -> None:
        superseded = self.under_way
        if superseded is not None:
            superseded.fail(f"{mode.name} came between" if self.flying else "the flight is over")
            self._end(superseded)
            if self.mode is Mode.MISSION and self.mission is not None:
                self.mission.transition(superseded.before)
        self.mode, self._guidance = mode, guidance

    def _at(self, p: Vector) -> Setpoint:
        return Setpoint(p, self.setpoint.heading, self.settings.hover_speed)

    def _stop_point(self) -> Vector:
        # Where the vehicle can stop, not where it is now, and no lower than the floor.
        p, v = self.view.p, self.view.v
        level = math.hypot(v[0], v[1])
        ahead = self.view.stopping / level if self.view.forward and level > 1.0 else 0.5
        return (p[0] + ahead * v[0], p[1] + ahead * v[1], max(p[2] + 0.5 * v[2], FLOOR))

    def _land_here(self) -> None:
        here = self._at(self._stop_point())
        first = (Stop(here),) if self.view.forward else ()  # a set-point that sinks meanwhile would run away
        self._enter(Mode.LAND, Steps((*first, land_at(here, self.settings.descent_rate))))

    def _hold_here(self) -> None:
        self._enter(Mode.HOLD, Hold(self._at(self._stop_point())) if self.flying else None)

    def _stop_motors(self, text: str) -> None:
        self.armed = self.flying = False
        self._landed_at = None
        self.say(mavlink.MAV_SEVERITY_INFO, text)
        self._enter(Mode.HOLD, None)
