"""PX4's simulator interface: MAVLink over TCP, on which PX4 is the client.

After ``src/modules/simulation/simulator_mavlink/SimulatorMavlink.cpp`` of PX4-Autopilot, and its peer
``gazebo_mavlink_interface.cpp``. HIL_SENSOR of id 0 is PX4's clock; each is answered by one HIL_ACTUATOR_CONTROLS
(lockstep). Before the first of these PX4 is still starting: it gets its sensors by the wall clock then, as it does if
it was built without lockstep. Attitude, rates and forces are those of the hover frame, as a tail-sitter's of PX4 are.

It stamps satellites and poses with the time of their arrival: EKF2_GPS_DELAY and EKF2_EV_DELAY are ours.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable
from typing import Any

from protocol.dialect import mavlink
from protocol.frames import (
    ATTITUDE_VARIANCES,
    COVARIANCE_SIZE,
    POSITION_VARIANCES,
    LocalFrame,
    hover_attitude,
    hover_axes,
)
from protocol.wire.codec import Codec
from protocol.wire.framing import FrameBuffer
from protocol.wire.message import Message
from sitl.mavlink.telemetry.sensor_messages import standard_atmosphere
from sitl.physics.driven_vehicle import Pose, SatelliteFix, Seen
from sitl.physics.link import Datagram, Link
from sitl.physics.rig import Rig
from sitl.sensors.draws import PERIOD

_STEP_PERIODS = 2  # control periods between HIL_SENSOR: 250 Hz, as Gazebo's
_OWN_IDS = (1, 200)  # of Gazebo's interface
LOCKSTEP, _ARMED = 1, 128  # bits of the flags, of the mode
_INERTIAL, MAGNETIC, STATIC, DYNAMIC = 0b111111, 0b111 << 6, 0b1101 << 9, 1 << 10  # bits of fields_updated
ANSWER_TIME = 1.0  # after which a step that was not answered is followed by another one [s]
GAUSS = 1e4  # per tesla
_MAX_INT16 = 32767
TRUTH_REQUEST = (mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAVLINK_MSG_ID_HIL_STATE_QUATERNION)


class Px4Link(Link):
    """One PX4; see :class:`sitl.physics.link.Link`.

    Args:
        rig: The vehicle.
        frame: Its local frame.
        satellites: Whether HIL_GPS is sent.
        poses: Whether motion capture is sent, as ODOMETRY.
    """

    default_port, port_step, is_stream = 4560, 1, True

    def __init__(self, rig: Rig, frame: LocalFrame, *, satellites: bool, poses: bool) -> None:
        super().__init__(rig)
        self._frame, self._satellites, self._poses = frame, satellites, poses
        self._codec, self._buffer = Codec(*_OWN_IDS), FrameBuffer()
        self._is_open = self._was_open = False
        self._forget()
        self._sensor = mavlink.MAVLink_hil_sensor_message(*[0] * 15)

    def _forget(self) -> None:
        self._in_step = self._awaits = False
        self._answered = -1  # newest time of the outputs [us]
        self._sent = self._due = -math.inf
        self._truth_interval, self._truth_sent = math.inf, 0.0  # of HIL_STATE_QUATERNION [s]
        self._buffer = FrameBuffer()

    def opened(self, now: float) -> None:
        """PX4 is there; another connection is a restart."""
        self._forget()
        if self._was_open:
            self.rig.restarted("PX4 began anew")
        self._is_open = self._was_open = True
        self._due = now

    def closed(self, now: float) -> None:  # noqa: ARG002
        """PX4 is gone: the vehicle waits where it is."""
        self._is_open = False
        self.journal.tell("closed connections", f"PX4 is gone at {self.rig.vehicle.time:.1f} s: waiting for it")

    def receive(self, data: bytes, peer: Hashable, now: float) -> list[Datagram]:  # noqa: ARG002
        """Take bytes of the stream."""
        frames = self._buffer.feed(data)
        if not frames and data[:1] not in (b"\xfd", b"\xfe"):
            self.journal.note("bad packets", f"{len(data)} bytes that are no MAVLink frame: ignored")
        for frame in frames:
            messages = self._codec.decode(frame)
            if not messages:
                self.journal.note("bad packets", "a MAVLink frame that is damaged or unknown: ignored")
            for message in messages:
                self._hear(message)
        return []

    def _hear(self, message: Message) -> None:
        kind = message.get_type()
        if kind == "HIL_ACTUATOR_CONTROLS":
            self._take(message)
        elif kind == "COMMAND_LONG" and (message.command, message.param1) == TRUTH_REQUEST and message.param2 > 0.0:
            self._truth_interval = message.param2 * 1e-6

    def _take(self, message: Message) -> None:
        if message.time_usec == self._answered:
            self.journal.note("repeated outputs", f"outputs of {message.time_usec} us again: no step for them")
        else:
            if message.time_usec < self._answered:
                back = f"outputs of {message.time_usec} us after {self._answered} us: PX4's time runs backwards"
                self.journal.note("backward times", back)
            self._answered, self._awaits = message.time_usec, False
        if not self._in_step and message.flags & LOCKSTEP:
            self.journal.say(f"PX4 answers: in lockstep from {self.rig.vehicle.time:.1f} s on")
        self._in_step = bool(message.flags & LOCKSTEP)
        if message.mode & _ARMED:
            self.rig.take(message.controls)
        else:
            self.rig.disarm()

    def wants(self, now: float) -> int:
        """Control periods up to the next HIL_SENSOR, if PX4 has answered the last one."""
        if not self._is_open or (not self._in_step and now < self._due):
            return 0
        is_answered = not (self._in_step and self._awaits) or now - self._sent >= ANSWER_TIME
        return _STEP_PERIODS if is_answered else 0

    def wakes(self) -> float:
        """Time of the next step although nothing arrives."""
        if not self._is_open:
            return math.inf
        return self._sent + ANSWER_TIME if self._in_step and self._awaits else self._due

    def step(self, now: float) -> list[Datagram]:
        """Fly them, and send what the instruments tell."""
        if self._in_step and self._awaits:
            self.journal.note("silences", f"no outputs for {ANSWER_TIME:g} s: one step without them")
        seen = self.rig.fly(_STEP_PERIODS)
        self._awaits, self._sent = True, now
        self._due = max(self._due + _STEP_PERIODS * PERIOD, now - 0.1)
        messages = []  # HIL_SENSOR is the last: it moves PX4's clock on, and what comes before it is of that time
        if self._satellites and seen.fix is not None:
            messages.append(self._gps(seen, seen.fix))
        if self._poses and seen.pose is not None:
            messages.append(odometry(seen, seen.pose))
        if seen.time - self._truth_sent >= self._truth_interval - 1e-9:
            self._truth_sent = seen.time
            messages.append(self._truth(seen))
        messages.append(self._sensors(seen))
        return [(b"".join(map(self._codec.encode, messages)), None)]

    def _sensors(self, seen: Seen) -> Message:
        """HIL_SENSOR; a field that is not updated repeats its reading before."""
        told = self._sensor
        told.time_usec = round(seen.time * 1e6)
        told.xacc, told.yacc, told.zacc = hover_axes(seen.force)
        told.xgyro, told.ygyro, told.zgyro = hover_axes(seen.rates)
        told.fields_updated, told.id = _INERTIAL, 0
        if seen.field is not None:
            told.xmag, told.ymag, told.zmag = (GAUSS * x for x in hover_axes(seen.field))
            told.fields_updated |= MAGNETIC
        if seen.height is not None:
            told.pressure_alt = self._frame.origin.alt + seen.height
            told.abs_pressure, told.temperature = standard_atmosphere(told.pressure_alt)
            told.fields_updated |= STATIC
        if seen.airspeed is not None:
            told.diff_pressure = 0.005 * self.rig.vehicle.airframe.rho * seen.airspeed * seen.airspeed
            told.fields_updated |= DYNAMIC
        return told

    def _gps(self, seen: Seen, fix: SatelliteFix) -> Message:
        place, (north, east, down) = self._frame.to_geodetic(fix.position), fix.velocity
        spec, speed = self.rig.vehicle.avionics.sensors.gnss, math.hypot(north, east)
        course = round(math.degrees(math.atan2(east, north)) * 100.0) % 36000 if speed > 0.5 else 65535
        return mavlink.MAVLink_hil_gps_message(
            time_usec=round(seen.time * 1e6),
            fix_type=3,
            lat=round(place.lat_deg * 1e7),
            lon=round(place.lon_deg * 1e7),
            alt=round(place.alt * 1e3),
            eph=max(round(spec.noise_level * 100.0), 1),
            epv=max(round(spec.noise_up * 100.0), 1),
            vel=min(round(speed * 100.0), 65535),
            vn=_int16(north * 100.0),
            ve=_int16(east * 100.0),
            vd=_int16(down * 100.0),
            cog=course,
            satellites_visible=12,
        )

    def _truth(self, seen: Seen) -> Message:
        """HIL_STATE_QUATERNION; PX4 takes its accelerations for mm/s2."""
        place = self._frame.to_geodetic(seen.position)
        through = [v - w for v, w in zip(seen.velocity, seen.wind, strict=True)]
        airspeed = min(round(math.hypot(*through) * 100.0), 65535)
        return mavlink.MAVLink_hil_state_quaternion_message(
            time_usec=round(seen.time * 1e6),
            attitude_quaternion=hover_attitude(seen.attitude),
            lat=round(place.lat_deg * 1e7),
            lon=round(place.lon_deg * 1e7),
            alt=round(place.alt * 1e3),
            ind_airspeed=airspeed,
            true_airspeed=airspeed,
            **_named("rollspeed pitchspeed yawspeed", hover_axes(seen.true_rates)),
            **_named("vx vy vz", (_int16(v * 100.0) for v in seen.velocity)),
            **_named("xacc yacc zacc", (_int16(a * 1000.0) for a in seen.acceleration)),
        )


def odometry(seen: Seen, pose: Pose) -> Message:
    """A pose of motion capture; PX4 fuses those of a vision system, and those of a mocap estimator not."""
    covariance = [0.0] * COVARIANCE_SIZE
    for place, turn in zip(POSITION_VARIANCES, ATTITUDE_VARIANCES, strict=True):
        covariance[place], covariance[turn] = pose.variance, pose.attitude_variance
    return mavlink.MAVLink_odometry_message(
        time_usec=round(seen.time * 1e6),
        frame_id=mavlink.MAV_FRAME_LOCAL_NED,
        child_frame_id=mavlink.MAV_FRAME_BODY_FRD,
        **_named("x y z", pose.position),
        q=hover_attitude(pose.attitude),
        **_named("vx vy vz rollspeed pitchspeed yawspeed", [math.nan] * 6),
        pose_covariance=covariance,
        velocity_covariance=[math.nan] + [0.0] * (COVARIANCE_SIZE - 1),
        reset_counter=0,
        estimator_type=mavlink.MAV_ESTIMATOR_TYPE_VISION,
        quality=100,
    )


def _named(names: str, values: Iterable[float]) -> dict[str, Any]:
    return dict(zip(names.split(), values, strict=True))


def _int16(value: float) -> int:
    return round(min(max(value, -_MAX_INT16), _MAX_INT16))
