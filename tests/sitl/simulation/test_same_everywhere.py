"""One seed is one flight, to the bit: on any processor, in a batch, in calls of any length."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from protocol.dialect.vocabulary import Law, LegMode
from sitl.autopilot.settings import Settings
from tests.support.digests.processors import OLD, printed
from tests.support.digests.reference_digest import SMALL, WAYS, digest
from tests.support.flights.recorded_flight import HIGH, Flight
from tests.support.flights.tunings import EVERY_LAW
from tests.support.vehicle.mission_items import waypoint

# A core type that the processor or the build of OpenBLAS does not have falls back to another. Designs under more of
# them are in test_processors.py, what flies uncompiled is in test_loop_matches_python.py.
PROGRAM = "tests.support.digests.reference_digest"
PROCESSORS = (
    {"OPENBLAS_CORETYPE": "Zen", **OLD},
    {"OPENBLAS_CORETYPE": "Prescott", "NUMBA_CPU_NAME": "generic"},
)


@pytest.fixture(scope="module")
def alone():
    return WAYS["alone"]()


def flown_under(flights):
    return {law for flight in flights for law in flight.laws}


def test_every_law_is_in_force_in_some_of_the_flights(alone):
    assert flown_under(alone) == set(Law)
    assert flown_under(WAYS["short"]()) == set(Law)


@pytest.mark.parametrize("way", ["small calls", "batch"])
def test_how_it_is_flown_changes_no_bit(way, alone):
    assert [one.name for one, other in zip(WAYS[way](), alone, strict=True) if one != other] == []


@pytest.mark.long
def test_every_processor_flies_the_same_flights(alone):
    with ThreadPoolExecutor(2) as two:
        found = [two.submit(printed, PROGRAM, ("alone", "batch"), choice) for choice in PROCESSORS]
    here = digest(alone)
    for choice, flown in zip(PROCESSORS, found, strict=True):
        assert flown.result() == [here, here], choice


def mission(lengths):
    """A mission in forward flight in gusts under the autopilot, in calls of these lengths in turn [control periods]."""
    forward = Settings(leg_mode=LegMode.FORWARD)
    flight = Flight(gusts=0.6, wind_speed=2.0, wind_from=0.7, settings=forward, seed=3, tuning=EVERY_LAW)
    flight.autopilot.missions.load([waypoint(70.0, 20.0, HIGH + 5.0), waypoint(10.0, 80.0, HIGH)])
    assert flight.autopilot.missions.start().accepted
    left, reached = 18000, []
    while left > 0:
        for length in lengths:
            flight.aircraft.advance(min(length, left))
            left -= min(length, left)
            reached += flight.autopilot.reached()
    return flight.vehicle._arrays.flights.tobytes(), flight.vehicle.jumps, reached


@pytest.mark.long
def test_under_the_autopilot_calls_of_any_length_fly_the_same_flight():
    """Short ones, as the live process makes them, and the longest."""
    state, jumps, reached = mission((18000,))
    assert {Law.FORWARD_LINEAR, Law.TO_HOVER, Law.HOVER_LINEAR} <= {jump.target for jump in jumps}
    assert len(reached) == 2
    assert mission((5,) * 40 + SMALL) == (state, jumps, reached)
