"""Modes, arming and guided flight: the discrete decisions of the vehicle, without a clock or a wire.

The autopilot ticks at a fixed rate on simulated time. It answers every request with an
:class:`Outcome` (a MAV_RESULT and words for the pilot) and leaves its state unchanged when it refuses.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.modes import Mode
from protocol.plans.mission import MissionItem
from sitl.autopilot import arming
from sitl.autopilot.guidance import FlyTo, Guidance, Hold, Ramp, Setpoint, Vector, View, land_at, with_speed
from sitl.autopilot.mission import MissionRunner, World, return_home
from sitl.autopilot.settings import Settings

ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
REJECTED = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
DENIED = mavlink.MAV_RESULT_DENIED
UNSUPPORTED = mavlink.MAV_RESULT_UNSUPPORTED

FLOOR = 1.0  # a hold asked for nearer the ground than this is flown here [m]


class Outcome(NamedTuple):
    """The answer to a request."""

    result: int  # MAV_RESULT
    text: str = ""  # why, for the pilot; empty when there is nothing to say

    @property
    def accepted(self) -> bool:
        """Whether the request was carried out."""
        return bool(self.result == ACCEPTED)


class Notice(NamedTuple):
    """A line for the pilot."""

    severity: int  # MAV_SEVERITY
    text: str


class Autopilot:
    """Holds mode, arming state, mission and set-point.

    After any call, read ``notices()`` and ``reached()``; each hands over what is new.
    """

    def __init__(self, world: World, settings: Settings, heading: float = 0.0) -> None:
        self.world = world
        self.settings = settings
        self.mode = Mode.HOLD
        self.armed = False
        self.flying = False  # asked to be in the air: the supervisor leaves the ground on this
        self.mission: MissionRunner | None = None
        self.view = View(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), heading, 0.0, True, 1.0)
        self.setpoint = Setpoint((0.0, 0.0, 0.0), heading, settings.hover_speed)
        self._guidance: Guidance | None = None
        self._offboard = self.setpoint  # the last one streamed, for when OFFBOARD starts
        self._landed_at: float | None = None
        self._offboard_at: float | None = None
        self._notices: list[Notice] = []
        self._reached: list[int] = []

    # What the wire reads

    def notices(self) -> list[Notice]:
        """Lines for the pilot since the last call."""
        said, self._notices = self._notices, []
        return said

    def reached(self) -> list[int]:
        """Mission items done since the last call."""
        done, self._reached = self._reached, []
        return done

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
        self.view = view
        if not self.flying:
            self._rest()
        elif self.mode is Mode.MISSION and self.mission is not None:
            self._fly_mission(self.mission)
        elif self._guidance is not None:
            self._fly_guidance(self._guidance)
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
        if self.mode is Mode.OFFBOARD and self._offboard_is_stale():
            self.say(mavlink.MAV_SEVERITY_WARNING, "Set-points stopped: holding")
            self._hold_here()
            return
        self.setpoint = guidance.update(self.view)
        if self.mode is Mode.TAKEOFF and guidance.done(self.view):
            self.say(mavlink.MAV_SEVERITY_INFO, "Take-off complete: holding")
            self._enter(Mode.HOLD, Hold(self.setpoint))

    def _offboard_is_stale(self) -> bool:
        at = self._offboard_at
        return at is None or self.view.time - at > self.settings.setpoint_timeout

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
        return arming.reasons(self.view, self.settings)

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
        """Climb straight up to a height above the origin [m]; None takes the set take-off altitude."""
        target = self.settings.takeoff_altitude if height is None else height
        here = self.view.p
        if not self.armed:
            return self._refuse(REJECTED, "Take-off refused: not armed")
        if not self.view.landed:
            return self._refuse(REJECTED, "Take-off refused: already in the air")
        point = (here[0], here[1], target)
        reason = self.world.arena.refuse(point)
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
        self._enter(Mode.LAND, land_at(self._at(self._stop_point()), self.settings.descent_rate))
        return Outcome(ACCEPTED)

    def return_to_launch(self) -> Outcome:
        """Climb to the return altitude, fly over the origin and land."""
        if not self.flying:
            return self._refuse(REJECTED, "Return refused: not in the air")
        self._enter(Mode.RTL, return_home(self.view, self.setpoint, self.settings))
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
        self._enter(Mode.HOLD, FlyTo(setpoint, self.settings.acceptance))
        return Outcome(ACCEPTED)

    def change_speed(self, speed: float) -> Outcome:
        """Limit the horizontal speed of the manoeuvre under way, or of the mission [m/s]."""
        if self.mode is Mode.MISSION and self.mission is not None:
            self.mission.change_speed(speed)
        elif isinstance(self._guidance, FlyTo | Hold):
            self._guidance = with_speed(self._guidance, speed)
        else:
            return self._refuse(REJECTED, "Speed unchanged: not flying to a point")
        return Outcome(ACCEPTED)

    def set_offboard_setpoint(self, p: Vector, heading: float | None) -> str | None:
        """Take one streamed position set-point (flown in OFFBOARD). Returns why not, or None."""
        reason = self._refuse_point(p)
        if reason is not None:
            return reason
        self._offboard_at = self.view.time
        target = self._at(p)
        if heading is not None:
            target = target._replace(heading=heading)
        if self.mode is Mode.OFFBOARD:
            self._guidance = Hold(target)
        else:
            self._offboard = target
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
        }
        request = requests.get(mode)
        if request is None:
            return self._refuse(DENIED, f"Mode {mode.name} is not available on this vehicle")
        return request()

    def _start_offboard(self) -> Outcome:
        if self._offboard_is_stale():
            return self._refuse(REJECTED, "OFFBOARD refused: no set-points are arriving")
        if not self.armed:
            return self._refuse(REJECTED, "OFFBOARD refused: not armed")
        self._enter(Mode.OFFBOARD, Hold(self._offboard))
        self.flying = True
        return Outcome(ACCEPTED)

    # Missions

    def load_mission(self, items: Sequence[MissionItem]) -> None:
        """Replace the mission by an already validated one; flying the old one ends in a hold."""
        if self.mode is Mode.MISSION:
            self._hold_here()
        self.mission = MissionRunner(tuple(items), self.world, self.settings) if items else None

    def start_mission(self, first: int | None = None) -> Outcome:
        """Fly the mission from an item, or from the current one (from the start if it was complete)."""
        mission = self.mission
        if mission is None:
            return self._refuse(REJECTED, "Mission refused: none is loaded")
        if not self.armed:
            return self._refuse(REJECTED, "Mission refused: not armed")
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
        if self.mission is not None:
            self.mission.settings = settings

    def _refuse(self, result: int, text: str) -> Outcome:
        self.say(mavlink.MAV_SEVERITY_WARNING, text)
        return Outcome(result, text)

    def _refuse_point(self, p: Vector) -> str | None:
        if not all(map(math.isfinite, p)):
            return f"position {p} is not a number"
        return self.world.arena.refuse(p)

    def _enter(self, mode: Mode, guidance: Guidance | None) -> None:
        self.mode, self._guidance = mode, guidance

    def _at(self, p: Vector) -> Setpoint:
        return Setpoint(p, self.setpoint.heading, self.settings.hover_speed)

    def _stop_point(self) -> Vector:
        # Where the vehicle can stop, not where it is now: half a second ahead, no lower than the floor.
        p, v = self.view.p, self.view.v
        return (p[0] + 0.5 * v[0], p[1] + 0.5 * v[1], max(p[2] + 0.5 * v[2], FLOOR))

    def _hold_here(self) -> None:
        self._enter(Mode.HOLD, Hold(self._at(self._stop_point())) if self.flying else None)

    def _stop_motors(self, text: str) -> None:
        self.armed = self.flying = False
        self._landed_at = None
        self.say(mavlink.MAV_SEVERITY_INFO, text)
        self._enter(Mode.HOLD, None)
