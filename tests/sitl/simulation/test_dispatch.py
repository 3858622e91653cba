"""From registers to code: a law of one's own flies, and no law is ever taken for another."""

import dataclasses
import math
from typing import get_type_hints

import pytest

from protocol.dialect.vocabulary import Law
from sitl.control.laws import VALUES
from sitl.control.reference import Reference, along, hover_at, leg
from sitl.errors import UnknownLawError, ZenoError
from sitl.model.airframe_files import load
from sitl.sensors.draws import PERIOD
from sitl.simulation.batch import fly_batch
from sitl.simulation.dispatch import COMPILED, REGISTER, Register
from sitl.simulation.flight import Design, Flight
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.storage import record_of, value_of
from tests.support.flights import documented_law
from tests.support.flights.own_laws import ENOUGH, OWN, Ascended, OwnLaw, register
from tests.support.flights.tunings import BY_REPORT

NOMINAL = load("nominal").parameters
# One register, and so one compilation, has the law of these tests and that of docs/api.md.
BOTH = register(
    laws=(*OWN.laws.values(), documented_law.ROW),
    table={**OWN.table, documented_law.CLIMB: documented_law.JUMPS},
    states={"ascended": Ascended, **documented_law.STATES},
    gains={**OWN.gains, **documented_law.GAINS},
)


def ascending():
    made = Simulation(NOMINAL, start=Start(up=50.0, airborne=True), register=BOTH)
    made.begin_flight(OwnLaw.ASCEND)
    made.reference = hover_at((0.0, 0.0, 51.0), 0.0)
    return made


def hovering():
    made = Simulation(NOMINAL, start=Start(up=50.0, airborne=True))
    made.begin_flight(Law.HOVER_LINEAR)
    return made


# Values


@pytest.mark.parametrize(("in_use", "asked"), [(0, 0), (1, 1)])
def test_a_lyapunov_value_is_worked_out_only_where_the_other_guards_of_its_row_hold(in_use, asked):
    """That of the linear forward law, which is off unless it is asked for."""
    flown = Simulation(NOMINAL, start=Start(up=50.0, airborne=True), tuning=BY_REPORT)
    flown.retune(flown.tuning._replace(forward_linear=in_use))
    flown.begin_flight(Law.FORWARD_LINE_OF_SIGHT)
    flown.reference = along(hover_at((500.0, 0.0, 50.0), 0.0), leg((0.0, 0.0, 50.0), (500.0, 0.0, 50.0), 15.0), 0.0)
    flight, reference = record_of(Flight, flown.flight)[0], record_of(Reference, flown.reference)[0]
    flight["controller"]["law_time"] = 1.0
    seen = []

    def spied(estimate, reference, gains):
        seen.append(estimate)
        return 0.1

    values = [dataclasses.replace(row, value=spied) if row.name == "v_forward" else row for row in VALUES]
    seek = Register(values=values).compile().seek
    row = seek(flown.law, flight, reference, record_of(Design, flown.design)[0])
    assert (len(seen), row >= 0) == (asked, bool(in_use))


# A law of one's own


@pytest.mark.long
def test_a_law_of_one_s_own_flies_by_its_gains_state_value_guard_and_reset():
    flown = ascending()
    assert flown.law is OwnLaw.ASCEND
    flown.advance(100)
    motor = math.sqrt(0.5 * 1.2 * NOMINAL.m * NOMINAL.g / NOMINAL.k_f)
    assert flown.command == pytest.approx((motor, motor, 0.01, -0.01))
    assert flown.saturation == 3
    ascended = flown.flight.controller.states.ascended
    assert ascended.periods == 200
    assert flown.flight.controller.states.course == pytest.approx(100 * PERIOD)
    assert ascended.speed == pytest.approx(flown.truth.body.velocity.z, rel=0.05)
    assert flown.jumps == []
    flown.step(1.0)
    (jump,) = flown.jumps
    assert (jump.source, jump.target, jump.name) == (OwnLaw.ASCEND, Law.HOVER_ZERO_MOMENT, "level_off")
    assert jump.time == pytest.approx(ENOUGH / (0.2 * NOMINAL.g), abs=0.1)
    after = flown.flight.controller.states.ascended
    assert (after.speed, after.size) == (0.0, 0.0)
    assert after.periods == 2 * round(jump.time / PERIOD)  # no longer counted under the other law
    flown.step(8.0)
    assert flown.truth.body.position.z == pytest.approx(51.0, abs=0.05)
    assert flown.energy_by_law[OwnLaw.ASCEND] > 0.0
    assert sum(flown.energy_by_law.values()) == pytest.approx(flown.energy)


@pytest.mark.long
def test_it_is_one_flight_however_it_is_stepped_and_can_be_recorded():
    whole, pieces = ascending(), ascending()
    rows = whole.record(1.0, 50.0)
    for periods in (1, 250, 249):
        pieces.advance(periods)
    assert whole.flight._replace(limits=0) == pieces.flight._replace(limits=0)
    assert set(rows.law) == {OwnLaw.ASCEND, Law.HOVER_ZERO_MOMENT}


@pytest.mark.long
def test_the_law_of_the_documentation_is_compiled_to_the_bits_of_its_text():
    flown = Simulation(NOMINAL, start=Start(up=50.0, airborne=True), register=BOTH)
    flown.begin_flight(documented_law.CLIMB)
    gains = documented_law.GAINS["climb"]
    for _ in range(50):
        seen, climbed = flown.estimate, flown.flight.controller.states.climbed
        flown.advance(1)
        now = flown.command, flown.saturation, flown.flight.controller.states.climbed
        assert now == documented_law.ROW.step(seen, flown.reference, gains, NOMINAL, climbed, PERIOD)
    assert now[2].height > 0.0
    flown.step(0.5)
    assert [jump.name for jump in flown.jumps] == ["level_off"]


def test_the_vehicle_s_own_laws_know_nothing_of_it():
    with pytest.raises(UnknownLawError, match="law 101 is not one of LANDED"):
        REGISTER.law(OwnLaw.ASCEND)
    assert "ascended" not in REGISTER.slots


# What a law's number, and no other, does


def test_every_law_computes_its_own_command():
    """The command of each law in the compiled chain is that of its row."""
    flown = hovering()
    flown.place(flown.truth.body._replace(velocity=flown.truth.body.velocity._replace(x=0.5)))
    flight, design = flown.flight, flown.design
    known = {
        **{slot: getattr(flight.controller.states, slot) for slot in REGISTER.slots},
        "estimate": flight.estimate, "reference": flown.reference, "a": design.a, "dt": PERIOD,
    }  # fmt: skip
    commands = set()
    for law, row in REGISTER.laws.items():
        records = [record_of(type(value), value) for value in (flight, flown.reference)]
        COMPILED.tick(int(law), records[0][0], records[1][0], flown.design_record[0])
        known["gains"] = getattr(design.gains, row.gains) if row.gains else None
        names = row.step.__code__.co_varnames[: row.step.__code__.co_argcount]
        if "state" in names:
            kind = get_type_hints(row.step)["state"]
            known["state"] = kind(*(known[slot] for slot in kind._fields))
        expected = row.step(*(known[name] for name in names))[0]
        assert value_of(records[0][0].controller.command) == expected
        commands.add(expected)
    assert len(commands) > 5


@pytest.mark.parametrize("number", [-1, len(Law), 77, 101])
def test_a_law_that_the_core_does_not_know_ends_the_flight_and_nothing_flies(number):
    flown = hovering()
    flown._arrays.flights["controller"]["law"] = number
    before = flown.flight
    for fly in (lambda: flown.advance(10), lambda: flown.record(0.1, 50.0), lambda: fly_batch([flown], 0.1)):
        with pytest.raises(UnknownLawError, match=f"law {number} is not one of LANDED, HOVER_LINEAR"):
            fly()
    with pytest.raises(UnknownLawError, match=str(number)):
        _ = flown.law
    assert flown.flight == before


def test_in_the_generated_code_too_an_unknown_law_does_nothing_and_leads_nowhere():
    flown = hovering()
    records = [record_of(type(value), value)[0] for value in (flown.flight, flown.reference)]
    COMPILED.tick(77, records[0], records[1], flown.design_record[0])
    assert records[0].item() == record_of(type(flown.flight), flown.flight)[0].item()
    assert COMPILED.seek(77, records[0], records[1], flown.design_record[0]) == -1
    assert not COMPILED.is_known(77)
    assert all(COMPILED.is_known(int(law)) for law in Law)


@pytest.mark.long
def test_flights_with_laws_of_their_own_are_flown_in_a_batch_with_the_vehicle_s():
    together, alone = [hovering(), ascending()], [hovering(), ascending()]
    fly_batch(together, 0.1)
    for one in alone:
        one.step(0.1)
    assert [one.flight for one in together] == [one.flight for one in alone]


@pytest.mark.long
def test_jumps_without_end_are_told_and_not_flown():
    flown = ascending()
    flown.reference = flown.reference._replace(steered=True)
    with pytest.raises(ZenoError, match="back -> there -> back"):
        flown.advance(10)
    assert flown.time == 0.0


def test_the_vehicle_s_register_is_every_law_of_the_vocabulary():
    assert list(REGISTER.laws) == list(Law)
    assert set(REGISTER.table) == set(Law)
