"""A vehicle that only listens to ODOMETRY and judges it as PX4 does, on pymavlink's own common dialect.

https://docs.px4.io/main/en/ros/external_position_estimation.html
"""

import math

import numpy as np
from pymavlink.dialects.v20 import common
from scipy.spatial.transform import Rotation

POSE_FRAMES = {common.MAV_FRAME_LOCAL_NED: "NED", common.MAV_FRAME_LOCAL_FRD: "FRD"}
VELOCITY_FRAMES = POSE_FRAMES | {common.MAV_FRAME_BODY_FRD: "body"}
TOPICS = {0: "visual", 1: "visual", 2: "visual", 3: "visual", 6: "mocap"}  # by estimator
CONVERGED = 10  # answers to TIMESYNC before stamps are believed


class Px4Vehicle:
    """Its clock is ``ahead`` of the other side's."""

    def __init__(self, ahead=777.0):
        self.mavlink = common.MAVLink(None, srcSystem=1, srcComponent=1)
        self.ahead, self.offsets, self.samples = ahead, [], []

    def time(self, now):
        return now + self.ahead

    def beat(self, now):
        """Its HEARTBEAT and its question for the time."""
        messages = (
            common.MAVLink_heartbeat_message(common.MAV_TYPE_QUADROTOR, common.MAV_AUTOPILOT_PX4, 0, 0, 4, 3),
            common.MAVLink_timesync_message(0, round(1e9 * self.time(now))),
        )
        return b"".join(message.pack(self.mavlink) for message in messages)

    def receive(self, datagram, now):
        for message in self.mavlink.parse_buffer(datagram) or ():
            kind = message.get_type()
            if kind == "TIMESYNC" and message.tc1 > 0:
                self.offsets.append((message.ts1 + 1e9 * self.time(now) - 2 * message.tc1) / 2e9)
            elif kind == "ODOMETRY":
                self.samples.append(self._judge(message, now))

    def _judge(self, m, now):
        assert (m.get_srcSystem(), m.get_srcComponent()) == (1, common.MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY)
        synced = len(self.offsets) >= CONVERGED
        sample = {
            "time": m.time_usec * 1e-6 + self.offsets[-1] if synced else self.time(now),
            "is_synced": synced,
            "arrived": self.time(now),
            "topic": TOPICS[m.estimator_type],
            "resets": m.reset_counter,
            "quality": m.quality,
            "position": None,
            "attitude": None,
            "velocity": None,
        }
        if all(map(math.isfinite, (m.x, m.y, m.z))):
            assert m.frame_id in POSE_FRAMES
            sample["position"] = np.array((m.x, m.y, m.z))
            sample["position_variance"] = [m.pose_covariance[k] for k in (0, 6, 11)]
        if all(map(math.isfinite, m.q)) and math.hypot(*m.q) > 0.5:
            w, x, y, z = m.q
            sample["attitude"] = Rotation.from_quat((x, y, z, w))
            sample["attitude_variance"] = [m.pose_covariance[k] for k in (15, 18, 20)]
        if all(map(math.isfinite, (m.vx, m.vy, m.vz))):
            assert VELOCITY_FRAMES[m.child_frame_id] == "body"
            sample["velocity"] = sample["attitude"].apply((m.vx, m.vy, m.vz))
            sample["velocity_variance"] = [m.velocity_covariance[k] for k in (0, 6, 11)]
        assert not any(map(math.isfinite, (m.rollspeed, m.pitchspeed, m.yawspeed)))
        return sample
