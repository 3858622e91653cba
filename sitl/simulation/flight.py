"""One control period of the whole closed loop: the flow map of the hybrid system, phase by phase.

The order within a period: the air moves and the sensors read it; the law in force computes commands; the plant
moves under the commands of the period *before*, as on a real autopilot; the estimate is made anew, and the
supervisor looks whether it lies in a jump set. Each phase loads what it needs of a flight's record, works on named
values, and puts back what it changed.
"""

from __future__ import annotations

from typing import NamedTuple

from sitl.compiled import kernel, part, subroutine
from sitl.control import wind_estimator
from sitl.control.estimate import Estimate
from sitl.control.hover_zero_moment import Pointing
from sitl.control.landed import LYING
from sitl.control.laws import Gains, LawStates
from sitl.control.reference import Reference
from sitl.control.wind_estimator import WindState
from sitl.enclosure.solids import touched
from sitl.enclosure.wind_field import Wall, Weather, WindField, blow
from sitl.estimation.sensing import Normals, SensorNoise, observe, read
from sitl.model.actuators import limited, limits
from sitl.model.airframe import Airframe, Array
from sitl.model.arithmetic import rounded
from sitl.model.battery import drawn_power
from sitl.model.ground import (
    SPIN_LEFT,
    Crash,
    GroundPlane,
    crashed,
    height_over,
    impact_speed,
    is_clear,
    is_touching,
)
from sitl.model.gusts import gust_after
from sitl.model.plant import inflow, step_in_air, step_in_swirl, step_near_ground
from sitl.model.quaternions import x_axis
from sitl.model.state import Actuators, Body, Plant
from sitl.model.vectors import Vector, add, norm, scaled, subtract
from sitl.sensors.draws import PERIOD
from sitl.simulation.actuator_faults import ActuatorFaults, failing
from sitl.storage import value_of, writer
from sitl.supervisor.guards import REST_SPEED, Thresholds

SUBSTEPS = 2  # plant steps per control period
LANDED = 0
MIN_TOUCH_SPEED = 0.01  # a touch slower than this counts as one of this speed [m/s]
_FINE, _COARSE = 67108864.0, 1.0 / 67108864.0  # 2**26


class Controller(NamedTuple):
    """All that the controller keeps from one control period to the next."""

    law: int  # in force
    is_armed: bool
    has_crashed: bool  # it hit the ground too fast, and stays where it is
    is_flying: bool  # the autopilot wants to be in the air
    is_landing: bool  # the autopilot wants to touch the ground
    law_time: float  # how long the law has been in force [s]
    at_rest: float  # how long the vehicle has rested on the ground [s]
    inhibited: float  # how long the linear hover law must not be entered yet [s]
    command: Actuators  # of the last period, in force in the next
    saturation: int  # DARKO_SATURATION bits of the last period
    wind: WindState  # of the wind estimator
    states: LawStates


class Environment(NamedTuple):
    """The air, the ground, how well the air is measured, and what fails on board."""

    wind: Vector  # steady, world NWU [m/s]
    gust_rms: float  # per axis [m/s]
    gust_length: float  # [m]
    ground: GroundPlane
    sensors: SensorNoise
    faults: ActuatorFaults


class Design(NamedTuple):
    """The controller as designed: what it believes of the airframe, its gains, and where the supervisor switches."""

    a: Airframe
    gains: Gains
    thresholds: Thresholds


class Flight(NamedTuple):
    """The state of a flight: all that one period hands to the next."""

    plant: Plant
    gust: Vector  # world NWU [m/s]
    estimate: Estimate
    controller: Controller
    energy: float  # of the battery, or at the shafts as the airframe counts it [J]
    limits: int  # DARKO_LIMIT bits seen since they were last cleared
    periods: int  # control periods flown
    crash: Crash  # the first


class Sample(NamedTuple):
    """One row of a recording."""

    periods: int
    body: Body
    actuators: Actuators
    law: int
    v_hover: float  # V of the linear hover law about the reference
    energy: float  # [J]
    wind: Vector  # as estimated, world NWU [m/s]
    pointing: Pointing  # of the zero-moment law, stale while another law flies
    reference: Vector  # position asked for, world NWU [m]


class JumpEntry(NamedTuple):
    """One jump as the loop notes it."""

    periods: int
    source: int
    target: int
    row: int  # of the source's rows in the table
    v_hover: float
    v_forward: float
    energy: float  # [J]


put_plant = writer(Flight, lambda flight: flight.plant)
put_gust = writer(Flight, lambda flight: flight.gust)
put_estimate = writer(Flight, lambda flight: flight.estimate)
put_known_wind = writer(Flight, lambda flight: flight.estimate.wind)
put_wind_state = writer(Flight, lambda flight: flight.controller.wind)
put_has_crashed = writer(Flight, lambda flight: flight.controller.has_crashed)
put_crash = writer(Flight, lambda flight: flight.crash)
put_energy = writer(Flight, lambda flight: flight.energy)
put_limits = writer(Flight, lambda flight: flight.limits)
put_periods = writer(Flight, lambda flight: flight.periods)
put_law_time = writer(Flight, lambda flight: flight.controller.law_time)
put_at_rest = writer(Flight, lambda flight: flight.controller.at_rest)
put_inhibited = writer(Flight, lambda flight: flight.controller.inhibited)
put_touched = writer(WindField, lambda field: field.touched)


@kernel
def quantised(draw: float) -> float:
    """A random draw in steps of 2**-26: the library that makes draws may differ in their last bits by machine."""
    return rounded(draw * _FINE) * _COARSE


@kernel
def gust_now(plant: Plant, gust: Vector, draws: Vector, air: Environment) -> Vector:
    """The gust of this period."""
    airspeed = norm(subtract(subtract(plant.body.velocity, air.wind), gust))
    noise = Vector(quantised(draws.x), quantised(draws.y), quantised(draws.z))
    after = gust_after(gust, noise, air.gust_rms, air.gust_length, airspeed, PERIOD)
    blows = air.gust_rms > 0.0
    return Vector(after.x if blows else gust.x, after.y if blows else gust.y, after.z if blows else gust.z)


@kernel
def update_gust(flight: Flight, air: Environment, normals: Array, row: int) -> None:
    """The gust of this period, by a row of unit normals, (n, 3)."""
    noise = Vector(normals[row, 0], normals[row, 1], normals[row, 2])
    put_gust(flight, gust_now(value_of(flight.plant), value_of(flight.gust), noise, value_of(air)))


@part
def update_field(flight: Flight, air: Environment, field: WindField, wall: Wall, normals: Array, row: int) -> None:
    """The wind field's part of the gust, by a row of unit normals, (n, 4), in place of that of the period before."""
    rest = subtract(value_of(flight.gust), value_of(field.part))
    body = value_of(flight.plant.body)
    weather = Weather(height_over(value_of(air.ground), body.position), value_of(air.wind), flight.periods * PERIOD)
    blow(field, body, weather, wall, normals[row], PERIOD)
    put_gust(flight, add(rest, value_of(field.part)))


@kernel
def update_wind_estimate(
    flight: Flight, air: Environment, design: Design, a: Airframe, normals: Array, row: int
) -> None:
    """The wind estimate after this period's readings, by a row of unit normals, (n, 5)."""
    model, airframe = value_of(design.a), value_of(a)
    noise = Normals(
        north=quantised(normals[row, 0]),
        west=quantised(normals[row, 1]),
        up=quantised(normals[row, 2]),
        normal_force=quantised(normals[row, 3]),
        airspeed=quantised(normals[row, 4]),
    )
    wind = add(value_of(air.wind), value_of(flight.gust))
    readings = read(value_of(flight.plant), wind, noise, value_of(air.sensors), airframe)
    estimate, gains = value_of(flight.estimate), value_of(design.gains.wind)
    known = wind_estimator.update(estimate, readings, gains, model, value_of(flight.controller.wind), PERIOD)
    put_wind_state(flight, known)
    put_known_wind(flight, known.wind)


@kernel
def may_turn(flight: Flight) -> bool:
    """Whether the motors may turn."""
    return flight.controller.is_armed and not flight.controller.has_crashed


@kernel
def within_limits(flight: Flight, command: Actuators, airframe: Airframe) -> Actuators:
    """Positions to which a command sends actuators that work."""
    return limited(command, may_turn(flight), airframe)


@kernel
def as_they_fail(flight: Flight, faults: ActuatorFaults, airframe: Airframe, wanted: Actuators) -> Actuators:
    """Positions to which the same command sends actuators of which some fail."""
    now, period = value_of(flight.plant.actuators), flight.periods
    return failing(wanted, now, faults, may_turn(flight), period, airframe)


@kernel
def move_plant(flight: Flight, air: Environment, a: Airframe, command: Actuators, wanted: Actuators) -> None:
    """The plant one control period later, its energy and limits, and the estimate of it.

    Args:
        flight: The flight.
        air: The environment.
        a: The airframe as it is.
        command: In force during this period.
        wanted: Where that sends the actuators.
    """
    plant, airframe, ground = value_of(flight.plant), value_of(a), value_of(air.ground)
    if is_clear(plant.body, ground):
        move_in_air(flight, air, a, command, wanted)
        return
    wind = add(value_of(air.wind), value_of(flight.gust))
    hit = 0.0
    for _ in range(SUBSTEPS):
        before = plant.body
        plant = step_near_ground(plant, wanted, wind, ground, airframe, PERIOD / SUBSTEPS)
        hit = max(hit, impact_speed(before, plant.body, ground, airframe))
    if hit > airframe.max_contact_speed and not flight.controller.has_crashed:
        put_crash(flight, Crash(hit, plant.body.position))
        put_has_crashed(flight, True)
        plant = crashed(plant, ground, airframe)
    store_motion(flight, plant, command, wind, airframe, is_touching(plant, ground, airframe))


@kernel
def move_in_air(flight: Flight, air: Environment, a: Airframe, command: Actuators, wanted: Actuators) -> None:
    """Move the plant by one control period, out of the ground's reach."""
    plant, airframe = value_of(flight.plant), value_of(a)
    wind = add(value_of(air.wind), value_of(flight.gust))
    plant = step_in_air(plant, wanted, wind, airframe, PERIOD / SUBSTEPS)
    plant = step_in_air(plant, wanted, wind, airframe, PERIOD / SUBSTEPS)
    store_motion(flight, plant, command, wind, airframe, False)


@subroutine
def move_in_swirl(
    flight: Flight, air: Environment, a: Airframe, field: WindField, command: Actuators, wanted: Actuators
) -> None:
    """Move the plant by one control period in a wind field, whose air rotates, above the ground."""
    plant, airframe = value_of(flight.plant), value_of(a)
    wind, rotation = add(value_of(air.wind), value_of(flight.gust)), value_of(field.rotation)
    for _ in range(SUBSTEPS):
        plant = step_in_swirl(plant, wanted, wind, rotation, airframe, PERIOD / SUBSTEPS)
    store_motion(flight, plant, command, wind, airframe, False)


@part
def touch_solids(flight: Flight, a: Airframe, field: WindField, solids: Array) -> None:
    """A vehicle that touches net or obstacle is broken: it stops there, and falls."""
    plant = value_of(flight.plant)
    number = 0 if flight.controller.has_crashed else touched(plant.body, value_of(a), solids)
    if number > 0:
        body = plant.body
        put_touched(field, number)
        put_crash(flight, Crash(max(norm(body.velocity), MIN_TOUCH_SPEED), body.position))
        put_has_crashed(flight, True)
        sinking = Vector(0.0, 0.0, min(body.velocity.z, 0.0))
        stopped = Body(body.position, sinking, body.attitude, scaled(body.rates, SPIN_LEFT))
        put_plant(flight, Plant(stopped, plant.actuators, plant.feet))


@kernel
def store_motion(flight: Flight, plant: Plant, command: Actuators, wind: Vector, a: Airframe, on_ground: bool) -> None:
    """Put the moved plant in place of the one before."""
    before = value_of(flight.plant)
    met = limits(before.actuators, command, may_turn(flight), PERIOD / SUBSTEPS, a)
    put_limits(flight, flight.limits | met)
    power = drawn_power(plant.actuators, inflow(plant.body, wind), a)
    put_energy(flight, flight.energy + power * PERIOD)
    change = scaled(subtract(plant.body.velocity, before.body.velocity), 1.0 / PERIOD)
    put_plant(flight, plant)
    put_estimate(flight, observe(plant, change, value_of(flight.estimate.wind), on_ground))
    put_periods(flight, flight.periods + 1)


@kernel
def run_timers(flight: Flight) -> None:
    """The controller's timers run."""
    estimate = value_of(flight.estimate)
    put_law_time(flight, flight.controller.law_time + PERIOD)
    lies = x_axis(estimate.attitude).z < LYING
    rests = flight.controller.law != LANDED and (flight.controller.is_landing or lies) and estimate.on_ground
    rests = rests and abs(estimate.velocity.z) < REST_SPEED
    put_at_rest(flight, flight.controller.at_rest + PERIOD if rests else 0.0)
    put_inhibited(flight, max(flight.controller.inhibited - PERIOD, 0.0))


@kernel
def sample_of(flight: Flight, reference: Reference, v_hover: float) -> Sample:
    """The recording's row of now."""
    plant = value_of(flight.plant)
    return Sample(
        periods=flight.periods,
        body=plant.body,
        actuators=plant.actuators,
        law=flight.controller.law,
        v_hover=v_hover,
        energy=flight.energy,
        wind=value_of(flight.estimate.wind),
        pointing=value_of(flight.controller.states.pointing),
        reference=value_of(reference.position),
    )
