"""Commands at a jump: each reset map starts its law near the commands of the law before."""

import math
from collections import defaultdict
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from protocol.dialect.vocabulary import Law
from sitl.control.reference import AttitudeReference, hover_at, steer
from sitl.guidance.circles import circle_about
from sitl.guidance.legs import leg_reference
from sitl.model.quaternions import hover
from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.supervisor.guards import MAX_SINK
from sitl.supervisor.table import TABLE
from tests.support.flights.estimates import turned
from tests.support.flights.recorded_flight import NOMINAL
from tests.support.flights.tunings import EVERY_LAW

HIGH = 200.0  # [m]
STILL = Vector(0.0, 0.0, 0.0)
# What the commands may step by in the first period of the new law: motors [rad/s], elevons [deg].
BOUNDS = {
    "steer": (0.1, 0.1),  # handed over: the new law begins with what is in force
    "let_go": (0.1, 0.1),
    "upset": (0.1, 0.1),
    "fly": (0.5, 0.2),  # both laws steer by one line of sight
    "brake": (12.0, 0.5),
    "recall": (2.0, 1.0),
    "leave_forward_linear": (3.0, 0.2),
    "enter_forward_linear": (90.0, 10.0),
    "front_transition": (0.5, 21.0),
    "fly_on": (0.5, 0.2),
    "stay": (15.0, 15.0),  # from the place held to the one asked for
    "recover": (0.5, 21.0),
    "align": (0.5, 13.0),
    "enter_linear": (55.0, 31.0),
    "leave_linear": (15.0, 31.0),
    "hover": (110.0, 5.0),
    "ride_wind": (200.0, 1.0),
}
MEANT = {"catch_fall"}  # the elevons turn over with the air stream


def hovering(law=Law.HOVER_ZERO_MOMENT, *, seed=1, gusts=0.0, wind=(0.0, 0.0, 0.0)):
    vehicle = Simulation(NOMINAL, seed=seed, start=Start(up=HIGH, airborne=True), tuning=EVERY_LAW)
    vehicle.begin_flight(law)
    vehicle.set_wind(wind, gusts)
    return vehicle


def to(north, west, up=HIGH, heading=0.0):
    return lambda vehicle: setattr(vehicle, "reference", hover_at((north, west, up), heading))


def along(north, west, *, stop):
    def change(vehicle):
        here = vehicle.estimate.position
        vehicle.reference = leg_reference(here, (north, west, HIGH + 5.0), vehicle.reference, 15.0, stop=stop)

    return change


def stay(vehicle):
    vehicle.reference = hover_at(vehicle.estimate.position, 0.0)


def circle(vehicle):
    vehicle.reference = circle_about((60.0, 0.0, HIGH), 40.0, vehicle.reference, 12.0).reference


def attitude(*phi):
    asked = AttitudeReference(turned(hover(0.0), phi), STILL, 0.5)
    return lambda vehicle: setattr(vehicle, "reference", steer(vehicle.reference, asked))


def knocked(*phi):
    def change(vehicle):
        body = vehicle.truth.body
        vehicle.place(body._replace(attitude=turned(body.attitude, phi)))

    return change


def wind(*velocity):
    return lambda vehicle: vehicle.set_wind(velocity)


def fall(vehicle):
    body = vehicle.truth.body
    vehicle.place(body._replace(position=Vector(0.0, 0.0, 500.0), velocity=Vector(0.0, 0.0, -MAX_SINK - 1.0)))


FLIGHTS = {  # how it begins, and what is asked of it for how long [s]
    "far": (hovering, [(to(30, 10), 30), (to(-30, 10, heading=2.5), 40)]),
    "far in gusts": (lambda: hovering(gusts=1.0), [(to(30, 10, 205), 40), (to(-30, 10), 40)]),
    "there and back": (lambda: hovering(Law.HOVER_LINEAR), [(along(120, 0, stop=True), 25)]),
    "to the side in gusts": (
        lambda: hovering(Law.HOVER_LINEAR, seed=3, gusts=1.0),
        [(along(-60, 90, stop=True), 30)],
    ),
    "round a circle": (lambda: hovering(Law.HOVER_LINEAR), [(along(500, 0, stop=False), 8), (circle, 10), (stay, 15)]),
    "recalled": (lambda: hovering(Law.HOVER_LINEAR), [(along(500, 0, stop=False), 2.5), (stay, 10)]),
    "recalled at once": (lambda: hovering(Law.HOVER_LINEAR), [(along(-500, 0, stop=False), 0.5), (stay, 5)]),
    "on the wing and back to it": (
        lambda: hovering(Law.HOVER_LINEAR),
        [(along(500, 0, stop=False), 8), (stay, 1), (along(900, 0, stop=False), 8)],
    ),
    "a wind sets in": (hovering, [(to(30, 0), 3), (wind(7, 0, 0), 8)]),
    "a wind from the start": (lambda: hovering(wind=(6.0, 0.0, 0.0)), [(to(30, 0), 10)]),
    "attitudes": (lambda: hovering(Law.HOVER_LINEAR), [(attitude(0, -0.3, 0), 2), (stay, 5)]),
    "an upset": (
        lambda: hovering(Law.HOVER_LINEAR),
        [(attitude(0, 0, 0), 1), (knocked(0, 0, 1.2), 0.1), (stay, 8)],
    ),
    "a fall": (lambda: hovering(Law.HOVER_LINEAR), [(fall, 25)]),
}


def flown(start, acts, stops=()):
    """A flight, and its commands at given periods and one period later."""
    vehicle, seen = start(), {}
    for change, seconds in acts:
        change(vehicle)
        until = vehicle.periods + round(seconds / PERIOD)
        for stop in [period for period in stops if vehicle.periods <= period < until]:
            vehicle.advance(stop - vehicle.periods)
            before = vehicle.command
            vehicle.advance(1)
            seen[stop] = before, vehicle.command
        vehicle.advance(until - vehicle.periods)
    return vehicle, seen


@cache
def steps(name):
    """Jumps of a flight at one instant each, and what the commands stepped by there: motors [rad/s], elevons [deg].

    The flight is flown twice, the second time with stops at the jumps of the first.
    """
    first, _ = flown(*FLIGHTS[name])
    at = defaultdict(list)
    for jump in first.jumps:
        at[round(jump.time / PERIOD)].append(jump)
    second, seen = flown(*FLIGHTS[name], sorted(at))
    assert second.jumps == first.jumps
    sizes = []
    for period, jumps in at.items():
        if period in seen:
            step = np.abs(np.subtract(seen[period][1], seen[period][0]))
            sizes.append((jumps, float(step[:2].max()), math.degrees(step[2:].max())))
    return sizes


@pytest.mark.parametrize("name", FLIGHTS)
def test_no_jump_of_a_flight_steps_motors_or_elevons_beyond_what_its_reset_promises(name):
    assert steps(name)
    for jumps, motors, elevons in steps(name):
        if MEANT & {jump.name for jump in jumps}:
            continue
        bounds = np.array([BOUNDS[jump.name] for jump in jumps]).max(axis=0)
        assert motors <= bounds[0], jumps
        assert elevons <= bounds[1], jumps


def names_in(table):
    return {jump.name for jumps in table.values() for jump in jumps}


def test_these_flights_take_nearly_every_jump_there_is_in_the_air():
    """But "stop_sliding", which ends what cannot be flown on, "turn", whose leg ends off the trim, and robust PI's."""
    seen = {jump.name for name in FLIGHTS for jumps, *_ in steps(name) for jump in jumps}
    assert seen == set(BOUNDS) | MEANT
    elsewhere = {"take_off", "take_off_indi", "disarm", "touch_down", "crash", "stop_sliding", "turn", "lose_robust_pi"}
    of_the_choice = {name for name in names_in(TABLE) if name.startswith("choose_")}
    of_the_hybrid = {"enter_proved", "leave_proved", "fly_indi", "let_go_indi", "recover_indi", "fly_leaning"}
    assert names_in(TABLE) - seen == elsewhere | of_the_choice | of_the_hybrid


def test_jumps_of_one_flight_are_numbered_and_lead_on_from_each_other():
    for name in FLIGHTS:
        jumps = flown(*FLIGHTS[name])[0].jumps
        assert [jump.number for jump in jumps] == list(range(1, len(jumps) + 1))
        assert all(last.target is jump.source and last.time <= jump.time for last, jump in pairwise(jumps))
