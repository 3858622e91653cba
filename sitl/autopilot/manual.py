"""Manual flight: a pilot's sticks as a velocity of the hover, flown in POSCTL while they keep arriving.

Forward and to the right are those of the heading, the belly's side in hover. Centred sticks stop the vehicle.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.names import Mode
from sitl.autopilot.answers import ACCEPTED, REJECTED, Answer
from sitl.autopilot.flight_state import FlightState
from sitl.control.reference import Point, at
from sitl.guidance.manoeuvres import Hold
from sitl.guidance.setpoints import HeadingSetpoint, MovingReference
from sitl.guidance.view import MAX_HOVER_CLIMB, MAX_HOVER_DESCENT

NO_STICKS = "no MANUAL_CONTROL is arriving"
LIFTING_STICK = 0.3  # of the stick that climbs: beyond it a vehicle on the ground takes off
STICK_TURN_RATE = math.radians(30.0)  # at full stick [rad/s]


class Sticks(NamedTuple):
    """Stick positions, each -1..1."""

    forward: float = 0.0
    right: float = 0.0
    up: float = 0.0
    clockwise: float = 0.0

    def velocity(self, heading: float, speed: float, climb: float, descent: float) -> Point:
        """Wanted velocity, world NWU [m/s].

        Args:
            heading: Of the vehicle [rad].
            speed: Level speed at full stick [m/s].
            climb: Upwards at full stick [m/s].
            descent: Downwards at full stick [m/s].
        """
        c, s = math.cos(heading), math.sin(heading)
        length = max(1.0, math.hypot(self.forward, self.right))  # both sticks at their ends are no faster
        ahead, right = speed * self.forward / length, speed * self.right / length
        vertical = self.up * (climb if self.up > 0.0 else descent)
        return (ahead * c + right * s, ahead * s - right * c, vertical)


class ManualRequests:
    """Takes sticks and starts POSCTL.

    Args:
        flight: The flight that the sticks are for.
        moving: The reference that the sticks move.
    """

    def __init__(self, flight: FlightState, moving: MovingReference) -> None:
        self._flight, self._moving = flight, moving
        self._last: tuple[float, Sticks] | None = None  # when they arrived [s]

    @property
    def problem(self) -> str:
        """The reason why a flight by the sticks cannot begin; empty if it can."""
        sticks = self._sticks()
        if sticks is None:
            return NO_STICKS
        return "the climbing stick is up" if sticks.up > LIFTING_STICK else ""

    @property
    def silence(self) -> float | None:
        """Since the last sticks arrived [s]; None: none ever did."""
        return None if self._last is None else self._flight.view.time - self._last[0]

    @property
    def velocity(self) -> Point:
        """Velocity that fresh sticks ask for, world NWU [m/s]; zero without any."""
        sticks, view = self._sticks() or Sticks(), self._flight.view
        return sticks.velocity(view.heading, self._flight.settings.hover_speed, MAX_HOVER_CLIMB, MAX_HOVER_DESCENT)

    def take_sticks(self, sticks: Sticks) -> None:
        """Take a pilot's sticks."""
        self._last = (self._flight.view.time, sticks)

    def start(self) -> Answer:
        """Enter POSCTL; refused unless sticks arrive. On the ground it waits for the climbing stick."""
        flight = self._flight
        if self._sticks() is None:
            return flight.refuse(REJECTED, f"POSCTL refused: {NO_STICKS}")
        if flight.flying:
            self._begin()
        elif self.problem:
            return flight.refuse(REJECTED, f"POSCTL refused: {self.problem}")
        else:
            flight.enter(Mode.POSCTL, None)
        return Answer(ACCEPTED)

    def stand(self) -> None:
        """One tick in POSCTL on the ground, armed: the climbing stick lifts off; without sticks it is left."""
        flight, sticks = self._flight, self._sticks()
        if sticks is None:
            flight.say(mavlink.MAV_SEVERITY_WARNING, "Sticks stopped: holding")
            flight.hold_here()
        elif sticks.up > LIFTING_STICK:
            flight.flying = True
            self._begin()

    def _begin(self) -> None:
        flight = self._flight
        flight.enter(Mode.POSCTL, Hold(flight.hover_reference(flight.stop_point())))
        self._moving.restart(flight.view.time)

    def update(self) -> None:
        """One tick in POSCTL: move the reference by the sticks, or hold when they have stopped."""
        flight, sticks = self._flight, self._sticks()
        if sticks is None:
            flight.say(mavlink.MAV_SEVERITY_WARNING, "Sticks stopped: holding")
            flight.hold_here()
        elif not flight.view.forward:  # in a back transition, sticks have to wait for the hover
            self._follow(sticks)

    def _follow(self, sticks: Sticks) -> None:
        flight, settings, last = self._flight, self._flight.settings, self._flight.reference
        v = sticks.velocity(last.heading, settings.hover_speed, MAX_HOVER_CLIMB, MAX_HOVER_DESCENT)
        turn = STICK_TURN_RATE * sticks.clockwise * self._moving.elapsed(flight.view.time)
        heading = HeadingSetpoint(last.heading - turn)
        moved = self._moving.move(v, heading, last, flight.view, settings.setpoint_timeout)
        flight.manoeuvre = Hold(at(moved, flight.world.arena.clamped(moved.position)))

    def _sticks(self) -> Sticks | None:
        """The pilot's sticks, None when they have stopped or never came."""
        if self._last is None or self._flight.view.time - self._last[0] > self._flight.settings.stick_timeout:
            return None
        return self._last[1]
