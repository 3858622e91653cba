"""Start of a flight, and its state there."""

from __future__ import annotations

from typing import Any, NamedTuple, get_type_hints

from protocol.dialect.vocabulary import Law
from sitl.control import align, handover, hover_attitude, hover_zero_moment, indi, robust_pi, wind_estimator
from sitl.control.estimate import Estimate
from sitl.control.forward_flight import line_of_sight
from sitl.errors import SitlError
from sitl.estimation.sensing import observe
from sitl.model.airframe import Airframe
from sitl.model.ground import (
    FEET,
    STIFFNESS,
    GroundPlane,
    feet_aloft,
    height_over,
    is_touching,
    leaning,
    no_crash,
)
from sitl.model.quaternions import from_euler, hover
from sitl.model.state import Actuators, Body, Plant
from sitl.model.vectors import Vector, add_scaled
from sitl.sensors.draws import PERIOD
from sitl.simulation.flight import (
    Design,
    Flight,
)
from sitl.storage import zero


class Start(NamedTuple):
    """Start of a flight: place, heading, attitude and whether it is airborne, world NWU."""

    north: float = 0.0  # [m]
    west: float = 0.0  # [m]
    up: float = 0.0  # in the air: of the centre of mass; else above where it stands on the ground [m]
    heading: float = 0.0  # [rad]
    attitude: tuple[float, float, float] | None = None  # roll, pitch, yaw (ZYX, NWU) [rad]; None: nose up
    airborne: bool = False

    def plant(self, ground: GroundPlane, a: Airframe) -> Plant:
        """The plant there, at rest, its motors stopped; on the ground it leans with the slope."""
        at, still = Vector(float(self.north), float(self.west), float(self.up)), Vector(0.0, 0.0, 0.0)
        q = hover(float(self.heading)) if self.attitude is None else from_euler(*(float(x) for x in self.attitude))
        if not self.airborne:
            q = leaning(ground, q)
            foot = Vector(at.x, at.y, at.z - height_over(ground, Vector(at.x, at.y, 0.0)))
            at = add_scaled(foot, ground.normal, standing_height(a))
        return Plant(Body(at, still, q, still), Actuators(0.0, 0.0, 0.0, 0.0), feet_aloft())


def grounded(
    flight_type: Any,  # noqa: ANN401 - a register makes its own
    design: Design,
    plant: Plant,
    estimate: Estimate,
    course: float,
    before: Flight,
) -> Flight:
    """The flight of a vehicle at rest under LANDED, disarmed and whole; its energy and time go on.

    Args:
        flight_type: The register's own :class:`~sitl.simulation.flight.Flight`.
        design: The controller.
        plant: Where the vehicle is.
        estimate: What is believed of it.
        course: The heading to hold [rad].
        before: The flight before.
    """
    controller_type = get_type_hints(flight_type)["controller"]
    wind = wind_estimator.start(design.gains.wind)
    states = zero(get_type_hints(controller_type)["states"])._replace(course=course)
    controller = zero(controller_type)._replace(law=int(Law.LANDED), wind=wind, states=states)
    estimate = estimate._replace(wind=wind.wind)
    return Flight(
        plant=plant,
        gust=Vector(0.0, 0.0, 0.0),
        estimate=estimate,
        controller=controller,
        energy=before.energy,
        limits=0,
        periods=before.periods,
        crash=no_crash(),
    )


def perfect_estimate(plant: Plant, ground: GroundPlane, a: Airframe) -> Estimate:
    """Estimate of a vehicle that was just put there: the truth, at rest in calm air."""
    still = Vector(0.0, 0.0, 0.0)
    return observe(plant, still, still, is_touching(plant, ground, a))


def entered(flight: Flight, law: int, design: Design) -> Flight:
    """The flight with a law put in force, the states of all laws beginning from the flight as it is."""
    c, estimate, gains, model = flight.controller, flight.estimate, design.gains, design.a
    states = c.states._replace(
        pointing=hover_zero_moment.start(estimate, gains.zero_moment, model),
        handover=handover.none(),
        steering=hover_attitude.start(estimate, gains.hover_attitude, model),
        hold=align.start_hold(estimate),
        sight=line_of_sight.start(estimate, model),
        increment=indi.start(estimate, model),
        robust_pi=robust_pi.start(estimate, gains.robust_pi),
    )
    return flight._replace(controller=c._replace(law=law, law_time=0.0, states=states))


def whole_periods(seconds: float) -> int:
    """A time as control periods.

    Raises:
        SitlError: If it is not a whole number of them.
    """
    periods = round(seconds / PERIOD)
    if periods < 0 or abs(periods * PERIOD - seconds) > 1e-6 * PERIOD:
        raise SitlError(f"{seconds!r} s is not a whole number of control periods of {PERIOD:g} s")
    return periods


def standing_height(a: Airframe) -> float:
    """Height of the centre of mass of a vehicle standing on its tail [m]."""
    return a.foot_x - a.m * a.g / (FEET * STIFFNESS)
