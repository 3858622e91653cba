"""Sees the running vehicle's true motion over MAVLink: asks for DARKO_TRUTH, and asks again when it stops."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from protocol.dialect import mavlink
from protocol.frames import flip, flip_quaternion, flying_attitude, flying_axes
from protocol.wire.codec import Codec
from protocol.wire.message import Message, source_of
from protocol.wire.signing import Keyring
from sitl.motion_capture.cameras import TrueMotion

OWN_IDS = (254, mavlink.MAV_COMP_ID_USER1)
TRUTH_INTERVAL = 10_000  # between two true states: the vehicle looks at its link so often [us]
ASKING_PERIOD = 1.0  # while none come [s]
MAX_NUMBER_TOLD = 1e5  # in any unit: nothing flies so far or so fast
MAX_UPTIME = 30 * 86400.0  # of a vehicle [s]
VEHICLE_SILENT_TIME = 2.0  # without a true state the vehicle is gone [s]


class VehicleWatch:
    """One vehicle, seen over one link.

    Args:
        keyring: Signs requests and judges what is heard.
        system: System id of the vehicle.
    """

    def __init__(self, keyring: Keyring, system: int = 1) -> None:
        self._codec, self._keyring, self._system = Codec(*OWN_IDS, keyring.link(None)), keyring, system
        self._asked = self._heard = -math.inf
        self._time = 0.0  # of the newest true state, on the vehicle's clock [s]
        self.refusal = ""  # why the vehicle sends none

    def is_seen(self, now: float) -> bool:
        """Whether true states come."""
        return now - self._heard < VEHICLE_SILENT_TIME

    def time(self, now: float) -> float:
        """The vehicle's clock now, guessed since the newest true state but not beyond the next one [s]."""
        return self._time + min(max(now - self._heard, 0.0), TRUTH_INTERVAL * 1e-6)

    def receive(self, data: bytes, now: float) -> list[TrueMotion]:
        """Take a datagram; gives the true states in it."""
        self._keyring.advance_time(now)
        motions = []
        for message in self._codec.decode(data):
            if source_of(message)[0] != self._system or (self._keyring.is_on and not message.get_signed()):
                continue
            if message.get_type() == "DARKO_TRUTH":
                motion = motion_of(message)
                if motion is not None:
                    self._heard, self._time, self.refusal = now, motion.time, ""
                    motions.append(motion)
            elif message.get_type() == "COMMAND_ACK" and message.result != mavlink.MAV_RESULT_ACCEPTED:
                known = mavlink.enums["MAV_RESULT"].get(message.result)
                self.refusal = str(known.name).removeprefix("MAV_RESULT_").lower() if known else "refused"
        return motions

    def requests(self, now: float) -> list[bytes]:
        """Requests to be sent now."""
        self._keyring.advance_time(now)
        if now - self._asked < ASKING_PERIOD or now - self._heard < ASKING_PERIOD:
            return []
        self._asked = now
        wanted = (mavlink.MAVLINK_MSG_ID_DARKO_TRUTH, TRUTH_INTERVAL, 0, 0, 0, 0, 0)
        command = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
        return [self._codec.encode(mavlink.MAVLink_command_long_message(self._system, 1, command, 0, *wanted))]


def motion_of(message: Message) -> TrueMotion | None:
    """The true motion that DARKO_TRUTH tells; None if it can be of no vehicle."""
    told = (*message.position, *message.velocity, *message.q, *message.rates)
    if not all(abs(number) < MAX_NUMBER_TOLD for number in told) or math.hypot(*message.q) < 0.5:
        return None
    if message.time_usec > MAX_UPTIME * 1e6:
        return None
    w, x, y, z = flip_quaternion(flying_attitude(message.q))
    return TrueMotion(
        time=message.time_usec * 1e-6,
        position=np.array(flip(message.position)),
        velocity=np.array(flip(message.velocity)),
        attitude=Rotation.from_quat((x, y, z, w)),
        rates=np.array(flip(flying_axes(message.rates))),
    )
