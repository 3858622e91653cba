"""The exported code by all compilers, on x86-64 and on the emulated processors of autopilots: the same bits."""

from functools import cache

import numpy as np
import pytest

from sitl.__main__ import main
from sitl.export.builds import (
    AARCH64,
    BUILDS,
    COUNTING,
    FLY,
    NAVIGATE,
    Build,
    ReplayProgram,
    flown_by_all,
    write_flight,
    write_navigation,
)
from sitl.export.flown_again import record
from sitl.export.random_flights import random_flight
from sitl.export.random_navigation import random_navigation
from sitl.sensors.sensor_files import load_sensors
from sitl.simulation.avionics import Navigation
from sitl.simulation.start import whole_periods
from tests.support.digests.reference_flights import FLIGHTS, SHORT
from tests.support.exported import AIRFRAME, code, estimator_folder, folder, need

RANDOM, SECONDS = 6, 1.0
NAVIGATED = 0.4  # longer than the filter stands in the past [s]
UNOPTIMISED = Build("gcc -O0, AArch64", (*AARCH64, "-O0"), ("qemu-aarch64",))
ALL = [pytest.param(build, id=build.name) for build in (*BUILDS, UNOPTIMISED)]


def recorded(flight):
    asks = [(whole_periods(ask.time), ask.do) for ask in flight.asks]
    return record(flight.name, flight.begin(), whole_periods(SHORT), asks)


@cache
def flights():
    chance = [random_flight(number, SECONDS, (AIRFRAME,)) for number in range(RANDOM)]
    assert sum(flight.jumps for flight in chance) > 0
    return [*(recorded(flight) for flight in FLIGHTS), *chance]


@cache
def navigation():
    return random_navigation(3, NAVIGATED, AIRFRAME, load_sensors(), Navigation.SENSORS)


def need_build(build):
    for name in (build.compiler[0], *build.runner[:1]):
        need(name)


@pytest.mark.long
@pytest.mark.parametrize("build", ALL)
def test_reference_flights_and_flights_of_chance_are_the_same_by_every_build(tmp_path, build):
    need_build(build)
    program = ReplayProgram(build, folder(), tmp_path)
    wrong = [flight.name for flight in flights() if write_flight(tmp_path, flight) != program.run()]
    assert not wrong


@pytest.mark.long
@pytest.mark.parametrize("build", ALL)
def test_a_flight_is_navigated_the_same_by_every_build(tmp_path, build):
    need_build(build)
    program = ReplayProgram(build, estimator_folder(), tmp_path, NAVIGATE)
    assert write_navigation(tmp_path, navigation()) == program.run()


@pytest.mark.long
def test_instructions_of_a_step_are_counted(tmp_path):
    need_build(COUNTING)
    program = ReplayProgram(COUNTING, folder(), tmp_path)
    write_flight(tmp_path, random_flight(3, 0.1, (AIRFRAME,)))
    flown, counted = program.run().splitlines()
    assert flown == "50 periods: 0 numbers differ, 0 steps"
    mean, most = (int(word) for word in counted.replace(",", "").split() if word.isdigit())
    assert 500 < mean <= most < 50_000


@pytest.mark.long
def test_a_build_that_differs_is_told_of_and_one_that_is_missing_left_out(capsys):
    need("gcc")
    flight = random_flight(0, 0.02, (AIRFRAME,))
    controllers = flight.controllers.copy()
    controllers[5, 8] = np.nextafter(controllers[5, 8], np.inf)
    builds = (Build("gcc -O0", ("gcc", "-O0")), Build("of nobody", ("no-such-compiler",)))
    changed = flight._replace(name="changed", controllers=controllers)
    assert flown_by_all(folder(), FLY, [flight, changed], write_flight, builds) == 1
    assert capsys.readouterr().out.splitlines() == [
        "of nobody: left out, no-such-compiler is not installed",
        "changed by gcc -O0: 10 periods: 1 numbers differ, 0 steps",
        "gcc -O0: 1 of 2 flights flown the same to the bit",
    ]


@pytest.mark.long
def test_floats_are_the_same_by_every_build(capsys):
    code(single=True)
    assert main(["export", "check", str(folder(single=True)), "--flights=2", "--seconds=0.1", "--builds=all"]) == 0
    told = capsys.readouterr().out.splitlines()
    assert "gcc -O2, x86-64: 2 of 2 flights flown the same to the bit" in told
    assert told[-1].startswith("100 periods")
