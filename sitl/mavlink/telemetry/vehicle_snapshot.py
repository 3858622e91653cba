"""One snapshot of the vehicle: what every telemetry message is made from."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

from protocol import frames, units
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, Limit, Reason, Regime, Saturation
from protocol.frames import LocalFrame, Quaternion, Vector
from protocol.names import Mode
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.camera import Camera
from sitl.autopilot.fence_watch import FenceWatch
from sitl.autopilot.flight_plan.aims import PlanStatus
from sitl.autopilot.world import Fence
from sitl.control.reference import Reference
from sitl.enclosure.arena_files import Arena
from sitl.mavlink.telemetry.recent_means import inertial_mean
from sitl.model.aerodynamics import thrusts
from sitl.model.airframe import Airframe
from sitl.model.battery import Battery, drawn_power
from sitl.model.plant import inflow
from sitl.model.state import Plant
from sitl.sensors.battery_monitor import BatteryReading
from sitl.sensors.instruments import Inertial
from sitl.simulation.navigation_status import NavigationStatus
from sitl.simulation.readings import LatestReadings, readings_of
from sitl.simulation.situation import cross_track, governor, regime, v_attitude, v_forward
from sitl.vehicle.aircraft import AUTOPILOT_PERIODS, Aircraft


@dataclass(frozen=True, slots=True)
class FlightTimes:
    """Times of arming, take-off and landing of the present or last flight [s since boot]; 0: not yet.

    A flight begins with an arming and lasts until the next one. Call ``updated`` whenever the vehicle may have changed.
    """

    number: int = 0  # armings since boot
    armed_at: float = 0.0
    took_off_at: float = 0.0
    landed_at: float = 0.0
    armed: bool = False
    landed: bool = True

    def updated(self, time: float, *, armed: bool, landed: bool) -> FlightTimes:
        """The times once the vehicle is armed and landed, or not.

        Args:
            time: Now [s since boot].
            armed: Whether it is armed.
            landed: Whether it stands on the ground.
        """
        if (armed, landed) == (self.armed, self.landed):
            return self
        times = self
        if armed and not self.armed:
            times = FlightTimes(self.number + 1, armed_at=time, landed=self.landed)
        if self.landed and not landed:
            times = replace(times, took_off_at=time, landed_at=0.0)
        elif landed and not self.landed:
            times = replace(times, landed_at=time)
        return replace(times, armed=armed, landed=landed)


NO_FLIGHT = FlightTimes()


class HeartbeatStatus(NamedTuple):
    """Fields of HEARTBEAT."""

    mode: Mode
    armed: bool
    critical: bool  # the cause of an alarm lasts
    crashed: bool = False
    terminated: bool = False  # the motors were cut in flight


class Control(NamedTuple):
    """The station in control, as CONTROL_STATUS reports it."""

    station: int = 0  # system id of the ground station in control; 0: none
    takeover: bool = True  # another station that asks for control will get it


NOBODY_IN_CONTROL = Control()


class VehicleSnapshot(NamedTuple):
    """The vehicle at one instant, as telemetry sees it; frames NWU and FLU, SI units."""

    time: float  # since boot [s]
    p: Vector  # as the vehicle believes, like the three below
    v: Vector
    q: Quaternion
    rates: Vector  # p, q, r [rad/s]
    plant: Plant  # as it is
    navigation: NavigationStatus
    readings: LatestReadings
    has_position: bool  # something has told the position lately
    has_tube: bool  # there is a pitot tube
    airframe: Airframe
    inertial: Inertial | None  # mean reading since the last tick; None: the vehicle flies on the truth
    inertial_age: float  # of the middle of it [s]
    wind: Vector  # velocity of the air [m/s]
    wind_estimate: Vector  # as the laws see it [m/s]
    wind_deviation: Vector  # standard deviations of the estimate [m/s]
    cross_track: float  # to the left of the path flown forward [m]
    motor: tuple[float, float]  # [rad/s]
    motor_command: tuple[float, float]
    elevon: tuple[float, float]  # [rad]
    elevon_command: tuple[float, float]
    limits: Limit
    saturation: Saturation
    law: Law
    regime: Regime
    way_of_flying: Regime  # the same, but a vehicle that hovers is in no back transition
    last_law: Law
    last_reason: Reason
    jumps: int
    v_hover: float | None  # of the linear hover law; None on the ground
    v_forward: float | None  # of the linear forward law; None off its legs
    v_attitude: float | None  # of the attitude law [rad^2]; None while it does not fly
    v_enter: float
    v_leave: float
    v_forward_enter: float
    v_forward_leave: float
    governor: float  # 0..1
    power: float  # [W]
    energy: float  # [J]
    energy_by_law: Mapping[Law, float]  # [J]
    battery: Battery
    battery_reading: BatteryReading
    reference: Reference
    mode: Mode
    armed: bool
    landed: bool
    landing: bool
    taking_off: bool
    ready: bool  # pre-arm checks pass
    critical: bool  # the cause of an alarm lasts
    terminated: bool  # the motors were cut in flight
    thrust: tuple[float, float]  # [N]
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
    camera: Camera
    intended: Mode | None  # the mode a peer asked for last
    flight: FlightTimes  # of the present flight, or of the last one
    control: Control
    autopilot_type: int  # MAV_AUTOPILOT
    flight_plan: PlanStatus | None  # where the flight plan is; None: none is loaded
    plan_name: str  # of the flight plan
    arena: Arena

    @property
    def status(self) -> HeartbeatStatus:
        """Fields of HEARTBEAT."""
        return HeartbeatStatus(self.mode, self.armed, self.critical, self.law is Law.CRASHED, self.terminated)

    @property
    def ms(self) -> int:
        """Time since boot on the wire [ms]."""
        return units.milliseconds(self.time)

    @property
    def airspeed(self) -> float:
        """Speed through the air as it is [m/s]."""
        return math.dist(self.plant.body.velocity, self.wind)

    @property
    def airspeed_estimate(self) -> float:
        """Speed through the air as the laws see it [m/s]."""
        return math.dist(self.v, self.wind_estimate)

    @property
    def yaw(self) -> float:
        """Heading, clockwise from north [rad]."""
        return frames.heading(frames.flip_quaternion(self.q))


def heartbeat_status(aircraft: Aircraft) -> HeartbeatStatus:
    """Fields of HEARTBEAT at present."""
    autopilot = aircraft.autopilot
    return HeartbeatStatus(
        mode=autopilot.mode,
        armed=autopilot.armed,
        critical=autopilot.failsafes.is_critical,
        crashed=aircraft.vehicle.law is Law.CRASHED,
        terminated=bool(autopilot.terminated),
    )


def take_snapshot(
    aircraft: Aircraft,
    *,
    intended: Mode | None = None,
    flight: FlightTimes = NO_FLIGHT,
    control: Control = NOBODY_IN_CONTROL,
    autopilot_type: int = mavlink.MAV_AUTOPILOT_PX4,
) -> VehicleSnapshot:
    """The vehicle as it is now.

    Args:
        aircraft: The vehicle.
        intended: The mode a peer asked for last.
        flight: When the present flight, or the last one, began and ended.
        control: Who is in control.
        autopilot_type: MAV_AUTOPILOT that it reports.
    """
    vehicle, autopilot, a = aircraft.vehicle, aircraft.autopilot, aircraft.vehicle.airframe
    plant, believed, command, law = vehicle.truth, vehicle.estimate, vehicle.command, vehicle.law
    mean = inertial_mean(vehicle.avionics, vehicle.periods, AUTOPILOT_PERIODS)
    actuators = plant.actuators
    navigation, battery, wind = aircraft.navigation, aircraft.battery, vehicle.wind
    along = inflow(plant.body, wind)
    power = drawn_power(actuators, along, a)
    landed = law.regime is Regime.GROUND
    last = vehicle.jumps[-1] if vehicle.jumps else None
    mission = autopilot.mission
    return VehicleSnapshot(
        time=vehicle.time,
        p=believed.position,
        v=believed.velocity,
        q=believed.attitude,
        rates=believed.rates,
        plant=plant,
        navigation=navigation,
        readings=readings_of(vehicle.avionics, vehicle.periods),
        has_position=navigation.is_aligned and navigation.position_age <= autopilot.settings.position_timeout,
        has_tube=bool(vehicle.tuning.pitot),
        airframe=a,
        inertial=mean.reading if mean else None,
        inertial_age=mean.age if mean else 0.0,
        wind=wind,
        wind_estimate=believed.wind,
        wind_deviation=vehicle.wind_deviation,
        cross_track=cross_track(vehicle),
        motor=(actuators.left_motor, actuators.right_motor),
        motor_command=(command.left_motor, command.right_motor),
        elevon=(actuators.left_elevon, actuators.right_elevon),
        elevon_command=(command.left_elevon, command.right_elevon),
        limits=Limit(0 if landed else vehicle.limits),
        saturation=Saturation(vehicle.saturation),
        law=law,
        regime=regime(vehicle),
        way_of_flying=aircraft.way_of_flying,
        last_law=last.source if last else Law.LANDED,
        last_reason=last.reason if last else Reason.NONE,
        jumps=len(vehicle.jumps),
        v_hover=None if landed else vehicle.v_hover,
        v_forward=v_forward(vehicle),
        v_attitude=v_attitude(vehicle),
        v_enter=vehicle.design.thresholds.v_enter,
        v_leave=vehicle.design.thresholds.v_leave,
        v_forward_enter=vehicle.tuning.v_forward_enter,
        v_forward_leave=vehicle.tuning.v_forward_leave,
        governor=governor(vehicle),
        power=power,
        energy=vehicle.energy,
        energy_by_law=dict(vehicle.energy_by_law),
        battery=battery,
        battery_reading=vehicle.avionics.battery_reading(battery, power, vehicle.periods),
        reference=autopilot.reference,
        mode=autopilot.mode,
        armed=autopilot.armed,
        landed=landed,
        landing=autopilot.landing,
        taking_off=autopilot.mode is Mode.TAKEOFF,
        ready=not autopilot.arming.failed_checks(),
        critical=autopilot.failsafes.is_critical,
        terminated=bool(autopilot.terminated),
        thrust=thrusts(actuators, along, a),
        motor_min=a.omega_min,
        motor_max=a.omega_max,
        elevon_max=a.delta_max,
        frame=autopilot.world.frame,
        home=autopilot.world.home,
        return_altitude=autopilot.settings.return_altitude,
        mission_count=len(mission.items) if mission else 0,
        mission_current=mission.current if mission else 0,
        mission_state=mission_state(aircraft.autopilot),
        fence=replace(autopilot.failsafes.fence),
        fenced=autopilot.world.fence != Fence(),
        camera=replace(autopilot.camera),
        intended=intended,
        flight=flight,
        control=control,
        autopilot_type=autopilot_type,
        flight_plan=autopilot.flight_plan.status(),
        plan_name=_plan_name(autopilot),
        arena=autopilot.world.arena,
    )


def _plan_name(autopilot: Autopilot) -> str:
    executor = autopilot.flight_plan.executor
    return "" if executor is None else executor.plan.name


def mission_state(autopilot: Autopilot) -> int:
    """MISSION_STATE of the mission that is loaded."""
    mission = autopilot.mission
    if mission is None:
        return int(mavlink.MISSION_STATE_NO_MISSION)
    if mission.finished:
        return int(mavlink.MISSION_STATE_COMPLETE)
    if autopilot.mode is Mode.MISSION and autopilot.flying:
        return int(mavlink.MISSION_STATE_ACTIVE)
    begun = mission.begun or mission.current > 0
    return int(mavlink.MISSION_STATE_PAUSED if begun else mavlink.MISSION_STATE_NOT_STARTED)
