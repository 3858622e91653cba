"""One control period of the whole closed loop: the flow map of the hybrid system, phase by phase.

The order within a period: the air moves and the sensors read it; the law in force computes commands; the plant
moves under the commands of the period *before*, as on a real autopilot; the estimate is made anew, and the
supervisor looks whether it lies in a jump set. Each phase takes a flight out of a record or a block, works on named
values, and puts back what it changed: one text for single flights and batches.
"""

from __future__ import annotations

from typing import NamedTuple

from sitl.compiled import kernel, part, subroutine
from sitl.control import wind_estimator
from sitl.control.estimate import Estimate
from sitl.control.hover_zero_moment import Pointing
from sitl.control.landed import LYING
from sitl.control.laws import Gains
from sitl.control.reference import Reference
from sitl.enclosure.solids import touched
from sitl.enclosure.wind_field import WindField, blow, get_part, get_rotation
from sitl.estimation.sensing import Normals, SensorNoise, read
from sitl.estimation.truth import observe
from sitl.model.actuators import limited, limits
from sitl.model.airframe import REPORT, SHAFT, Airframe, Array
from sitl.model.arithmetic import rounded
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
from sitl.model.propeller import drawn_power
from sitl.model.quaternions import x_axis
from sitl.model.state import Actuators, Body, Plant
from sitl.model.vectors import Vector, add, norm, scaled, subtract
from sitl.simulation.actuator_faults import ActuatorFaults, failing
from sitl.storage import Kept, access, replacing
from sitl.supervisor.controller import Controller
from sitl.supervisor.guards import REST_SPEED, Thresholds
from sitl.timing import PERIOD

SUBSTEPS = 2  # plant steps per control period
LANDED = 0
MIN_TOUCH_SPEED = 0.01  # a touch slower than this counts as one of this speed [m/s]
_FINE, _COARSE = 67108864.0, 1.0 / 67108864.0  # 2**26


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


get_air = access(Environment).get
get_steady_wind, get_sensor_noise = access(Environment, "wind").get, access(Environment, "sensors").get
get_ground = access(Environment, "ground").get
get_airframe = access(Airframe).get
with_aerodynamics = replacing(Airframe, "aerodynamics")
with_energy_account = replacing(Airframe, "energy_account")
get_model = access(Design, "a").get
get_plant, put_plant = access(Flight, "plant")
get_gust, put_gust = access(Flight, "gust")
get_estimate, put_estimate = access(Flight, "estimate")
get_wind_state, put_wind_state = access(Flight, "controller.wind")
get_known_wind, put_known_wind = access(Flight, "estimate.wind")
get_wind_gains = access(Design, "gains.wind").get
get_is_armed = access(Flight, "controller.is_armed").get
get_has_crashed, put_has_crashed = access(Flight, "controller.has_crashed")
put_crash = access(Flight, "crash").put
get_energy, put_energy = access(Flight, "energy")
get_limits, put_limits = access(Flight, "limits")
get_periods, put_periods = access(Flight, "periods")
get_law = access(Flight, "controller.law").get
get_is_landing = access(Flight, "controller.is_landing").get
get_law_time, put_law_time = access(Flight, "controller.law_time")
get_at_rest, put_at_rest = access(Flight, "controller.at_rest")
get_inhibited, put_inhibited = access(Flight, "controller.inhibited")
get_position = access(Reference, "position").get
get_pointing = access(Flight, "controller.states.pointing").get
put_touched = access(WindField, "touched").put


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
def as_reported(a: Airframe) -> Airframe:
    """An airframe of the report's kind, as code that is compiled for no other kind: it branches nowhere."""
    return with_energy_account(with_aerodynamics(a, REPORT), SHAFT)


@kernel
def is_as_reported(a: Airframe) -> bool:
    """Whether an airframe is of the report's kind."""
    return a.aerodynamics == REPORT and a.energy_account == SHAFT


@kernel
def update_gust(flight: Kept, column: int, air: Kept, gusts: Array, row: int) -> None:
    """The gust of this period, by draws (n, 3, columns), none where n is 0."""
    if gusts.shape[0] > 0:
        draws = Vector(gusts[row, 0, column], gusts[row, 1, column], gusts[row, 2, column])
        gust = gust_now(get_plant(flight, column), get_gust(flight, column), draws, get_air(air, column))
        put_gust(flight, column, gust)


@part
def update_field(
    flight: Kept, column: int, air: Kept, field: Kept, schedule: Array, bursts: Array, swirls: Array, row: int
) -> None:
    """The wind field's part of the gust of this period, by draws (n, 4), in place of that of the period before."""
    rest = subtract(get_gust(flight, column), get_part(field, 0))
    body, time = get_plant(flight, column).body, get_periods(flight, column) * PERIOD
    height = height_over(get_ground(air, column), body.position)
    blow(field, body, height, get_steady_wind(air, column), time, swirls[row], schedule, bursts, PERIOD)
    put_gust(flight, column, add(rest, get_part(field, 0)))


@kernel
def update_wind_estimate(flight: Kept, column: int, air: Kept, design: Kept, a: Kept, draws: Array, row: int) -> None:
    """The wind estimate after this period's readings, by draws (n, 5, columns)."""
    model, airframe = get_model(design, column), get_airframe(a, column)
    sense(flight, column, air, design, model, airframe, draws, row)


@kernel
def sense(
    flight: Kept,
    column: int,
    air: Kept,
    design: Kept,
    model: Airframe,
    airframe: Airframe,
    draws: Array,
    row: int,
) -> None:
    """Update the wind estimate with both airframes given: as the vehicle knows it, and as it is."""
    noise = Normals(
        quantised(draws[row, 0, column]),
        quantised(draws[row, 1, column]),
        quantised(draws[row, 2, column]),
        quantised(draws[row, 3, column]),
        quantised(draws[row, 4, column]),
    )
    wind = add(get_steady_wind(air, column), get_gust(flight, column))
    readings = read(get_plant(flight, column), wind, noise, get_sensor_noise(air, column), airframe)
    known = wind_estimator.update(
        get_estimate(flight, column),
        readings,
        get_wind_gains(design, column),
        model,
        get_wind_state(flight, column),
        PERIOD,
    )
    put_wind_state(flight, column, known)
    put_known_wind(flight, column, known.wind)


@kernel
def may_turn(flight: Kept, column: int) -> bool:
    """Whether the motors may turn."""
    return get_is_armed(flight, column) and not get_has_crashed(flight, column)


@kernel
def within_limits(flight: Kept, column: int, command: Actuators, airframe: Airframe) -> Actuators:
    """Positions to which a command sends actuators that work."""
    return limited(command, may_turn(flight, column), airframe)


@kernel
def as_they_fail(flight: Kept, column: int, faults: ActuatorFaults, airframe: Airframe, wanted: Actuators) -> Actuators:
    """Positions to which the same command sends actuators of which some fail."""
    now, period = get_plant(flight, column).actuators, get_periods(flight, column)
    return failing(wanted, now, faults, may_turn(flight, column), period, airframe)


@kernel
def move_plant(flight: Kept, column: int, air: Kept, a: Kept, command: Actuators, wanted: Actuators) -> None:
    """The plant one control period later, its energy and limits, and the estimate of it.

    Args:
        flight: The flight.
        column: In its block.
        air: The environment.
        a: The airframe as it is.
        command: In force during this period.
        wanted: Where that sends the actuators.
    """
    plant, airframe, ground = get_plant(flight, column), get_airframe(a, column), get_ground(air, column)
    if is_clear(plant.body, ground):
        move_in_air(flight, column, air, a, command, wanted)
        return
    wind = add(get_steady_wind(air, column), get_gust(flight, column))
    hit = 0.0
    for _ in range(SUBSTEPS):
        before = plant.body
        plant = step_near_ground(plant, wanted, wind, ground, airframe, PERIOD / SUBSTEPS)
        hit = max(hit, impact_speed(before, plant.body, ground, airframe))
    if hit > airframe.max_contact_speed and not get_has_crashed(flight, column):
        put_crash(flight, column, Crash(hit, plant.body.position))
        put_has_crashed(flight, column, True)
        plant = crashed(plant, ground, airframe)
    store_motion(flight, column, plant, command, wind, airframe, is_touching(plant, ground, airframe))


@kernel
def move_in_air(flight: Kept, column: int, air: Kept, a: Kept, command: Actuators, wanted: Actuators) -> None:
    """Move the plant by one control period, out of the ground's reach."""
    plant, airframe = get_plant(flight, column), get_airframe(a, column)
    wind = add(get_steady_wind(air, column), get_gust(flight, column))
    plant = step_in_air(plant, wanted, wind, airframe, PERIOD / SUBSTEPS)
    plant = step_in_air(plant, wanted, wind, airframe, PERIOD / SUBSTEPS)
    store_motion(flight, column, plant, command, wind, airframe, False)


@subroutine
def move_in_swirl(
    flight: Kept, column: int, air: Kept, a: Kept, field: Kept, command: Actuators, wanted: Actuators
) -> None:
    """Move the plant by one control period in a wind field, whose air rotates, above the ground."""
    plant, airframe = get_plant(flight, column), get_airframe(a, column)
    wind, rotation = add(get_steady_wind(air, column), get_gust(flight, column)), get_rotation(field, 0)
    for _ in range(SUBSTEPS):
        plant = step_in_swirl(plant, wanted, wind, rotation, airframe, PERIOD / SUBSTEPS)
    store_motion(flight, column, plant, command, wind, airframe, False)


@part
def touch_solids(flight: Kept, column: int, a: Kept, field: Kept, solids: Array) -> None:
    """A vehicle that touches net or obstacle is broken: it stops there, and falls."""
    plant = get_plant(flight, column)
    number = 0 if get_has_crashed(flight, column) else touched(plant.body, get_airframe(a, column), solids)
    if number > 0:
        body = plant.body
        put_touched(field, 0, number)
        put_crash(flight, column, Crash(max(norm(body.velocity), MIN_TOUCH_SPEED), body.position))
        put_has_crashed(flight, column, True)
        sinking = Vector(0.0, 0.0, min(body.velocity.z, 0.0))
        stopped = Body(body.position, sinking, body.attitude, scaled(body.rates, SPIN_LEFT))
        put_plant(flight, column, Plant(stopped, plant.actuators, plant.feet))


@kernel
def glide(flight: Kept, column: int, air: Kept, airframe: Airframe, command: Actuators) -> None:
    """Move the plant out of the ground's reach, its actuators working: written out, so it becomes vector code."""
    plant = get_plant(flight, column)
    wind = add(get_steady_wind(air, column), get_gust(flight, column))
    wanted = limited(command, may_turn(flight, column), airframe)
    plant = step_in_air(plant, wanted, wind, airframe, PERIOD / SUBSTEPS)
    plant = step_in_air(plant, wanted, wind, airframe, PERIOD / SUBSTEPS)
    store_motion(flight, column, plant, command, wind, airframe, False)


@kernel
def store_motion(
    flight: Kept, column: int, plant: Plant, command: Actuators, wind: Vector, a: Airframe, on_ground: bool
) -> None:
    """Put the moved plant in place of the one before."""
    before = get_plant(flight, column)
    met = limits(before.actuators, command, may_turn(flight, column), PERIOD / SUBSTEPS, a)
    put_limits(flight, column, get_limits(flight, column) | met)
    power = drawn_power(plant.actuators, inflow(plant.body, wind), a)
    put_energy(flight, column, get_energy(flight, column) + power * PERIOD)
    change = scaled(subtract(plant.body.velocity, before.body.velocity), 1.0 / PERIOD)
    put_plant(flight, column, plant)
    put_estimate(flight, column, observe(plant, change, get_known_wind(flight, column), on_ground))
    put_periods(flight, column, get_periods(flight, column) + 1)


@kernel
def run_timers(flight: Kept, column: int) -> None:
    """The controller's timers run."""
    estimate = get_estimate(flight, column)
    put_law_time(flight, column, get_law_time(flight, column) + PERIOD)
    lies = x_axis(estimate.attitude).z < LYING
    rests = get_law(flight, column) != LANDED and (get_is_landing(flight, column) or lies) and estimate.on_ground
    rests = rests and abs(estimate.velocity.z) < REST_SPEED
    put_at_rest(flight, column, get_at_rest(flight, column) + PERIOD if rests else 0.0)
    put_inhibited(flight, column, max(get_inhibited(flight, column) - PERIOD, 0.0))


@kernel
def sample_of(flight: Kept, column: int, reference: Kept, v_hover: float) -> Sample:
    """The recording's row of now."""
    plant = get_plant(flight, column)
    return Sample(
        get_periods(flight, column),
        plant.body,
        plant.actuators,
        get_law(flight, column),
        v_hover,
        get_energy(flight, column),
        get_known_wind(flight, column),
        get_pointing(flight, column),
        get_position(reference, column),
    )
