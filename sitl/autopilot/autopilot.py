"""Modes, arming and guided flight: the discrete decisions of the vehicle, without a clock or a wire.

The autopilot ticks at a fixed rate on simulated time. It answers every request with an
:class:`Outcome` (a MAV_RESULT and words for the pilot) and leaves its state unchanged when it refuses.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.modes import Mode
from protocol.plans.mission import MissionItem
from sitl.autopilot import arming
from sitl.autopilot.alarm import DOING, Action
from sitl.autopilot.attitude import Steer, lost
from sitl.autopilot.failsafe import OFFBOARD_ACTIONS
from sitl.autopilot.fence import Fence
from sitl.autopilot.flight import ARM_WITHIN, Awaiting
from sitl.autopilot.guidance import Guidance, Hold, Ramp, Stop, View
from sitl.autopilot.guidance import Sequence as Steps
from sitl.autopilot.link_watch import missing
from sitl.autopilot.mission import MissionRunner, fly_to, return_home
from sitl.autopilot.mission_items import out_of_bounds
from sitl.autopilot.outcome import ACCEPTED, DENIED, REJECTED, Outcome
from sitl.autopilot.settings import Settings
from sitl.autopilot.streaming import Streaming
from sitl.autopilot.wing import WingRequests
from sitl.control.reference import Point, Reference, hover_at
from sitl.prediction.mode_choice import Decision

AWAITED = {Mode.TAKEOFF: "Take-off", Mode.MISSION: "Mission"}  # what can be chosen before arming


class Autopilot(Streaming, WingRequests):
    """Ticks, arms, takes off, lands, returns, flies missions, and does what its failsafes ask for.

    After any call, read ``notices()`` and ``reached()``; each hands over what is new.
    """

    # What the wire reads

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

    def update(self, view: View) -> Reference:
        """Advance the guidance by one autopilot tick and give the reference of the laws.

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
        return self.reference

    def _rest(self) -> None:
        self.reference = hover_at(self.view.p, self.view.heading, self.settings.hover_speed)
        if self._awaiting is not None and self.view.time > self._awaiting.until:
            self.say(mavlink.MAV_SEVERITY_WARNING, f"{AWAITED[self.mode]} not begun: nobody armed")
            self._enter(Mode.HOLD, None)
        if not self.armed or self._landed_at is None:
            return
        if self.view.time - self._landed_at >= self.settings.disarm_after:
            self._stop_motors("Disarmed after landing")

    def _fly_mission(self, mission: MissionRunner) -> None:
        self.reference = mission.update(self.view)
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
        self.reference = guidance.update(self.view)
        if self.mode is Mode.TAKEOFF and guidance.done(self.view):
            self.say(mavlink.MAV_SEVERITY_INFO, "Take-off complete: holding")
            self._enter(Mode.HOLD, Hold(self.reference))

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
            stop: Whether a vehicle in forward flight stops before it turns elsewhere.
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
        view = self.view._replace(p=here.position, v=(0.0, 0.0, 0.0), forward=False) if first else self.view
        self._enter(Mode.RTL, Steps((*first, *self._way_home(view).steps)))

    def _way_home(self, view: View) -> Steps:
        to = self.world.safe_point(view.p, self.settings.return_altitude)
        return return_home(view, self.reference, self.settings, to, self.chooser)

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
        if self._awaiting is not None:
            self._awaiting.begin()
        return Outcome(ACCEPTED)

    def disarm(self, *, force: bool = False) -> Outcome:
        """Stop the motors. Denied in the air unless forced."""
        if not self.armed:
            if self._awaiting is not None:
                self._enter(Mode.HOLD, None)
            return Outcome(ACCEPTED)
        if not self.view.landed and not force:
            return self._refuse(DENIED, "Disarming denied: in the air")
        self._stop_motors("Motors stopped in the air" if not self.view.landed else "Disarmed")
        return Outcome(ACCEPTED)

    def take_off(self, height: float | None = None) -> Outcome:
        """Climb straight up to a height above home [m]; None takes the set take-off altitude."""
        target = self.world.up(self.settings.takeoff_altitude if height is None else height, above_sea=False)
        here = self.view.p
        if not self.view.landed:
            return self._refuse(REJECTED, "Take-off refused: already in the air")
        point = (here[0], here[1], target)
        reason = self.world.refuse(point)
        if reason is None and target < here[2] + 0.5:
            reason = f"{target:.1f} m is not above the ground"
        if reason is not None:
            return self._refuse(DENIED, f"Take-off denied: {reason}")
        if not self.armed:
            return self._await_arming(Mode.TAKEOFF, lambda: self.take_off(height))
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

    def go_to(self, p: Point, heading: float | None = None, speed: float | None = None) -> Outcome:
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
        reference = hover_at(
            p,
            self.reference.heading if heading is None else heading,
            self.settings.hover_speed if speed is None else speed,
        )
        self._enter(Mode.HOLD, fly_to(self.view, reference, self.settings, self.chooser))
        return Outcome(ACCEPTED)

    def set_mode(self, mode: Mode) -> Outcome:
        """Change the mode as a ground station's mode switch does."""
        requests = {
            Mode.HOLD: self.hold,
            Mode.TAKEOFF: self.take_off,
            Mode.MISSION: self.start_mission if self.armed else self._choose_mission,
            Mode.LAND: self.land,
            Mode.RTL: self.return_to_launch,
            Mode.OFFBOARD: self._start_offboard,
            Mode.POSCTL: self._start_manual,
        }
        request = requests.get(mode)
        if request is None:
            return self._refuse(DENIED, f"Mode {mode.name} is not available on this vehicle")
        return request()

    def _choose_mission(self) -> Outcome:
        """The mission mode before arming, which then begins it."""
        if self.mission is None:
            return self._refuse(REJECTED, "Mission refused: none is loaded")
        if outside := out_of_bounds(self.mission.items, self.world):
            return self._refuse(DENIED, f"Mission denied: {outside}")
        return self._await_arming(Mode.MISSION, self.start_mission)

    def _await_arming(self, mode: Mode, begin: Callable[[], Outcome]) -> Outcome:
        self._enter(mode, None)
        self._awaiting = Awaiting(begin, self.view.time + ARM_WITHIN)
        self.say(mavlink.MAV_SEVERITY_INFO, f"{AWAITED[mode]} waits {ARM_WITHIN:g} s to be armed")
        return Outcome(ACCEPTED)

    # Missions

    def load_fence(self, fence: Fence) -> None:
        """Replace the fence; the parameters decide whether it is in force."""
        self._fence = fence
        self._bound()

    def load_rally(self, points: tuple[Point, ...]) -> None:
        """Replace the rally points, world NWU [m]."""
        self.world = self.world._replace(rally=points)
        self._bound()

    def move(self, frame: LocalFrame, home: Point) -> None:
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

    def apply(self, settings: Settings) -> None:
        """Take changed settings; a mission under way flies its next items by them."""
        self.settings = settings
        self._bound()
        if self.mission is not None:
            self.mission.settings = settings

    def _stop_motors(self, text: str) -> None:
        self.armed = self.flying = False
        self._landed_at = None
        self.say(mavlink.MAV_SEVERITY_INFO, text)
        self._enter(Mode.HOLD, None)
