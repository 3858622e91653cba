"""From registers to code: a law of one's own flies, and what does not fit together is refused in words."""

import math
from enum import IntEnum
from typing import NamedTuple

import pytest

from protocol.dialect.vocabulary import Law, Reason
from sitl.airframe import load
from sitl.compiled import kernel
from sitl.control.laws import LAWS, VALUES, LawRow, ValueRow
from sitl.control.reference import hover_at
from sitl.errors import SitlError, UnknownLawError, ZenoError
from sitl.model.state import Actuators
from sitl.simulation.batch import fly_batch
from sitl.simulation.dispatch import COMPILED, REGISTER, Register
from sitl.simulation.simulation import PERIOD, Simulation, Start
from sitl.simulation.storage import access, record_of
from sitl.supervisor import guards, resets
from sitl.supervisor.guards import GUARDS, Guard
from sitl.supervisor.resets import Reset, guide_from_here
from sitl.supervisor.table import TABLE, Jump

NOMINAL = load("nominal").parameters
ENOUGH = 0.5  # m/s2 s of what is counted


class OwnLaw(IntEnum):
    CLIMB = 100
    REST = 101


class ClimbGains(NamedTuple):
    thrust: float  # over the weight
    count: int


class Climbed(NamedTuple):
    speed: float  # [m/s]
    periods: int
    size: float  # as numpy's own attribute is called


@kernel
def climb(estimate, gains, a, climbed, dt):
    motor = math.sqrt(0.5 * gains.thrust * a.m * a.g / a.k_f)
    after = Climbed(climbed.speed + dt * estimate.acceleration.z, climbed.periods + gains.count, 1.0)
    return Actuators(motor, motor, 0.01, -0.01), 3, after


@kernel
def enough(speed_value):
    return speed_value > ENOUGH


@kernel
def speed_value(climbed):
    return climbed.speed


@kernel
def forget(climbed):
    return Climbed(0.0, climbed.periods, 0.0)


FAST = Guard("fast", "Climbing fast enough.", 1 << 40, enough)
FORGET = Reset("forget", ("climbed",), forget, clears=(FAST,))
OFF = Jump("off", Law.LANDED, Reason.DISARM, unless=(guards.armed,))


def register(step=climb, **changes):
    """Three laws, one of them not the vehicle's own."""
    chosen = {
        "laws": [row for row in LAWS if row.law in {Law.LANDED, Law.HOVER_ZERO_MOMENT}]
        + [LawRow(OwnLaw.CLIMB, step, "climb")],
        "values": (*VALUES, ValueRow("speed_value", speed_value, "climb")),
        "table": {
            Law.LANDED: (),
            Law.HOVER_ZERO_MOMENT: (OFF,),
            OwnLaw.CLIMB: (
                OFF,
                Jump("level_off", Law.HOVER_ZERO_MOMENT, Reason.SPEED, when=(FAST,), resets=(guide_from_here, FORGET)),
            ),
        },
        "states": {"climbed": Climbed},
        "gains": {"climb": ClimbGains(1.2, 2)},
    }
    return Register(**chosen | changes)


OWN = register()


def climbing(own=OWN):
    made = Simulation(NOMINAL, start=Start(up=50.0, airborne=True), register=own)
    made.begin_flight(OwnLaw.CLIMB)
    made.reference = hover_at((0.0, 0.0, 51.0), 0.0)
    return made


def hovering():
    made = Simulation(NOMINAL, start=Start(up=50.0, airborne=True))
    made.begin_flight(Law.HOVER_LINEAR)
    return made


# A law of one's own


def test_a_law_of_one_s_own_flies_by_its_gains_state_value_guard_and_reset():
    flown = climbing()
    assert flown.law is OwnLaw.CLIMB
    flown.advance(100)
    motor = math.sqrt(0.5 * 1.2 * NOMINAL.m * NOMINAL.g / NOMINAL.k_f)
    assert flown.command == pytest.approx((motor, motor, 0.01, -0.01))
    assert flown.saturation == 3
    climbed = flown.flight.controller.states.climbed
    assert climbed.periods == 200
    assert climbed.speed == pytest.approx(flown.truth.body.velocity.z, rel=0.05)
    assert flown.jumps == []
    flown.step(1.0)
    (jump,) = flown.jumps
    assert (jump.source, jump.target, jump.name) == (OwnLaw.CLIMB, Law.HOVER_ZERO_MOMENT, "level_off")
    assert jump.time == pytest.approx(ENOUGH / (0.2 * NOMINAL.g), abs=0.1)
    after = flown.flight.controller.states.climbed
    assert (after.speed, after.size) == (0.0, 0.0)
    assert after.periods == 2 * round(jump.time / PERIOD)  # no longer counted under the other law
    flown.step(8.0)
    assert flown.truth.body.position.z == pytest.approx(51.0, abs=0.05)
    assert flown.energy_by_law[OwnLaw.CLIMB] > 0.0
    assert sum(flown.energy_by_law.values()) == pytest.approx(flown.energy)


def test_it_is_one_flight_however_it_is_stepped_and_can_be_recorded():
    whole, pieces = climbing(), climbing()
    rows = whole.record(1.0, 50.0)
    for periods in (1, 250, 249):
        pieces.advance(periods)
    assert whole.flight._replace(limits=0) == pieces.flight._replace(limits=0)
    assert set(rows.law) == {OwnLaw.CLIMB, Law.HOVER_ZERO_MOMENT}


def test_the_vehicle_s_own_laws_know_nothing_of_it():
    with pytest.raises(UnknownLawError, match="law 100 is not one of LANDED"):
        REGISTER.law(OwnLaw.CLIMB)
    assert "climbed" not in REGISTER.slots


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
        COMPILED.tick(int(law), records[0][0], 0, records[1][0], flown.design_record[0])
        known["gains"] = getattr(design.gains, row.gains) if row.gains else None
        names = row.step.__code__.co_varnames[: row.step.__code__.co_argcount]
        expected = row.step(*(known[name] for name in names))[0]
        assert access(type(flight), "controller.command").get(records[0][0], 0) == expected
        commands.add(expected)
    assert len(commands) > 5


@pytest.mark.parametrize("number", [-1, 10, 77, 100])
def test_a_law_that_the_core_does_not_know_ends_the_flight_and_nothing_flies(number):
    flown = hovering()
    flown._flights["controller"]["law"] = number
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
    COMPILED.tick(77, records[0], 0, records[1], flown.design_record[0])
    assert records[0].item() == record_of(type(flown.flight), flown.flight)[0].item()
    assert COMPILED.due(77, (1 << len(GUARDS)) - 1) == -1
    assert COMPILED.seek(77, records[0], 0, records[1], flown.design_record[0]) == -1
    assert not COMPILED.is_known(77)
    assert all(COMPILED.is_known(int(law)) for law in Law)


def test_a_flight_with_laws_of_its_own_is_not_taken_into_a_batch_of_the_vehicle_s():
    with pytest.raises(SitlError, match="laws of its own is flown alone"):
        fly_batch([hovering(), climbing()], 0.1)


def test_jumps_without_end_are_told_and_not_flown():
    there = Jump("there", OwnLaw.CLIMB, Reason.COMMAND, when=(guards.armed,))
    back = Jump("back", Law.HOVER_ZERO_MOMENT, Reason.COMMAND, when=(guards.armed,))
    table = {Law.LANDED: (), Law.HOVER_ZERO_MOMENT: (there,), OwnLaw.CLIMB: (back,)}
    flown = climbing(register(table=table))
    with pytest.raises(ZenoError, match="back -> there -> back"):
        flown.advance(10)
    assert flown.time == 0.0


# What is refused


@kernel
def asks_for_the_plant(plant):
    return Actuators(0.0, 0.0, 0.0, 0.0), 0


@kernel
def asks_for_its_gains(gains):
    return Actuators(0.0, 0.0, 0.0, 0.0), 0


def jump(**parts):
    return {**OWN.table, OwnLaw.CLIMB: (Jump("odd", Law.HOVER_ZERO_MOMENT, Reason.SPEED, **parts),)}


def compiled(*arguments, **changes):
    return lambda: register(*arguments, **changes).compile()


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (compiled(asks_for_the_plant), "law CLIMB asks for 'plant': there is a, at_rest, climb_gains, climbed, course"),
        (
            compiled(laws=[*LAWS, LawRow(OwnLaw.CLIMB, asks_for_its_gains)], table={**TABLE, **OWN.table}),
            "law CLIMB asks for 'gains'",
        ),
        (
            compiled(table=jump(when=(Guard("seer", "Sees.", 1 << 41, asks_for_the_plant),))),
            "guard seer asks for 'plant'",
        ),
        (compiled(table=jump(resets=(Reset("odd", ("guide",), asks_for_the_plant),))), "reset odd asks for 'plant'"),
        (compiled(values=(*OWN.values.values(), ValueRow("v", asks_for_the_plant, "climb"))), "value v asks for"),
        (compiled(table=jump(resets=(Reset("odd", ("nothing",), forget),))), "reset odd sets 'nothing': there is at_"),
        (
            compiled(laws=[*LAWS, LawRow(OwnLaw.CLIMB, climb, "slope")], table={**TABLE, **OWN.table}),
            "law CLIMB takes gains 'slope': there is climb, forward_linear",
        ),
        (compiled(laws=[*LAWS, LawRow(IntEnum("Odd", {"NEW": 2}).NEW, climb)]), "law number 2 stands for two"),
        (compiled(laws=[*LAWS, LawRow(IntEnum("Odd", {"ALIGN": 99}).ALIGN, climb)]), "law name 'ALIGN' stands for two"),
        (compiled(table=jump(when=(guards.near, Guard("near", "", 1 << 41, enough)))), "guard name 'near' stands for"),
        (compiled(table=jump(when=(guards.near, Guard("odd", "", guards.near.bit, enough)))), "guard bit 8 stands for"),
        (compiled(table=jump(resets=(FORGET, Reset("forget", ("guide",), forget)))), "reset name 'forget' stands for"),
        (compiled(states={"climbed": Climbed, "guide": Climbed}), "state slot 'guide' is there already"),
        (compiled(gains={"climb": ClimbGains(1.0, 1), "wind": ClimbGains(1.0, 1)}), "gains 'wind' is there already"),
        (compiled(table={Law.LANDED: (), Law.HOVER_ZERO_MOMENT: ()}), "no row of the table for CLIMB"),
        (
            compiled(table={**OWN.table, Law.LANDED: (Jump("odd", Law.ALIGN, Reason.COMMAND),)}),
            "jump 'odd' of LANDED leads to <Law.ALIGN: 3>: it is not registered",
        ),
    ],
)
def test_what_does_not_fit_together_is_refused_in_words(made, said):
    with pytest.raises(SitlError) as refused:
        made()
    assert said in str(refused.value)


def test_a_simulation_is_not_made_with_what_is_refused():
    with pytest.raises(SitlError, match="asks for 'plant'"):
        climbing(register(asks_for_the_plant))


def test_the_vehicle_s_register_is_every_law_of_the_vocabulary():
    assert list(REGISTER.laws) == list(Law)
    assert set(REGISTER.table) == set(Law)
    assert resets.begin_anew not in {reset for rows in TABLE.values() for row in rows for reset in row.resets}
