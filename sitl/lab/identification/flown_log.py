"""Excitation of an airframe: the reference that tells its parameters, flown, and the log of it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.tlog import TlogWriter
from protocol.wire.codec import Codec
from sitl import Airframe, Array, Law, Reference, Simulation, SitlError, Start, Vector, along, hover_at, leg
from sitl.control.reference import Point
from sitl.lab.identification import rotations
from sitl.lab.identification.flight_log import FLIP_SIGNS
from sitl.lab.identification.replay import accelerations
from sitl.lab.identification.unknowns import unknowns_of, with_values

# The excitation flown in simulation, and its log as noisy sensors would have made it.

# A flight that tells all: steps of place, height and heading in the hover, then a weave of legs in forward flight.
#
# The vehicle's own laws fly it; only references change. Each step of a reference is answered by all actuators, and the
# turns to either side, climbs and airspeeds come in different orders, so that their effects can be told apart.


EXCITATION_HEIGHT = 60.0  # of the hover [m]
HOVER_SPEED = 4.0  # [m/s]
HOVER_STEP_TIME, LEG_STEP_TIME, ENTRY_TIME, STOP_TIME = 2.5, 3.0, 6.0, 8.0  # of each step [s]
LEG_REACH = 200.0  # longer than what is flown of one [m]
DEEPEST = 10.0  # below the first height that the last hover may be [m]


class HoverStep(NamedTuple):
    """One place to hover at, from where the flight began."""

    offset: Point  # world NWU [m]
    heading: float  # [deg]


class LegStep(NamedTuple):
    """One leg from wherever the vehicle is."""

    turn: float  # to the left of the leg before [deg]
    slope: float  # of its climb [-]
    airspeed: float  # [m/s]


HOVER_STEPS = (
    HoverStep((3.0, 0.0, 0.0), 0.0),
    HoverStep((3.0, 3.0, 2.0), 60.0),
    HoverStep((-3.0, 3.0, -2.0), 150.0),
    HoverStep((0.0, -3.0, 2.0), -120.0),
    HoverStep((-3.0, 0.0, -2.0), -30.0),
    HoverStep((3.0, 0.0, 0.0), 0.0),
    HoverStep((0.0, 0.0, 0.0), 0.0),
)
LEG_STEPS = (
    LegStep(0.0, 0.0, 14.0),
    LegStep(25.0, 0.04, 14.0),
    LegStep(-25.0, -0.04, 14.0),
    LegStep(30.0, 0.04, 17.0),
    LegStep(30.0, -0.04, 17.0),
    LegStep(-20.0, 0.04, 15.0),
    LegStep(40.0, -0.04, 15.0),
    LegStep(40.0, 0.04, 12.0),
    LegStep(-20.0, -0.04, 12.0),
    LegStep(40.0, 0.04, 13.0),
    LegStep(40.0, -0.04, 16.0),
    LegStep(-20.0, 0.04, 16.0),
    LegStep(30.0, -0.04, 14.0),
    LegStep(40.0, 0.04, 14.0),
    LegStep(30.0, -0.04, 18.0),
)


class ReferenceStep(NamedTuple):
    """A reference and how long it is kept [s]."""

    reference: Reference
    seconds: float


class Excitation:
    """The references of the flight, one after the other.

    Args:
        hover: Steps in the hover.
        legs: Steps in forward flight; none: it stays in the hover.
    """

    def __init__(self, hover: Sequence[HoverStep] = HOVER_STEPS, legs: Sequence[LegStep] = LEG_STEPS) -> None:
        self._hover, self._legs = hover, legs
        self.position = Vector(0.0, 0.0, EXCITATION_HEIGHT)  # of the vehicle: whoever flies keeps it up to date

    def steps(self) -> Iterator[ReferenceStep]:
        """Each step, made when the one before has been flown."""
        place = hover_at((0.0, 0.0, EXCITATION_HEIGHT), 0.0)
        for step in self._hover:
            x, y, z = step.offset
            place = hover_at((x, y, EXCITATION_HEIGHT + z), math.radians(step.heading), HOVER_SPEED)
            yield ReferenceStep(place, HOVER_STEP_TIME)
        heading = 0.0
        for number, one in enumerate(self._legs):
            heading += math.radians(one.turn)
            here = self.position
            ahead = (LEG_REACH * math.cos(heading), LEG_REACH * math.sin(heading), LEG_REACH * one.slope)
            there = (here.x + ahead[0], here.y + ahead[1], here.z + ahead[2])
            path = leg(here, there, one.airspeed)
            yield ReferenceStep(along(place, path, heading), LEG_STEP_TIME if number else ENTRY_TIME)
        if self._legs:
            here = self.position
            end = (here.x, here.y, max(here.z, EXCITATION_HEIGHT - DEEPEST))
            yield ReferenceStep(hover_at(end, heading, HOVER_SPEED), STOP_TIME)


LOG_STEP = 0.002  # between commands: every one that the vehicle makes [s]
OFTEN, SELDOM = 2, 10  # of which one has the IMU, and one attitude and motion
LOG_BEGIN = 1_700_000_000_000_000  # of every such log: one seed is one file, to the byte [us]


class LoggedNoise(NamedTuple):
    """Of the sensors: white, and constant biases drawn evenly up to a bound."""

    gyro: float = 0.005  # [rad/s]
    gyro_bias: float = 0.02
    accelerometer: float = 0.3  # [m/s2]
    accelerometer_bias: float = 0.2
    attitude: float = math.radians(0.5)  # per axis [rad]
    position: float = 0.02  # [m]
    velocity: float = 0.05  # [m/s]


class FlownTruth(NamedTuple):
    """A flight as it was, one row per sample."""

    time: Array  # (n,) [s]
    body: Array  # position, velocity, attitude, body rates, (n, 13)
    command: Array  # (n, 4)
    force: Array  # specific, body FLU, (n, 3) [m/s2]
    crashed: bool


def off_airframe(base: Airframe, share: float, seed: int) -> Airframe:
    """The airframe with its mass and all that a flight may tell off by a share, up or down by the seed."""
    random = np.random.default_rng(seed)
    values = {"m": base.m} | {u.key: getattr(base, u.key) for u in unknowns_of(base) if hasattr(base, u.key)}
    kept = {"omega_rate", "delta_rate"}
    signs = random.choice((-1.0, 1.0), len(values))
    moved = {k: v * (1.0 + share * sign) for (k, v), sign in zip(values.items(), signs, strict=True) if k not in kept}
    return with_values(base, moved)


def fly_excitation(
    true: Airframe,
    design_model: Airframe,
    *,
    seed: int = 1,
    wind: tuple[float, float] = (0.0, 0.0),
    gusts: float = 0.0,
    excitation: Excitation | None = None,
) -> FlownTruth:
    """Fly the excitation, to its end or to the crash.

    Args:
        true: The airframe as it is.
        design_model: The airframe as the controller believes it to be.
        seed: Of the gusts.
        wind: Velocity of the air, north and west [m/s].
        gusts: Rms per axis [m/s].
        excitation: What is flown.
    """
    vehicle = Simulation(true, seed=seed, design_model=design_model, start=Start(up=EXCITATION_HEIGHT, airborne=True))
    vehicle.set_wind((*wind, 0.0), gusts)
    vehicle.begin_flight(Law.HOVER_ZERO_MOMENT)
    flight = excitation or Excitation()
    rows, winds = [], []
    for step in flight.steps():
        vehicle.reference = step.reference
        for _ in range(round(step.seconds / LOG_STEP)):
            if vehicle.crash is not None:
                break
            plant, command = vehicle.truth, vehicle.command
            body = plant.body
            state = (*body.position, *body.velocity, *body.attitude, *body.rates)
            rows.append((vehicle.time, *state, *command, *plant.actuators))
            winds.append(vehicle.wind)
            vehicle.step(LOG_STEP)
        flight.position = vehicle.truth.body.position
    table = np.array(rows)
    states, commands, actuators = (np.ascontiguousarray(part) for part in np.split(table[:, 1:], [13, 17], axis=1))
    R = rotations.matrices(states[:, 6:10])
    through_air = np.einsum("ijk,ij->ik", R, states[:, 3:6] - np.array(winds))
    force, _ = accelerations(through_air, np.ascontiguousarray(states[:, 10:]), actuators, true)
    return FlownTruth(table[:, 0], states, commands, force, vehicle.crash is not None)


def write_log(flown: FlownTruth, path: Path, a: Airframe, *, seed: int = 1, noise: LoggedNoise | None = None) -> None:
    """Write HIGHRES_IMU, DARKO_ACTUATORS, ATTITUDE_QUATERNION (hover frame) and LOCAL_POSITION_NED as a telemetry log.

    Args:
        flown: The flight.
        path: Of the log; a file that is there is replaced.
        a: The airframe whose limits DARKO_ACTUATORS tells.
        seed: Of the noise.
        noise: Of the sensors.

    Raises:
        SitlError: The file cannot be written.
    """
    codec = Codec(1, 1)
    try:
        path.unlink(missing_ok=True)
        with TlogWriter.open(path) as writer:
            for number, message in _messages(flown, a, np.random.default_rng(seed), noise or LoggedNoise()):
                writer.write(LOG_BEGIN + round(1e6 * flown.time[number]), codec.encode(message))
    except (OSError, FileError) as error:
        raise SitlError(f"{path}: cannot be written: {error}") from error


def _messages(
    flown: FlownTruth, a: Airframe, random: np.random.Generator, noise: LoggedNoise
) -> list[tuple[int, object]]:
    n = len(flown.time)

    def measured(values: Array, white: float, bias: float = 0.0) -> Array:
        return np.asarray(values + random.uniform(-bias, bias, 3) + white * random.standard_normal((n, 3)))

    gyro = FLIP_SIGNS * rotations.to_hover_frame(measured(flown.body[:, 10:13], noise.gyro, noise.gyro_bias))
    force = measured(flown.force, noise.accelerometer, noise.accelerometer_bias)
    force = FLIP_SIGNS * rotations.to_hover_frame(force)
    position = FLIP_SIGNS * measured(flown.body[:, :3], noise.position)
    velocity = FLIP_SIGNS * measured(flown.body[:, 3:6], noise.velocity)
    off = rotations.of_vector(measured(np.zeros((n, 3)), noise.attitude))
    attitude = rotations.hover_attitudes(rotations.product(off, flown.body[:, 6:10]))
    attitude = attitude * np.array([1.0, 1.0, -1.0, -1.0])
    messages: list[tuple[int, object]] = []
    for i in range(n):
        ms = round(1e3 * flown.time[i])
        messages.append((i, _actuators(ms, flown.command[i].tolist(), a)))
        if i % OFTEN == 0:
            messages.append((i, _imu(1000 * ms, force[i].tolist(), gyro[i].tolist())))
        if i % SELDOM == 0:
            q, p, v = attitude[i].tolist(), position[i].tolist(), velocity[i].tolist()
            messages.append((i, mavlink.MAVLink_attitude_quaternion_message(ms, *q, *gyro[i].tolist())))
            messages.append((i, mavlink.MAVLink_local_position_ned_message(ms, *p, *v)))
    return messages


def _imu(time_usec: int, force: list[float], gyro: list[float]) -> object:
    xacc, yacc, zacc = force
    xgyro, ygyro, zgyro = gyro
    return mavlink.MAVLink_highres_imu_message(
        time_usec=time_usec,
        xacc=xacc,
        yacc=yacc,
        zacc=zacc,
        xgyro=xgyro,
        ygyro=ygyro,
        zgyro=zgyro,
        xmag=0.0,
        ymag=0.0,
        zmag=0.0,
        abs_pressure=0.0,
        diff_pressure=0.0,
        pressure_alt=0.0,
        temperature=0.0,
        fields_updated=0b111111,
    )


def _actuators(ms: int, command: list[float], a: Airframe) -> object:
    unknown = [math.nan, math.nan]
    return mavlink.MAVLink_darko_actuators_message(
        time_boot_ms=ms,
        motor_speed=unknown,
        motor_command=command[:2],
        thrust=unknown,
        elevon=unknown,
        elevon_command=command[2:],
        motor_min=a.omega_min,
        motor_max=a.omega_max,
        elevon_max=a.delta_max,
        limits=0,
        saturation=0,
    )
