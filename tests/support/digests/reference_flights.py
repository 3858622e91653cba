"""Nineteen flights under all twelve laws: ground and air, calm and gusts, right and wrong airframes; as data."""

from collections.abc import Callable
from typing import NamedTuple

from protocol.dialect.vocabulary import Law
from sitl.control.reference import AttitudeReference, along, circle, hover_at, leg, steer
from sitl.model.airframe import FIRST_ORDER
from sitl.model.airframe_files import load
from sitl.model.quaternions import from_euler, hover, multiply
from sitl.model.state import Actuators, Body
from sitl.model.vectors import Vector
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import CONTROLLERS, Tuning
from tests.support.flights.tunings import BY_REPORT

NOMINAL = load("nominal").parameters  # as the controllers of all of them believe it to be
LAGGING = NOMINAL._replace(actuator_model=FIRST_ORDER)
HEAVY = NOMINAL._replace(m=1.06 * NOMINAL.m, J2=0.93 * NOMINAL.J2, C_l=0.95 * NOMINAL.C_l, k_f=1.04 * NOMINAL.k_f)
HIGH = 60.0  # where flights begin that begin in the air [m]
SHORT = 0.12  # [s]; every law is in force in the first of it
STILL = Vector(0.0, 0.0, 0.0)
BY_INCREMENTS = Tuning(controller=CONTROLLERS["indi"])
BY_OUTPUTS = Tuning(controller=CONTROLLERS["robust-pi"])

Deed = Callable[[Simulation], None]


class Ask(NamedTuple):
    """Something done to a flight."""

    time: float  # [s]
    do: Deed


class ReferenceFlight(NamedTuple):
    """One flight: how it begins, and what is asked of it."""

    name: str
    begin: Callable[[], Simulation]
    asks: tuple[Ask, ...] = ()
    seconds: float = 12.0


# How flights begin


def hovering(law, *, wind=(0.0, 0.0, 0.0), gusts=0.0, airframe=NOMINAL, seed=1, tuning=BY_REPORT):
    """In the hover, upright and at rest."""
    start = Start(up=HIGH, heading=0.4, airborne=True)
    made = Simulation(airframe, seed=seed, start=start, design_model=NOMINAL, tuning=tuning)
    made.set_wind(wind, gusts)
    made.begin_flight(law)
    return made


def standing(**choice):
    """On the ground, motors off."""
    made = Simulation(NOMINAL, start=Start(north=2.0, west=-1.0, heading=-2.0), **{"tuning": BY_REPORT, **choice})
    made.set_wind((1.5, -1.0, 0.0), 0.4)
    return made


def thrown(law, attitude, velocity, rates=STILL, actuators=None, up=HIGH, **choice):
    """In any motion."""
    made = hovering(law, **choice)
    body = Body(Vector(0.0, 0.0, up), Vector(*velocity), from_euler(*attitude), rates)
    made.place(body, actuators)
    made.enter(law)
    return made


def winged(law, **choice):
    """Northwards at 15 m/s, very nearly trimmed."""
    trim = Actuators(354.1, 354.1, 0.1297, 0.1297)
    return thrown(law, (0.0, -0.2139, 0.0), (15.0, 0.0, 0.0), actuators=trim, **choice)


# What is asked


def hold(north, west, up, heading=0.4):
    """Hover somewhere."""

    def ask(flight):
        flight.reference = hover_at((north, west, up), heading)

    return ask


def fly_leg(end, airspeed, *, start=(0.0, 0.0, HIGH), stop=True):
    """Fly a leg on the wing."""

    def ask(flight):
        flight.reference = along(hover_at(start, 0.4), leg(start, end, airspeed, stop=stop), 0.4)

    return ask


def fly_circle(centre, radius, airspeed):
    """Circle on the wing."""

    def ask(flight):
        flight.reference = along(hover_at(centre, 0.4), circle(centre, radius, airspeed), 0.4)

    return ask


def tilt(*angles, rates=STILL, thrust=0.45):
    """Fly an attitude, told by angles from upright."""

    def ask(flight):
        attitude = multiply(hover(0.4), from_euler(*angles))
        here = hover_at(flight.estimate.position, 0.4)
        flight.reference = steer(here, AttitudeReference(attitude, rates, thrust))

    return ask


def wind(*velocity, gusts=0.0):
    """The wind changes."""
    return lambda flight: flight.set_wind(velocity, gusts)


def start(north, west, up):
    """Take off to a place."""

    def ask(flight):
        flight.armed = flight.flying = True
        hold(north, west, up)(flight)

    return ask


def land(north, west):
    """Come down."""

    def ask(flight):
        flight.landing = True
        hold(north, west, -1.0)(flight)

    return ask


def disarm(flight):
    """Stop the motors, wherever it is."""
    flight.armed = False


LINEAR, ZERO_MOMENT = Law.HOVER_LINEAR, Law.HOVER_ZERO_MOMENT
SIGHT, WING = Law.FORWARD_LINE_OF_SIGHT, Law.FORWARD_LINEAR
FAR = (150.0, 30.0, HIGH + 5.0)
FLIGHTS = (
    ReferenceFlight(
        "hold and move in gusts, then in a storm",
        lambda: hovering(LINEAR, wind=(2.0, -1.0, 0.0), gusts=0.7),
        (Ask(3.0, hold(4.0, -3.0, HIGH + 2.0)), Ask(6.0, wind(-9.0, 2.0, 0.0, gusts=0.7))),
    ),
    ReferenceFlight(
        "recover from a throw, and fly to a far place",
        lambda: thrown(ZERO_MOMENT, (0.5, -0.4, 0.8), (2.0, 3.0, -1.0), Vector(2.0, -3.0, 1.0)),
        (Ask(0.0, hold(12.0, 9.0, HIGH + 3.0)),),
    ),
    ReferenceFlight(
        "take off, land, stay",
        standing,
        (Ask(0.4, start(1.0, 0.0, 2.5)), Ask(5.0, land(1.0, 0.0)), Ask(11.0, disarm)),
    ),
    ReferenceFlight(
        "stand with the motors on, start, and fall as they stop",
        standing,
        (Ask(0.1, start(2.0, -1.0, 4.0)), Ask(3.0, disarm)),
        6.0,
    ),
    ReferenceFlight(
        "from the hover over a leg to a hover",
        lambda: hovering(LINEAR, wind=(1.0, 2.0, 0.0), seed=4),
        (Ask(0.0, fly_leg((70.0, 10.0, HIGH + 5.0), 12.0)),),
        18.0,
    ),
    ReferenceFlight(
        "the same in gusts, recalled",
        lambda: hovering(LINEAR, wind=(-2.0, 0.0, 0.0), gusts=1.0, seed=5),
        (Ask(0.0, fly_leg(FAR, 15.0)), Ask(7.0, hold(60.0, 0.0, HIGH))),
        18.0,
    ),
    ReferenceFlight(
        "tip over and go on",
        lambda: thrown(Law.TO_FORWARD, (0.0, -1.2, 0.0), (5.0, 0.0, 0.0), wind=(0.0, 1.0, 0.0), gusts=0.3),
        (Ask(0.0, fly_leg(FAR, 14.0, stop=False)),),
    ),
    ReferenceFlight(
        "on the wing along a leg, then into a circle",
        lambda: winged(WING, gusts=0.5),
        (Ask(0.0, fly_leg(FAR, 15.0, stop=False)), Ask(4.0, fly_circle((70.0, 60.0, HIGH), 45.0, 15.0))),
    ),
    ReferenceFlight(
        "a circle the other way",
        lambda: winged(SIGHT, wind=(0.0, -3.0, 0.0)),
        (Ask(0.0, fly_circle((0.0, -50.0, HIGH - 4.0), -50.0, 14.0)),),
    ),
    ReferenceFlight("brake at once", lambda: winged(Law.TO_HOVER), (Ask(0.0, hold(30.0, 0.0, HIGH)),)),
    ReferenceFlight(
        "attitudes and thrusts",
        lambda: hovering(LINEAR, gusts=0.3, seed=6),
        (
            Ask(0.0, tilt(0.2, -0.1, 0.0)),
            Ask(2.0, tilt(-0.1, 0.2, 0.3, rates=Vector(0.3, 0.0, 0.1), thrust=0.5)),
            Ask(4.0, hold(0.0, 0.0, HIGH)),
        ),
        9.0,
    ),
    ReferenceFlight(
        "caught in a fall",
        lambda: thrown(Law.FAILSAFE, (2.5, 0.4, 0.3), (3.0, 0.0, -15.0), Vector(3.0, 2.0, -1.0)),
        (Ask(0.0, hold(0.0, 0.0, HIGH)),),
    ),
    ReferenceFlight(
        "a fall that nobody expects",
        lambda: thrown(LINEAR, (-0.5, 1.2, 0.0), (0.0, 0.0, -16.0)),
        (Ask(0.0, hold(0.0, 0.0, HIGH)),),
        6.0,
    ),
    ReferenceFlight(
        "hit the ground, and lie there",
        lambda: thrown(ZERO_MOMENT, (0.5, 0.9, 0.0), (2.0, 0.0, -10.0), Vector(1.0, 2.0, -1.0), up=1.0),
        (Ask(0.0, hold(0.0, 0.0, HIGH)),),
        3.0,
    ),
    ReferenceFlight(
        "actuators of first order on a leg",
        lambda: hovering(ZERO_MOMENT, airframe=LAGGING, gusts=0.4, seed=7),
        (Ask(0.0, fly_leg((80.0, -20.0, HIGH), 12.0)),),
        16.0,
    ),
    ReferenceFlight(
        "a vehicle that is not as it was designed for",
        lambda: hovering(LINEAR, airframe=HEAVY, wind=(1.0, 1.0, 0.0), gusts=0.6, seed=8),
        (Ask(1.0, fly_leg((90.0, 0.0, HIGH), 13.0)),),
        16.0,
    ),
    ReferenceFlight(
        "by increments from the hover over a leg to a hover",
        lambda: hovering(Law.INDI, wind=(1.0, 2.0, 0.0), gusts=0.5, seed=9, tuning=BY_INCREMENTS),
        (Ask(0.0, fly_leg((70.0, 10.0, HIGH + 5.0), 12.0)),),
        16.0,
    ),
    ReferenceFlight(
        "the hybrid from a proved hover over a leg to a proved hover",
        lambda: hovering(LINEAR, wind=(0.5, 0.5, 0.0), gusts=0.1, seed=11, tuning=Tuning()),
        (Ask(0.5, fly_leg((50.0, 10.0, HIGH + 5.0), 12.0)),),
        18.0,
    ),
    ReferenceFlight(
        "by outputs, a hover that moves on",
        lambda: hovering(Law.ROBUST_PI, wind=(1.0, 0.5, 0.0), gusts=0.2, seed=10, tuning=BY_OUTPUTS),
        (Ask(1.0, hold(1.0, 0.5, HIGH + 0.5)),),
        10.0,
    ),
)
