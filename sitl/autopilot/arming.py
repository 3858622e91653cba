"""Arming: its checks, its refusals, what was chosen before it and waits for it, and its end after a landing."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.names import Mode
from sitl.autopilot.answers import ACCEPTED, DENIED, REJECTED, Answer
from sitl.autopilot.failsafes import Failsafes
from sitl.autopilot.flight_state import FlightState
from sitl.autopilot.settings import Settings
from sitl.autopilot.watches import missing_links
from sitl.control.reference import Point
from sitl.guidance.view import VehicleView

# Arming: refused with its failed checks, awaited by what was chosen before it, ended after a landing.

# The checks before arming, and what is said of a vehicle that can fly no more.


MAX_STANDING_TILT = math.radians(15.0)  # the tail stands flat; more means it has tipped over
MAX_STANDING_SPEED = 0.4  # satellites alone make it look like 0.25 [m/s]


def refuse_arming(view: VehicleView, settings: Settings) -> list[str]:
    """The reason why a vehicle in this state may not be armed; empty if it may."""
    if view.crash is not None:
        return [f"crashed {_into(view)}at {view.crash.speed:.1f} m/s: a reboot stands it up again"]
    if not view.aligned:  # nothing else is known yet
        return list(view.awaited)
    reasons = list(view.awaited)
    if not view.landed:
        reasons.append("not on the ground")
    if view.tilt > MAX_STANDING_TILT:
        reasons.append(f"not upright ({math.degrees(view.tilt):.0f} deg from the vertical)")
    if math.hypot(*view.v) > MAX_STANDING_SPEED:
        reasons.append(f"moving at {math.hypot(*view.v):.1f} m/s")
    reasons += [f"motor {number} has failed" for number in view.failed_motors]
    if view.battery_remaining < settings.battery_low:
        reasons.append(f"battery at {100 * view.battery_remaining:.0f} %")
    return reasons


def crash_text(view: VehicleView, home: Point) -> str:
    """Text of a crash: its speed, the thing hit and the place; empty without a crash. ``home`` is in world NWU [m]."""
    if view.crash is None:
        return ""
    place = view.crash.place
    north, west = place.x - home[0], place.y - home[1]
    along, across = "north" if north >= 0.0 else "south", "west" if west >= 0.0 else "east"
    hit = f"Crashed {_into(view)}at {view.crash.speed:.1f} m/s"
    return f"{hit}, {abs(north):.0f} m {along} {abs(west):.0f} m {across} of home"


def _into(view: VehicleView) -> str:
    return f"into {view.touched} " if view.touched else ""


ARMING_TIMEOUT = 20.0  # for a take-off or a mission that was chosen before arming [s]
# Modes that can be chosen before arming, and begin with it.
MODE_NAMES = {Mode.TAKEOFF: "Take-off", Mode.MISSION: "Mission", Mode.OFFBOARD: "Offboard"}
MODES_IN_THE_AIR = frozenset({Mode.RTL, Mode.LAND})  # of a disarmed vehicle: chosen, but not armed in


ROCKING_TIME = 1.5  # after the touch: what falls over on landing does so within it [s]
ALIGNMENT_TEXTS = {False: "Navigation: aligning, keep still", True: "Navigation: aligned"}
LYING_TILT = math.radians(60.0)  # a vehicle that leans so far does not stand up again


class _Waiting(NamedTuple):
    """A request that waits for arming: QGroundControl sends take-off or mission first, then arms, as for PX4."""

    begin: Callable[[], Answer]
    until: float  # [s]
    problem: Callable[[], str | None]  # why it would be denied now: nothing is armed for it


class Arming:
    """Starts and stops the motors of a flight."""

    def __init__(self, flight: FlightState, failsafes: Failsafes) -> None:
        self._flight, self._failsafes = flight, failsafes
        self._waiting: _Waiting | None = None
        self._landed_at: float | None = None
        self._touched_at: float | None = None  # None: how the last landing ended has been said
        self._was_aligned = True
        self.stick_problem: Callable[[], str] = lambda: ""  # why sticks cannot begin a flight, or nothing
        flight.before_change(self._forget_waiting)

    def failed_checks(self) -> list[str]:
        """Reasons why the vehicle may not be armed now; empty if it may."""
        flight = self._flight
        outside = flight.world.fence.breach([flight.view.p])
        if flight.terminated:
            return [f"flight terminated ({flight.terminated}): a reboot ends that"]
        denied = None if self._waiting is None else self._waiting.problem()
        links = missing_links(self._failsafes.silence, flight.settings)
        reasons = refuse_arming(flight.view, flight.settings) + links + ([] if outside is None else [outside.text])
        if flight.mode in MODES_IN_THE_AIR and not flight.armed:
            reasons.append(f"mode {flight.mode.name} ends on the ground: choose another")
        elif flight.mode is Mode.POSCTL and not flight.armed and (problem := self.stick_problem()):
            reasons.append(f"mode POSCTL: {problem}")
        return reasons if denied is None else [*reasons, f"{MODE_NAMES[flight.mode].lower()} denied: {denied}"]

    def arm(self, *, force: bool = False) -> Answer:
        """Start the motors at idle. Refused with the failed checks unless forced.

        A vehicle whose flight is over or that is not aligned is not armed by force either.
        """
        flight = self._flight
        if flight.armed:
            return Answer(ACCEPTED)
        is_over = flight.view.crash is not None or flight.terminated
        must_pass = not force or is_over or not flight.view.aligned
        reasons = self.failed_checks() if must_pass else []
        if reasons:
            return flight.refuse(REJECTED, f"Arming refused: {'; '.join(reasons)}")
        flight.armed = True
        self._landed_at = self._touched_at = None
        flight.say(mavlink.MAV_SEVERITY_INFO, "Armed by force" if force else "Armed")
        if self._waiting is not None and not self._waiting.begin().accepted:
            flight.enter(Mode.HOLD, None)
        return Answer(ACCEPTED)

    def choose(self, mode: Mode) -> Answer:
        """Enter a mode on the ground, disarmed; nothing begins with it."""
        self._flight.enter(mode, None)
        return Answer(ACCEPTED)

    def disarm(self, *, force: bool = False) -> Answer:
        """Stop the motors. Denied in the air unless forced."""
        flight = self._flight
        if not flight.armed:
            if self._waiting is not None:
                flight.enter(Mode.HOLD, None)
            return Answer(ACCEPTED)
        is_aloft = not flight.view.landed and flight.has_risen
        if is_aloft and not force:
            return flight.refuse(DENIED, "Disarming denied: in the air")
        self._stop_motors("Motors stopped in the air" if is_aloft else "Disarmed")
        return Answer(ACCEPTED)

    def wait_for_arming(
        self, mode: Mode, begin: Callable[[], Answer], problem: Callable[[], str | None] = lambda: None
    ) -> Answer:
        """Enter a mode whose manoeuvre begins when the vehicle is armed.

        Args:
            mode: Which.
            begin: Begins its manoeuvre.
            problem: The reason why that would be denied now, so that the vehicle is not armed for it; None without one.
        """
        flight = self._flight
        flight.enter(mode, None)
        self._waiting = _Waiting(begin, flight.view.time + ARMING_TIMEOUT, problem)
        flight.say(mavlink.MAV_SEVERITY_INFO, f"{MODE_NAMES[mode]} waits {ARMING_TIMEOUT:g} s for arming")
        return Answer(ACCEPTED)

    def touched_down(self) -> None:
        """The vehicle touched the ground: the time until it disarms begins, and it may still fall over."""
        self._landed_at = self._touched_at = self._flight.view.time

    def fell_over(self, text: str) -> None:
        """The vehicle lies on the ground: stop its motors at once, and say why."""
        self._stop_motors(text, mavlink.MAV_SEVERITY_CRITICAL)

    def give_up_take_off(self, reason: str) -> None:
        """The vehicle does not rise: stop its motors, and say why."""
        self._stop_motors(f"Take-off given up: {reason}", mavlink.MAV_SEVERITY_ERROR)

    def update(self) -> None:
        """One tick on the ground: see how a landing ended, end a wait that took too long, disarm after a landing."""
        flight, now = self._flight, self._flight.view.time
        self._report_alignment()
        self._judge_landing()
        if self._waiting is not None and now > self._waiting.until:
            flight.say(mavlink.MAV_SEVERITY_WARNING, f"{MODE_NAMES[flight.mode]} cancelled: not armed in time")
            flight.enter(Mode.HOLD, None)
        if flight.armed and self._landed_at is not None and now - self._landed_at >= flight.settings.disarm_after:
            self._stop_motors("Disarmed after landing")

    def _report_alignment(self) -> None:
        """Say when navigation begins to align, and when it is done."""
        flight = self._flight
        if flight.view.aligned != self._was_aligned:
            self._was_aligned = flight.view.aligned
            flight.say(mavlink.MAV_SEVERITY_INFO, ALIGNMENT_TEXTS[flight.view.aligned])

    def _judge_landing(self) -> None:
        """Say whether the vehicle stands, or has tipped over."""
        flight, view = self._flight, self._flight.view
        if self._touched_at is None:
            return
        is_over = view.time - self._touched_at >= ROCKING_TIME
        if view.tilt > (MAX_STANDING_TILT if is_over else LYING_TILT):
            self._touched_at = None
            self.fell_over("Tipped over on landing")
        elif is_over:
            self._touched_at = None
            flight.say(mavlink.MAV_SEVERITY_INFO, "Landed")

    def _stop_motors(self, text: str, severity: int = mavlink.MAV_SEVERITY_INFO) -> None:
        flight = self._flight
        flight.armed = flight.flying = False
        self._landed_at = None
        flight.say(severity, text)
        stands = flight.view.landed and severity == mavlink.MAV_SEVERITY_INFO
        goes_on = flight.mode is Mode.FLIGHT_PLAN and stands
        flight.enter(Mode.FLIGHT_PLAN if goes_on else Mode.HOLD, None)

    def _forget_waiting(self, mode: Mode) -> None:  # noqa: ARG002 - every change ends the wait
        self._waiting = None
