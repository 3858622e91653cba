"""The reset maps on random flights: what they promise of the guards is so, and nothing else is touched."""

import inspect
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from protocol.dialect.vocabulary import Law
from sitl.control import handover, hover_attitude, hover_linear
from sitl.control.forward_flight import forward_linear
from sitl.control.reference import AttitudeReference, Reference, circle, hover_at, leg, steer
from sitl.defaults import CONTROLLER_NAMES, HOVERING_CONTROLLER
from sitl.estimation.sensing import observe
from sitl.model.airframe_files import load
from sitl.model.ground import feet_aloft
from sitl.model.quaternions import hover
from sitl.model.state import Actuators, Body, Plant
from sitl.model.vectors import add
from sitl.simulation.dispatch import COMPILED, Register
from sitl.simulation.flight import Flight
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import CONTROLLERS, Tuning, thresholds
from sitl.storage import named_from, record_of
from sitl.supervisor.guards import GUARDS, has_forward_linear, indi_alone, indi_chosen, robust_pi_chosen
from sitl.supervisor.resets import LET_GO_TIME, begin_anew
from sitl.supervisor.table import TABLE
from tests.support.flat import paths_of
from tests.support.flights.estimates import rotation, vector
from tests.support.flights.linear_forward_flight import on_leg
from tests.support.flights.tunings import EVERY_LAW

NOMINAL = load("nominal").parameters
SIMULATION = Simulation(NOMINAL, start=Start(up=50.0, airborne=True), tuning=EVERY_LAW)
DESIGN, DESIGNS = SIMULATION.design, SIMULATION.design_record
COUNT = 20  # flights of each kind
STILL = vector((0, 0, 0))
JUMPS = [(law, row, jump) for law, jumps in TABLE.items() for row, jump in enumerate(jumps)]


def random_reference(rng):
    made = hover_at(tuple(rng.uniform(-20.0, 20.0, 3)), rng.uniform(-3.0, 3.0))
    if rng.random() < 0.3:
        path = circle(tuple(rng.uniform(-20.0, 20.0, 3)), 40.0, 12.0)
    else:
        ends = rng.uniform(-60.0, 60.0, (2, 3))
        path = leg(*map(tuple, ends), rng.uniform(7.0, 20.0), stop=bool(rng.random() < 0.7))
    made = made._replace(forward=bool(rng.random() < 0.7), path=path)
    asked = AttitudeReference(rotation(0.3 * rng.normal(size=3)), vector(rng.normal(size=3)), rng.uniform(0.3, 1.0))
    return steer(made, asked) if rng.random() < 0.5 else made


def hovering(rng, reference):
    """Near the hover at the reference."""
    p, heading = reference.position, reference.heading
    body = Body(add(p, vector(0.1 * rng.normal(size=3))), vector(0.1 * rng.normal(size=3)), hover(heading), STILL)
    return body, Actuators(690.0, 690.0, 0.0, 0.0), reference


def cruising(rng, reference):
    """Near the trim on a leg, far from its end or not."""
    plant = on_leg(15.0)
    end = plant.body.position._replace(x=rng.choice((10.0, 400.0)))
    path = leg(plant.body.position, end, 15.0, stop=bool(rng.random() < 0.7))
    return plant.body, plant.actuators, reference._replace(path=path)


def tumbling(rng, reference):
    """Anyhow."""
    moves = vector(8.0 * rng.normal(size=3)), rotation(rng.normal(size=3)), vector(2.0 * rng.normal(size=3))
    acting = Actuators(*rng.uniform(300.0, 1000.0, 2).tolist(), *rng.uniform(-0.5, 0.5, 2).tolist())
    return Body(vector(20.0 * rng.normal(size=3)), *moves), acting, reference


def random_case(rng, kind):
    """A flight of a kind with anything in its memory, and its reference."""
    body, acting, reference = kind(rng, random_reference(rng))
    plant = Plant(body, acting, feet_aloft())
    wind = STILL if kind is not tumbling else vector(5.0 * rng.normal(size=3))
    flight = SIMULATION.flight
    estimate = observe(plant, vector(rng.normal(size=3)), wind, bool(rng.random() < 0.5))
    steering = hover_attitude.start(estimate, DESIGN.gains.hover_attitude, NOMINAL)
    if rng.random() < 0.5:
        steering = steering._replace(attitude=rotation(rng.normal(size=3)))
    states = flight.controller.states._replace(
        steering=steering, integral=vector(rng.normal(size=3)), course=rng.choice((reference.heading, 1.0))
    )
    controller = flight.controller._replace(
        is_armed=bool(rng.random() < 0.5),
        has_crashed=bool(rng.random() < 0.5),
        is_flying=bool(rng.random() < 0.5),
        is_landing=bool(rng.random() < 0.5),
        law_time=rng.choice((0.0, 1.0, 10.0)),
        at_rest=rng.choice((0.0, 1.0)),
        inhibited=rng.choice((0.0, 0.5)),
        states=states,
    )
    return flight._replace(plant=plant, estimate=estimate, controller=controller), reference


@cache
def cases():
    """Flights, their references and the guards that hold."""
    rng = np.random.default_rng(5)
    drawn = [random_case(rng, kind) for _ in range(COUNT) for kind in (hovering, cruising, tumbling)]
    return [(flight, reference, seen(flight, reference)) for flight, reference in drawn]


@cache
def seekers():
    """For each guard the code that the loop would be made of if it alone led out of a law."""
    rows = [replace(TABLE[Law.ALIGN][0], when=(guard,), unless=(), resets=()) for guard in GUARDS]
    return [Register(table={**TABLE, Law.ALIGN: (row,)}).compile().seek for row in rows]


def seen(flight, reference):
    """Bits of the guards that hold, by the code that the loop is made of."""
    records = record_of(Flight, flight)[0], record_of(Reference, reference)[0], DESIGNS[0]
    return sum(guard.bit for guard, seek in zip(GUARDS, seekers(), strict=True) if seek(int(Law.ALIGN), *records) == 0)


def jumped(law, row, flight, reference):
    """The flight after a jump, by the code that the loop is made of."""
    kept = record_of(Flight, flight._replace(controller=flight.controller._replace(law=int(law))))
    COMPILED.jump(int(law), row, kept[0], record_of(Reference, reference)[0], DESIGNS[0])
    return named_from(Flight, kept[0].item())


def by_hand(guard, flight, reference):
    """Whether a guard holds, its arguments put together here."""
    c, gains, e = flight.controller, DESIGN.gains, flight.estimate
    known = {
        "estimate": e,
        "reference": reference,
        "thresholds": DESIGN.thresholds,
        "guidance": gains.line_of_sight.guidance,
        "v_hover": hover_linear.lyapunov(e, reference, gains.hover_linear),
        "v_integral": hover_linear.integral_share(e, reference, gains.hover_linear, c.states.integral),
        "v_forward": forward_linear.lyapunov(e, reference, gains.forward_linear),
        "v_attitude": hover_attitude.lyapunov(e, gains.hover_attitude, c.states.steering),
        "course": c.states.course,
        "law_time": c.law_time,
        "at_rest": c.at_rest,
        "inhibited": c.inhibited,
        "is_armed": c.is_armed,
        "has_crashed": c.has_crashed,
        "is_flying": c.is_flying,
        "is_landing": c.is_landing,
        "increment": c.states.increment,
    }
    return guard.test(**{name: known[name] for name in inspect.signature(guard.test).parameters})


@pytest.mark.long
def test_the_loop_gives_each_guard_what_it_asks_for():
    held = np.zeros(len(GUARDS), int)
    for flight, reference, bits in cases():
        expected = [by_hand(guard, flight, reference) for guard in GUARDS]
        assert [bool(bits & guard.bit) for guard in GUARDS] == expected
        held += expected
    by_tuning = (indi_chosen, indi_alone, robust_pi_chosen, has_forward_linear)
    by_state = [i for i, guard in enumerate(GUARDS) if guard not in by_tuning]
    assert (held[by_state] > 0).all(), "each guard holds in some of these flights"
    assert (held[by_state] < len(cases())).all(), "and does not in others"


def test_which_school_flies_is_a_matter_of_the_tuning():
    assert set(CONTROLLERS) == {*CONTROLLER_NAMES, HOVERING_CONTROLLER}
    by_name = {name: thresholds(NOMINAL, Tuning(controller=number)) for name, number in CONTROLLERS.items()}
    guards = (indi_chosen, indi_alone, robust_pi_chosen)
    chosen = {name: tuple(guard.test(made) for guard in guards) for name, made in by_name.items()}
    assert chosen == {
        "report": (False, False, False),
        "indi": (True, True, False),
        "robust-pi": (False, False, True),
        "hybrid": (True, False, False),
    }


@pytest.mark.long(after=1)
@pytest.mark.parametrize(("law", "row", "jump"), JUMPS, ids=[f"{law.name}-{jump.name}" for law, _, jump in JUMPS])
def test_what_a_jump_clears_does_not_hold_after_it_and_what_it_does_not_set_is_as_before(law, row, jump):
    resets = (begin_anew, *jump.resets)
    cleared = {guard for made in resets for guard in made.clears}
    parts = {part for made in resets for part in made.sets} | {"law"}
    held = 0
    for flight, reference, before in cases():
        if not before & sum(guard.bit for guard in cleared) & ~held and held:
            continue  # what it clears was seen to be cleared already
        held |= before
        then = jumped(law, row, flight, reference)
        after = seen(then, reference)
        assert then.controller.law == jump.target
        assert [guard.name for guard in cleared if after & guard.bit] == []
        kept = [name for name in flight.controller._fields if name not in parts and name != "states"]
        assert [getattr(then.controller, name) for name in kept] == [getattr(flight.controller, name) for name in kept]
        slots = [slot for slot in flight.controller.states._fields if slot not in parts]
        assert all(getattr(then.controller.states, s) == getattr(flight.controller.states, s) for s in slots)
        assert then._replace(controller=flight.controller) == flight
        changed = {guard for guard in GUARDS if (before ^ after) & guard.bit}
        # No longer inhibited, an integral that V counted is forgotten, and what the law waited for begins anew.
        assert {guard.name for guard in changed - cleared} <= {"v_below_enter", "v_below_settled", "aligned"}
    assert all(held & guard.bit for guard in cleared), "each that it clears held before it in some of these flights"


def test_a_tilt_that_was_commanded_keeps_the_linear_law_out_for_a_second_and_is_handed_over():
    ((law, row, _),) = [case for case in JUMPS if case[2].name == "let_go"]
    controller = jumped(law, row, *cases()[0][:2]).controller
    assert controller.inhibited == LET_GO_TIME
    assert controller.states.handover == handover.requested()
    assert (controller.law_time, controller.at_rest) == (0.0, 0.0)


def test_every_part_that_a_reset_sets_is_a_part_of_the_controller():
    known = {path.split(".")[2] for path in paths_of(Flight) if path.startswith(".controller.")}
    known |= {path.split(".")[3] for path in paths_of(Flight) if path.startswith(".controller.states.")}
    assert {part for _, _, jump in JUMPS for made in (begin_anew, *jump.resets) for part in made.sets} <= known


def test_a_vehicle_that_is_disarmed_in_the_air_is_not_steered():
    made = Simulation(NOMINAL, start=Start(up=30.0, airborne=True))
    made.begin_flight(Law.HOVER_ZERO_MOMENT)
    made.reference = hover_at((3.0, 2.0, 30.0), 0.0)
    made.step(0.3)
    made.armed = False
    made.step(0.1)
    assert made.law is Law.LANDED
    assert tuple(made.command) == (0.0, 0.0, 0.0, 0.0)
