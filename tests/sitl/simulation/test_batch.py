"""Batches: flown side by side, each flight ends with the bits it has alone."""

import math
import random

import numpy as np
import pytest

from sitl import Body, Law, Simulation, SitlError, Start, along, fly_batch, hover_at, leg, load_airframe
from sitl.model.quaternions import from_euler
from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD
from sitl.simulation.loop import fly
from sitl.simulation.noise import BLOCK
from sitl.simulation.tuning import Tuning
from tests.support.flights.tunings import BY_REPORT

NOMINAL = load_airframe("nominal").parameters


def mixed(seed: int) -> Simulation:
    """One of many: hovering, thrown, on a leg, falling, standing; in calm, wind or gusts; right or wrong airframe."""
    draw = random.Random(seed)
    kind = seed % 5
    airframe = NOMINAL._replace(m=NOMINAL.m * draw.uniform(0.95, 1.05)) if seed % 2 else NOMINAL
    start = Start(up=0.0 if kind == 4 else 60.0, airborne=kind != 4)
    tuning = Tuning() if seed % 3 == 0 else BY_REPORT
    made = Simulation(airframe, seed=seed, start=start, design_model=NOMINAL, tuning=tuning)
    at = (draw.uniform(-4.0, 4.0), draw.uniform(-4.0, 4.0), 4.0 if kind == 4 else 60.0)
    if kind == 4:
        made.armed = made.flying = True
    else:
        made.begin_flight(Law.HOVER_LINEAR if kind == 0 else Law.HOVER_ZERO_MOMENT)
    if kind in {1, 3}:
        tilt = from_euler(draw.uniform(-1.0, 1.0), draw.uniform(-2.5, -0.5), draw.uniform(-1.0, 1.0))
        sink = -15.0 if kind == 3 else 0.0
        body = made.truth.body
        made.place(Body(body.position, Vector(0.0, 0.0, sink), tilt, Vector(1.0, -1.0, 0.5)))
    made.reference = hover_at(at, draw.uniform(-1.0, 1.0))
    if kind == 2:
        made.reference = along(made.reference, leg((0.0, 0.0, 60.0), (60.0, 10.0, 60.0), 12.0), 0.2)
    made.set_wind((draw.uniform(-3.0, 3.0), draw.uniform(-3.0, 3.0), 0.0), draw.choice((0.0, 0.0, 0.8)))
    return made


def state(simulation: Simulation) -> bytes:
    return simulation._arrays.flights.tobytes()


def test_every_flight_of_a_batch_ends_with_the_bits_it_has_alone() -> None:
    count = 53
    together, alone = [mixed(seed) for seed in range(count)], [mixed(seed) for seed in range(count)]
    for seconds in (0.5, 4.5):
        fly_batch(together, seconds)
    for one in alone:
        one.step(0.5)
        one.step(4.5)
    assert [state(a) == state(b) for a, b in zip(together, alone, strict=True)] == [True] * count
    assert [a.jumps for a in together] == [b.jumps for b in alone]
    assert {jump.target for one in alone for jump in one.jumps} >= {
        Law.HOVER_LINEAR, Law.HOVER_ZERO_MOMENT, Law.ALIGN, Law.TO_FORWARD, Law.FAILSAFE,
    }  # fmt: skip


def test_recordings_of_a_batch_are_those_of_single_flights() -> None:
    together, alone = [mixed(seed) for seed in range(7)], [mixed(seed) for seed in range(7)]
    for recorded, one in zip(fly_batch(together, 2.0, rate=50.0), alone, strict=True):
        expected = one.record(2.0, rate=50.0)
        assert np.array_equal(recorded.position, expected.position)
        assert np.array_equal(recorded.law, expected.law)
        assert np.array_equal(recorded.v_hover, expected.v_hover)
        assert recorded.jumps == expected.jumps


def test_a_batch_is_compiled_once_for_flights_of_any_length() -> None:
    fly_batch([mixed(0)], 0.1)
    before = len(fly.signatures)
    fly_batch([mixed(0)], (BLOCK + 50) * PERIOD, rate=10.0)  # in two calls
    assert len(fly.signatures) == before


def test_the_number_of_threads_changes_nothing() -> None:
    one, two = [mixed(seed) for seed in range(32)], [mixed(seed) for seed in range(32)]
    fly_batch(one, 1.0, threads=1)
    fly_batch(two, 1.0, threads=2)
    assert [state(a) for a in one] == [state(b) for b in two]


def test_different_tunings_and_times_go_into_one_batch() -> None:
    together, alone = [mixed(seed) for seed in range(6)], [mixed(seed) for seed in range(6)]
    for flights in (together, alone):
        flights[1].retune(flights[1].tuning._replace(kpp=1.2))
        flights[2].step(0.1)
    fly_batch(together, 1.0)
    for one in alone:
        one.step(1.0)
    assert [state(a) for a in together] == [state(b) for b in alone]


def test_a_flight_that_diverges_is_told_and_the_others_are_flown() -> None:
    flights = [mixed(seed) for seed in (0, 5, 10)]
    body = flights[1].truth.body
    flights[1].place(body._replace(rates=Vector(math.inf, 0.0, 0.0)))
    with pytest.raises(SitlError, match="1 of 3 flights failed"):
        fly_batch(flights, 0.1)
    assert [flight.periods for flight in flights] == [50, 50, 50]


def test_a_time_that_is_no_whole_number_of_periods_is_refused() -> None:
    with pytest.raises(SitlError, match="whole number of control periods"):
        fly_batch([mixed(0)], 0.0011)


def test_the_same_simulation_cannot_be_flown_twice_at_once() -> None:
    one = mixed(0)
    with pytest.raises(SitlError, match="twice"):
        fly_batch([one, mixed(5), one], 0.1)
    assert one.periods == 0
