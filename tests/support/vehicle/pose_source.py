"""Motion capture in another program: it sees the true state of the vehicle, and sends it as ODOMETRY, late."""

import math
from collections import deque
from typing import Any

from protocol.dialect import mavlink
from protocol.wire.codec import Codec

UNKNOWN = [math.nan] * 21
PERIODS = 5  # control periods between two poses: 100 Hz
EPOCH_US = 1_700_000_000_000_000  # of stamps by a clock that the vehicle does not know


class PoseSource:
    """Sends poses of a station's vehicle.

    Args:
        station: That asks for DARKO_TRUTH.
        late: Time from measurement to sending [s].
        epoch: Added to the time stamps [us].
    """

    def __init__(self, station, *, late=0.02, epoch=0):
        self.station, self.late, self.epoch = station, late, epoch
        self.codec = Codec(1, 191)
        self._on_their_way: deque[Any] = deque()
        station.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAVLINK_MSG_ID_DARKO_TRUTH, 10_000)

    def fly(self, seconds, each=lambda: None):
        """Fly for a time, measuring and sending."""
        bench, vehicle, sorted_out = self.station.bench, self.station.vehicle, 0
        for _ in range(round(500 * seconds / PERIODS)):
            bench.node.advance(PERIODS)
            bench.now += 0.002 * PERIODS
            bench.deliver()
            fresh = self.station.heard[sorted_out:]
            self._on_their_way += [m for m in fresh if m.get_type() == "DARKO_TRUTH"]
            self.station.heard[sorted_out:] = [m for m in fresh if m.get_type() != "DARKO_TRUTH"]
            sorted_out = len(self.station.heard)
            while self._on_their_way and self._on_their_way[0].time_usec <= 1e6 * (vehicle.time - self.late) + 1.0:
                self.send(odometry(self._on_their_way.popleft(), epoch=self.epoch))
            each()

    def send(self, message, key="cameras"):
        """Send one message to the vehicle."""
        self.station.node.receive(self.codec.encode(message), key, self.station.bench.now)
        self.station.bench.deliver()


def odometry(truth, *, epoch=0, **changed):
    """ODOMETRY of a DARKO_TRUTH, its velocity unused."""
    still = dict.fromkeys(("vx", "vy", "vz", "rollspeed", "pitchspeed", "yawspeed"), 0.0)
    x, y, z = truth.position
    fields = {
        "time_usec": truth.time_usec + epoch,
        "frame_id": mavlink.MAV_FRAME_LOCAL_NED,
        "child_frame_id": mavlink.MAV_FRAME_BODY_FRD,
        "x": x,
        "y": y,
        "z": z,
        "q": list(truth.q),
        **still,
        "pose_covariance": UNKNOWN,
        "velocity_covariance": UNKNOWN,
        **changed,
    }
    return mavlink.MAVLink_odometry_message(**fields)
