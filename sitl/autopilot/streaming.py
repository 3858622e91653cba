"""Set-points and sticks that keep coming, as requests to the autopilot: OFFBOARD and POSCTL."""

from __future__ import annotations

import math

from protocol.dialect import mavlink
from protocol.modes import Mode
from sitl.autopilot.attitude import Steer, attitude_of, refuse_attitude
from sitl.autopilot.flight import Flight
from sitl.autopilot.guidance import Guidance, Hold
from sitl.autopilot.manual import Sticks
from sitl.autopilot.mission import fly_to
from sitl.autopilot.outcome import ACCEPTED, REJECTED, Outcome
from sitl.autopilot.streamed import KEEP_FACING, Facing, is_same_leg, level_out, refuse_turn, refuse_velocity
from sitl.control.reference import AttitudeReference, Point


class Streaming(Flight):
    """What programs and pilots stream, and the modes that fly it. Each ``set_offboard`` returns why not, or None."""

    def level_out(self, v: Point) -> Point:
        """What is forward, to the left and up of the vehicle, heading alone counting, in world NWU."""
        return level_out(v, self.view.heading)

    def set_offboard_attitude(self, attitude: AttitudeReference) -> str | None:
        """Take one streamed attitude set-point (flown in OFFBOARD). Returns why not, or None."""
        reason = refuse_attitude(attitude, self.view)
        if reason is not None:
            return reason
        self._streamed.arrived(self.view.time)
        steer = Steer(attitude, self.view.time, self.settings.hover_speed)
        if self.mode is Mode.OFFBOARD:
            self._guidance = steer
        else:
            self._streamed.reference = steer.update(self.view)
        return None

    def set_offboard_acceleration(self, a: Point, facing: Facing) -> str | None:
        """Take one streamed acceleration, world NWU [m/s2], as an attitude. Returns why not, or None."""
        if self.chooser is None:
            return "acceleration set-points need an airframe"
        heading = self.reference.heading if facing.heading is None else facing.heading
        if facing.turn:
            heading = self.view.heading
        return self.set_offboard_attitude(attitude_of(a, heading, facing.turn, self.chooser.airframe))

    def set_offboard_offset(self, offset: Point, facing: Facing, *, body: bool) -> str | None:
        """Take one streamed offset from the vehicle, world NWU or along its heading [m]. Returns why not, or None."""
        if not all(map(math.isfinite, offset)):
            return f"position {offset} is not a number"
        place = self._streamed.lay(offset, body=body, view=self.view, settings=self.settings)
        return self.set_offboard_setpoint(place, facing)

    def set_offboard_velocity(self, v: Point, facing: Facing = KEEP_FACING) -> str | None:
        """Take one streamed velocity set-point, world NWU [m/s] (flown in OFFBOARD). Returns why not, or None."""
        reason = refuse_velocity(v, self.settings, self.chooser) or refuse_turn(facing)
        if reason is not None:
            return reason
        self._streamed.arrived(self.view.time)
        reference = self._streamed.velocity(v, facing, self.reference, self.view, self.settings)
        if self.mode is Mode.OFFBOARD:
            self._guidance = Hold(reference)
        else:
            self._streamed.reference = reference
        return None

    def set_offboard_setpoint(self, p: Point, facing: Facing = KEEP_FACING) -> str | None:
        """Take one streamed position set-point (flown in OFFBOARD). Returns why not, or None."""
        reason = self._refuse_point(p)
        if reason is not None:
            return reason
        self._streamed.arrived(self.view.time)
        target = self._at(p)
        if facing.heading is not None:
            target = target._replace(heading=facing.heading)
        if self.mode is not Mode.OFFBOARD:
            self._streamed.reference = target
        elif not is_same_leg(self._guidance, target):
            self._guidance = fly_to(self.view, target, self.settings, self.chooser)
        return None

    def _start_offboard(self) -> Outcome:
        if self._streamed.is_stale(self.view.time, self.settings):
            return self._refuse(REJECTED, "OFFBOARD refused: no set-points are arriving")
        if not self.armed:
            return self._refuse(REJECTED, "OFFBOARD refused: not armed")
        offboard = self._streamed.reference
        moving = offboard.forward or offboard.steered
        leg = fly_to(self.view, offboard, self.settings, self.chooser)
        self._enter(Mode.OFFBOARD, Hold(offboard) if moving else leg)
        self.flying = True
        return Outcome(ACCEPTED)

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
        elif not self.view.forward:  # in forward flight it is still on its way to the hover
            self._guidance = Hold(self._streamed.follow(sticks, self.reference, self.view, self.settings))
        return self._guidance or guidance
