"""One snapshot of the craft: what every telemetry message is built from."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

from protocol import frames, units
from protocol.dialect import mavlink
from protocol.frames import LocalFrame, Quaternion, Vector
from protocol.modes import Mode
from sitl.autopilot.fence import Fence, FenceWatch
from sitl.autopilot.guidance import Setpoint
from sitl.battery import Battery
from sitl.craft import Craft
from sitl.hybrid.supervisor import Law
from sitl.kernels import state
from sitl.wire.flight_record import FlightRecord


class Picture(NamedTuple):
    """The vehicle at one instant, as telemetry sees it; frames NWU and FLU, SI units."""

    time: float  # since boot [s]
    p: Vector
    v: Vector
    q: Quaternion
    rates: Vector  # p, q, r [rad/s]
    wind: Vector  # velocity of the air [m/s]
    wind_estimate: Vector  # as the laws see it [m/s]
    wind_deviation: Vector  # standard deviations of the estimate [m/s]
    cross_track: float  # to the left of the path flown forward [m]
    motor: tuple[float, float]  # [rad/s]
    motor_command: tuple[float, float]
    elevon: tuple[float, float]  # [rad]
    elevon_command: tuple[float, float]
    limits: int  # DARKO_LIMIT bits
    given_up: int  # DARKO_GIVEN_UP bits
    law: int  # DARKO_LAW
    last_law: int
    last_reason: int  # DARKO_JUMP_REASON
    jumps: int
    lyapunov: float
    lyapunov_forward: float
    lyapunov_attitude: float
    v_enter: float
    v_leave: float
    governor: float  # 0..1
    power: float  # [W]
    energy: float  # [J]
    energy_by_law: tuple[float, ...]
    battery: Battery
    setpoint: Setpoint
    mode: Mode
    armed: bool
    landed: bool
    landing: bool
    taking_off: bool
    ready: bool  # pre-arm checks pass
    critical: bool  # the cause of an alarm lasts
    k_f: float
    motor_min: float
    motor_max: float
    elevon_max: float
    frame: LocalFrame
    home: Vector
    return_altitude: float  # above home [m]
    mission_count: int
    mission_current: int
    mission_state: int  # MISSION_STATE
    fence: FenceWatch
    fenced: bool  # a fence is in force
    intended: Mode | None = None  # the mode a peer asked for last
    flight: FlightRecord = FlightRecord()  # the present one, or the last
    in_control: int = 0  # system id of the ground station in control; 0: none
    takeover: bool = True  # a request for control will be granted

    @property
    def ms(self) -> int:
        """Time since boot on the wire [ms]."""
        return units.milliseconds(self.time)

    @property
    def airspeed(self) -> float:
        """Speed through the air [m/s]."""
        return math.dist(self.v, self.wind)

    @property
    def airspeed_estimate(self) -> float:
        """Speed through the air as the laws see it [m/s]."""
        return math.dist(self.v, self.wind_estimate)

    @property
    def yaw(self) -> float:
        """Heading, clockwise from north [rad]."""
        return frames.heading(frames.flip_quaternion(self.q))


def take_picture(craft: Craft) -> Picture:
    """The craft as it is now."""
    vehicle, autopilot, a = craft.vehicle, craft.autopilot, craft.vehicle.airframe
    x, command = vehicle.plant.tolist(), vehicle.command.tolist()
    actuator = x[state.ACTUATOR : state.ACTUATOR + 4]
    last = vehicle.jumps[-1] if vehicle.jumps else None
    mission = autopilot.mission
    return Picture(
        time=vehicle.time,
        p=(x[0], x[1], x[2]),
        v=(x[3], x[4], x[5]),
        q=(x[6], x[7], x[8], x[9]),
        rates=(x[10], x[11], x[12]),
        wind=tuple(vehicle.wind.tolist()),
        wind_estimate=tuple(vehicle.wind_estimate.tolist()),
        wind_deviation=vehicle.wind_deviation,
        cross_track=vehicle.cross_track,
        motor=(actuator[0], actuator[1]),
        motor_command=(command[0], command[1]),
        elevon=(actuator[2], actuator[3]),
        elevon_command=(command[2], command[3]),
        limits=vehicle.limits if vehicle.law is not Law.LANDED else 0,
        given_up=vehicle.given_up,
        law=int(vehicle.law),
        last_law=int(last.source) if last else 0,
        last_reason=int(last.reason) if last else 0,
        jumps=len(vehicle.jumps),
        lyapunov=vehicle.lyapunov if vehicle.law is not Law.LANDED else math.nan,
        lyapunov_forward=vehicle.lyapunov_forward,
        lyapunov_attitude=vehicle.lyapunov_attitude,
        v_enter=vehicle.tuning.v_enter,
        v_leave=vehicle.tuning.v_leave,
        governor=vehicle.governor,
        power=vehicle.power,
        energy=vehicle.energy,
        energy_by_law=_by_law(craft),
        battery=craft.battery,
        setpoint=autopilot.setpoint,
        mode=autopilot.mode,
        armed=autopilot.armed,
        landed=vehicle.law is Law.LANDED,
        landing=autopilot.landing,
        taking_off=autopilot.mode is Mode.TAKEOFF,
        ready=not autopilot.pre_arm(),
        critical=autopilot.failsafes.is_critical,
        k_f=a.k_f,
        motor_min=a.omega_min,
        motor_max=a.omega_max,
        elevon_max=a.delta_max,
        frame=autopilot.world.frame,
        home=autopilot.world.home,
        return_altitude=autopilot.settings.return_altitude,
        mission_count=len(mission.items) if mission else 0,
        mission_current=mission.current if mission else 0,
        mission_state=_mission_state(craft),
        fence=replace(autopilot.failsafes.fence),
        fenced=autopilot.world.fence != Fence(),
    )


def _by_law(craft: Craft) -> tuple[float, ...]:
    energy = craft.vehicle.energy_by_law
    return tuple(float(energy[law]) for law in sorted(Law))


def _mission_state(craft: Craft) -> int:
    autopilot = craft.autopilot
    if autopilot.mission is None:
        return int(mavlink.MISSION_STATE_NO_MISSION)
    if autopilot.mission.finished:
        return int(mavlink.MISSION_STATE_COMPLETE)
    if autopilot.mode is Mode.MISSION and autopilot.flying:
        return int(mavlink.MISSION_STATE_ACTIVE)
    begun = autopilot.mission.current > 0
    return int(mavlink.MISSION_STATE_PAUSED if begun else mavlink.MISSION_STATE_NOT_STARTED)
