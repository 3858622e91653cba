"""Clients of ``darko-sitl physics``, after the sources of the autopilots: they hold DarkO in the hover.

Each is an autopilot without socket or clock that knows of the vehicle what its protocol tells, no more.
"""

from __future__ import annotations

import json
import math
import struct
from typing import Any

from protocol.dialect import mavlink
from protocol.frames import Geodetic, LocalFrame, flip, hover_attitude, hover_axes, rotate
from protocol.wire.codec import Codec
from protocol.wire.framing import FrameBuffer
from sitl.model.airframe_files import load
from sitl.model.propeller import speed_for

GRAVITY = 9.81
DARKO = load("darko").parameters
HOVER_THRUST = 0.5 * DARKO.m * GRAVITY  # of a motor [N]
HOVER_SPEED = speed_for(HOVER_THRUST, 0.0, DARKO)  # [rad/s]


class HoverPilot:
    """Holds a place with proportional, integral and derivative terms, in the hover frame FRD and NED.

    Args:
        place: To hold, NED [m].
    """

    def __init__(self, place=(0.0, 0.0, -5.0)):
        self.place, self._sum = place, [0.0, 0.0, 0.0]

    def shares(self, position, velocity, attitude, rates, dt):
        """Left and right motor, 0 to 1, left and right elevon, -1 to 1."""
        wanted = []
        for axis in range(3):
            error = max(-2.0, min(2.0, self.place[axis] - position[axis]))
            self._sum[axis] = max(-3.0, min(3.0, self._sum[axis] + 0.5 * error * dt))
            wanted.append(2.0 * error + self._sum[axis] - 2.5 * velocity[axis])
        level = [max(-4.0, min(4.0, a)) for a in wanted[:2]]
        force = (*level, max(-6.0, min(6.0, wanted[2])) - GRAVITY)
        size = math.hypot(*force)
        w, x, y, z = attitude
        down = rotate((w, -x, -y, -z), tuple(-f / size for f in force))  # where z should be, in the body frame
        ahead = rotate(attitude, (1.0, 0.0, 0.0))
        roll, pitch, yaw = -down[1], down[0], -math.atan2(ahead[1], ahead[0])
        more = 1.8 * roll - 0.5 * rates[0]  # thrust of the left motor [N]
        tilt, turn = 0.39 * pitch - 0.08 * rates[1], 0.2 * yaw - 0.12 * rates[2]
        thrust = 0.5 * DARKO.m * size
        motors = [
            HOVER_SPEED * math.sqrt(max(t, 0.1) / HOVER_THRUST) for t in (thrust + 0.5 * more, thrust - 0.5 * more)
        ]
        elevons = (tilt + turn, tilt - turn)
        return (
            *(min(w / DARKO.omega_max, 1.0) for w in motors),
            *(max(-1.0, min(1.0, d / DARKO.delta_max)) for d in elevons),
        )


class ArduPilotClient:
    """After SIM_JSON.cpp: sends a frame, waits for a line, counts it."""

    def __init__(self, rate=500, outputs=16, pilot=None):
        self.rate, self.outputs = rate, outputs
        self.pilot = pilot or HoverPilot()
        self.number, self.time, self.state, self._shares = 0, 0.0, None, (0.0, 0.0, 0.0, 0.0)

    def frame(self):
        left, right, left_elevon, right_elevon = self._shares
        wanted = [1500 + 500 * left_elevon, 1500 + 500 * right_elevon, 1000 + 1000 * left, 1000 + 1000 * right]
        pulses = [round(pulse) for pulse in wanted] + [0] * (self.outputs - 4)
        magic = 18458 if self.outputs == 16 else 29569
        return struct.pack(f"<HHI{self.outputs}H", magic, self.rate, self.number, *pulses)

    def take(self, line):
        assert line[:1] == b"\n"
        assert line[-1:] == b"\n"
        state = self.state = json.loads(line)
        dt, self.time = state["timestamp"] - self.time, state["timestamp"]
        assert 0.0 < dt < 0.1
        self.number += 1
        attitude, rates = hover_attitude(state["quaternion"]), hover_axes(state["imu"]["gyro"])
        self._shares = self.pilot.shares(state["position"], state["velocity"], attitude, rates, dt)

    @property
    def position(self):
        assert self.state is not None
        return self.state["position"]


class Px4Client:
    """After SimulatorMavlink.cpp: one HIL_ACTUATOR_CONTROLS for each HIL_SENSOR of id 0, whose time is its clock.

    Position and attitude are those of ODOMETRY where it comes, else of HIL_STATE_QUATERNION.
    """

    def __init__(self, home, pilot=None, armed_after=0.2):
        self._frame, self.pilot, self._armed_after = LocalFrame(Geodetic(*home)), pilot or HoverPilot(), armed_after
        self._codec, self._buffer = Codec(1, 1), FrameBuffer()
        self.time_usec = 0
        self._began: int | None = None
        self.position: Any = None
        self._velocity, self._attitude, self._pose_time = (0.0, 0.0, 0.0), None, None
        self.seen = []

    def greeting(self):
        asked = (mavlink.MAVLINK_MSG_ID_HIL_STATE_QUATERNION, 5e3, 0, 0, 0, 0, 0)
        command = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
        return self._codec.encode(mavlink.MAVLink_heartbeat_message(0, 12, 0, 0, 0, 3)) + self._codec.encode(
            mavlink.MAVLink_command_long_message(0, 0, command, 0, *asked)
        )

    def take(self, data):
        """Take bytes; gives the outputs, if a step has ended."""
        answers = b""
        for frame in self._buffer.feed(data):
            (message,) = self._codec.decode(frame)
            kind = message.get_type()
            self.seen.append(message)
            if kind == "HIL_SENSOR":
                answers += self._answer(message)
            elif kind == "ODOMETRY":
                self._see_pose(message)
            elif kind == "HIL_STATE_QUATERNION" and self._pose_time is None:
                self.position = self._frame.to_ned(Geodetic(message.lat / 1e7, message.lon / 1e7, message.alt / 1e3))
                self._velocity = (message.vx / 100, message.vy / 100, message.vz / 100)
                self._attitude = message.attitude_quaternion
        return answers

    def _see_pose(self, message):
        assert message.frame_id == mavlink.MAV_FRAME_LOCAL_NED
        place = (message.x, message.y, message.z)
        if self._pose_time is not None and message.time_usec > self._pose_time:
            dt = (message.time_usec - self._pose_time) * 1e-6
            share = min(dt / 0.03, 1.0)
            raw = [(now - then) / dt for now, then in zip(place, self.position, strict=True)]
            vx, vy, vz = (v + share * (r - v) for v, r in zip(self._velocity, raw, strict=True))
            self._velocity = (vx, vy, vz)
        self.position, self._attitude, self._pose_time = place, message.q, message.time_usec

    def _answer(self, sensor):
        assert sensor.id == 0
        assert sensor.time_usec > self.time_usec, "HIL_SENSOR's time strictly increases"
        dt, self.time_usec = (sensor.time_usec - self.time_usec) * 1e-6, sensor.time_usec
        self._began = sensor.time_usec if self._began is None else self._began
        controls, armed = [0.0] * 16, sensor.time_usec - self._began > 1e6 * self._armed_after
        if armed and self._attitude is not None:
            gyro = (sensor.xgyro, sensor.ygyro, sensor.zgyro)
            left, right, left_elevon, right_elevon = self.pilot.shares(
                self.position, self._velocity, self._attitude, gyro, min(dt, 0.02)
            )
            controls[0], controls[1], controls[4], controls[5] = right, left, left_elevon, right_elevon
        return self.outputs(sensor.time_usec, controls, 1 | (128 if armed else 0))

    def outputs(self, time_usec, controls, mode=129, flags=1):
        return self._codec.encode(mavlink.MAVLink_hil_actuator_controls_message(time_usec, controls, mode, flags))


class BetaflightClient:
    """After sitl.c: one packet of outputs for each state that is not older than the one before."""

    def __init__(self, home, pilot=None):
        self._frame, self.pilot, self.time = LocalFrame(Geodetic(*home)), pilot or HoverPilot(), 0.0
        self.position = None

    def take(self, data):
        """Take a state; gives the outputs."""
        numbers = struct.unpack("<18d", data)
        dt, self.time = numbers[0] - self.time, numbers[0]
        if dt < 0.0:
            return None
        rates, q, (east, north, up) = numbers[1:4], numbers[7:11], numbers[11:14]
        lon, lat, alt = numbers[14:17]
        self.force = flip([-x for x in numbers[4:7]])
        self.pressure = numbers[17]
        self.position = self._frame.to_ned(Geodetic(lat, lon, alt))
        left, right, left_elevon, right_elevon = self.pilot.shares(
            self.position, (north, east, -up), hover_attitude(q), hover_axes(rates), min(dt, 0.02)
        )
        pulses = [1000 + 1000 * left, 1000 + 1000 * right, 1500, 1500 + 500 * left_elevon, 1500 + 500 * right_elevon]
        return struct.pack("<Hxx16f", 2, *pulses, *[0.0] * 11)


def link_of(*words):
    """The link of a command line, and the lines that it has told."""
    from sitl.commands.physics import parser
    from sitl.physics.serving import build_link

    told: list[str] = []
    return build_link(parser({"physics": ""}).parse_args([*words]), 0, told.append), told


def flown_by_ardupilot(link, client, seconds, *, now=0.0, peer=("127.0.0.1", 40000)):
    """Fly one ArduPilot; gives the farthest that it was from its place, without its first five seconds [m]."""
    farthest, began, end = 0.0, client.time, client.time + seconds
    while client.time < end - 1e-9:
        assert link.receive(client.frame(), peer, now) == []
        assert link.wants(now)
        ((line, to),) = link.step(now)
        assert to == peer
        client.take(line)
        now += 0.002
        if client.time - began > 5.0:
            farthest = max(farthest, math.dist(client.position, client.pilot.place))
    return farthest


def flown_by_px4(link, client, seconds, *, now=0.0):
    """The same of one PX4, by the clock until it is in lockstep."""
    farthest, began, end = 0.0, None, None
    while end is None or client.time_usec * 1e-6 < end - 1e-9:
        if link.wants(now):
            ((data, _),) = link.step(now)
            if answer := client.take(data):
                link.receive(answer, None, now)
            began = client.time_usec * 1e-6 if began is None else began
            end = began + seconds
        now += 0.002
        if began is not None and client.time_usec * 1e-6 - began > 5.0:
            farthest = max(farthest, math.dist(client.position, client.pilot.place))
    return farthest


def flown_by_betaflight(link, client, seconds, *, now=0.0, peer=("127.0.0.1", 41000)):
    """The same of one Betaflight."""
    farthest, began, end = 0.0, None, None
    while end is None or client.time < end - 1e-9:
        for data, _ in link.step(now) if link.wants(now) else link.poll(now):
            if (outputs := client.take(data)) is not None:
                link.receive(outputs, peer, now)
            began = client.time if began is None else began
            end = began + seconds
        now += 0.002
        if began is not None and client.time - began > 5.0:
            farthest = max(farthest, math.dist(client.position, client.pilot.place))
    return farthest
