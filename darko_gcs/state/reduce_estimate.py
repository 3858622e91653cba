"""Folds into the snapshot what tells how good the vehicle's estimate is: its own doubts, and the truth of a simulation.

https://mavlink.io/en/messages/common.html#ODOMETRY and #ESTIMATOR_STATUS
"""

from __future__ import annotations

import math

from darko_gcs.state.message_handlers import HandlerTable
from darko_gcs.state.snapshot import Snapshot, updated
from darko_gcs.state.values import Doubt, Truth
from protocol.covariances import COVARIANCE_DIAGONAL
from protocol.dialect import mavlink
from protocol.frames import flying_attitude, flying_axes
from protocol.wire.message import Message

__all__ = ["ESTIMATE_HANDLERS"]

NORTH, EAST, DOWN, ROLL, PITCH, YAW = COVARIANCE_DIAGONAL
TEST_RATIOS = ("vel_ratio", "pos_horiz_ratio", "pos_vert_ratio", "mag_ratio", "hagl_ratio", "tas_ratio")

ESTIMATE_HANDLERS = HandlerTable()


@ESTIMATE_HANDLERS.handles("DARKO_TRUTH")
def _truth(s: Snapshot, m: Message, _now: float) -> Snapshot:
    """The true state, with the nose along x as in the rest of the snapshot."""
    truth = Truth(
        time=m.time_usec / 1e6,
        p=tuple(m.position),
        v=tuple(m.velocity),
        q=flying_attitude(m.q),
        rates=flying_axes(m.rates),
        wind=tuple(m.wind),
    )
    return updated(s, truth=truth)


@ESTIMATE_HANDLERS.handles("ODOMETRY")
def _odometry(s: Snapshot, m: Message, _now: float) -> Snapshot:
    """Of ODOMETRY the deviations; pose and velocity come more often in other messages."""
    if m.estimator_type == mavlink.MAV_ESTIMATOR_TYPE_NAIVE:
        return updated(s, doubt=None)
    pose, velocity = ([_root(v) for v in variances] for variances in (m.pose_covariance, m.velocity_covariance))
    doubt = Doubt(
        p=(pose[NORTH], pose[EAST], pose[DOWN]),
        v=max(velocity[NORTH], velocity[EAST], velocity[DOWN]),
        attitude=max(pose[ROLL], pose[PITCH], pose[YAW]),
    )
    return updated(s, doubt=doubt)


@ESTIMATE_HANDLERS.handles("ESTIMATOR_STATUS")
def _status(s: Snapshot, m: Message, _now: float) -> Snapshot:
    told = [ratio for name in TEST_RATIOS if math.isfinite(ratio := getattr(m, name))]
    return updated(s, test_ratio=max(told, default=None))


def _root(variance: float) -> float:
    return math.sqrt(variance) if variance >= 0.0 else math.nan
