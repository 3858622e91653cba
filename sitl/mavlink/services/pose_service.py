"""Poses that peers measured: handed to the navigation filter with the time at which they were measured."""

from __future__ import annotations

import math

from protocol.dialect import mavlink
from protocol.events import PoseReceived
from protocol.plans.validation import Refusal
from protocol.tools.clock_match import ClockMatch
from protocol.wire.message import Peer
from sitl.mavlink.broadcast import Broadcast
from sitl.mavlink.external_poses import ExternalPose, pose_of
from sitl.mavlink.handlers import on_event
from sitl.simulation.avionics import Navigation
from sitl.timing import PERIOD
from sitl.vehicle.aircraft import Aircraft

MAX_AGE = 1.0  # a time stamp that is older by a clock is not of that clock [s]
STAMP_LEAD = 0.02  # a stamp may be ahead of the clock by so much: the link is looked at now and then [s]
TAKE_OVER_TIME = 1.0  # a source that is silent for so long is replaced by another [s]
CLOCK_WINDOW = 1.0  # in which the flight is at least once where it should be by the link's time [s]
MIN_POSE_DEVIATION = 0.001  # nobody measures better than that [m], [rad]


class PoseService:
    """Takes poses from one source at a time.

    Args:
        aircraft: Flies on them.
        broadcast: Tells everyone why poses are refused.
    """

    def __init__(self, aircraft: Aircraft, broadcast: Broadcast) -> None:
        self._aircraft, self._broadcast = aircraft, broadcast
        self._source: Peer | None = None
        self._heard = -math.inf  # the source, on the link's time [s]
        self._clocks = ClockMatch(CLOCK_WINDOW)  # of the flight, as the link's time sees it

    @on_event(PoseReceived)
    def take_pose(self, event: PoseReceived, now: float) -> None:
        """A peer sends where the vehicle is."""
        in_arena = self._aircraft.vehicle.avionics.navigation is Navigation.MOCAP
        pose = pose_of(event.message, in_arena=in_arena)
        refusal = self._refuse_source(event.peer, now)
        if not refusal:
            refusal = pose.text if isinstance(pose, Refusal) else self._hand_over(pose, now)
        if refusal:
            self._broadcast.complain(f"{event.message.get_type()} refused: {refusal}")

    def _refuse_source(self, peer: Peer, now: float) -> str:
        if not self._aircraft.vehicle.avionics.is_sensed:
            return "the vehicle flies on the exact state"
        if peer.component == mavlink.MAV_COMP_ID_AUTOPILOT1:
            return "it is of another vehicle"
        if self._source not in {None, peer} and now - self._heard < TAKE_OVER_TIME:
            return "poses come from another source"
        self._source, self._heard = peer, now
        return ""

    def _hand_over(self, pose: ExternalPose, now: float) -> str:
        """Give a pose to the filter; why not, if it cannot use it."""
        settings = self._aircraft.configuration.settings
        return self._aircraft.vehicle.avionics.receive_pose(
            pose.position,
            pose.attitude,
            _variance(pose.position_variance, settings.pose_position_noise),
            _variance(pose.attitude_variance, settings.pose_attitude_noise),
            age=round(self._age(pose.time_stamp, now) / PERIOD),
            period=self._aircraft.vehicle.periods,
        )

    def _age(self, stamp: float, now: float) -> float:
        """Age of a pose since it was measured, by the clock that its stamp is of [s].

        That is the vehicle's time since boot, or the link's, which TIMESYNC tells. A stamp of neither tells nothing.
        The vehicle flies in steps, the link's time passes between them: what counts is when a step has just ended.
        """
        self._clocks.hear(time := self._aircraft.vehicle.time, now)
        for flown in (stamp, self._clocks.theirs(stamp)):
            if -STAMP_LEAD <= time - flown < MAX_AGE:
                return max(time - flown, 0.0)
        return 1e-3 * self._aircraft.configuration.settings.pose_delay


def _variance(told: float | None, assumed: float) -> float:
    """Variance as the sender tells it, or as the settings assume it."""
    return max(assumed**2 if told is None else told, MIN_POSE_DEVIATION**2)
