"""The supervisor's table in every situation there is, and the code that is compiled from it."""

import inspect
import re
from dataclasses import replace
from functools import reduce
from operator import or_
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numba import njit

from protocol.dialect.vocabulary import Law
from sitl.compiled import kernel
from sitl.control.laws import VALUES
from sitl.lab.reproduction.hybrid_systems import enabled, settle
from sitl.simulation.dispatch import Register
from sitl.simulation.flight import Flight
from sitl.storage import record_type, writer
from sitl.supervisor import guards as g
from sitl.supervisor.guards import GUARDS
from sitl.supervisor.resets import begin_anew
from sitl.supervisor.table import TABLE, diagram

SITUATIONS = 1 << len(GUARDS)  # one bit per guard
WHOLE = [law for law in Law if law is not Law.CRASHED]
AIRBORNE = [law for law in WHOLE if law is not Law.LANDED]
MAX_JUMPS = 3  # at one instant
by_law = pytest.mark.parametrize("law", list(Law), ids=lambda law: law.name)
in_the_air = pytest.mark.parametrize("law", AIRBORNE, ids=lambda law: law.name)


def bits(*guards):
    return reduce(or_, (guard.bit for guard in guards), 0)


class Situations(NamedTuple):
    """All situations in which some guards hold and some others do not, whatever the rest."""

    held: int
    not_held: int

    def within(self, jump):
        """Those in which a jump is due, were it alone; None if it never is."""
        if self.held & jump.forbidden or self.not_held & jump.required:
            return None
        return Situations(self.held | jump.required, self.not_held | jump.forbidden)

    def outside(self, jump):
        """The others, each of them in one of the parts."""
        held, not_held = self
        for bit in (guard.bit for guard in GUARDS):
            if jump.required & bit & ~held:
                yield Situations(held, not_held | bit)
                held |= bit
            elif jump.forbidden & bit & ~not_held:
                yield Situations(held | bit, not_held)
                not_held |= bit

    def after(self, jump):
        """All that a jump may lead to."""
        kept, free = jump.after(SITUATIONS - 1), bits(*released(jump))
        return Situations(self.held & kept & ~free, (self.not_held | SITUATIONS - 1 & ~kept) & ~free)


def every(*fixed, hold=()):
    """Every situation in which ``hold`` hold and ``fixed`` do not."""
    return Situations(bits(*hold), bits(*fixed))


def looks_at(guard):
    """Everything that a guard depends on."""
    seen = set(inspect.signature(guard.test).parameters)
    return seen.union(*(inspect.signature(row.value).parameters for row in VALUES if row.name in seen))


def released(jump):
    """Guards that the resets of a jump may change, and do not clear."""
    resets = (begin_anew, *jump.resets)
    touched = {part for made in resets for part in made.sets}
    cleared = {guard for made in resets for guard in made.clears}
    return [guard for guard in GUARDS if looks_at(guard) & touched and guard not in cleared]


def chains(law, situations, depth=0):
    """Ends of all chains of jumps from a law: where, after how many jumps."""
    assert depth <= len(TABLE), f"jumps without end from {law.name}"
    left = [situations]
    for jump in TABLE[law]:
        for some in left:
            if hit := some.within(jump):
                yield from chains(jump.target, hit.after(jump), depth + 1)
        left = [part for some in left for part in (some.outside(jump) if some.within(jump) else [some])]
    if left:
        yield law, depth


def ends(law, situations):
    return set(chains(law, situations))


# Every combination of guards, physically possible or not


@by_law
def test_no_situation_whatever_makes_it_jump_without_end(law):
    """Whatever a reset map may change that it does not clear is free: the proof holds for every flight."""
    assert max(depth for _, depth in ends(law, every())) <= MAX_JUMPS


def test_what_a_jump_leaves_open_is_only_what_it_takes_back_from_the_linear_law():
    """Its inhibition, an integral that V counted, the time it waited, and how far it was from INDI's attitude."""
    assert {guard for jumps in TABLE.values() for jump in jumps for guard in released(jump)} <= {
        g.aligned,
        g.v_below_enter,
        g.v_below_settled,
        g.out_of_hand,
    }


@njit
def first_row(x, required, forbidden):
    """The first row that is due in a situation; -1 without any."""
    for row in range(required.size):
        if x & (required[row] | forbidden[row]) == required[row]:
            return row
    return -1


@pytest.fixture(scope="module")
def wrong():
    """Finds a situation in which the compiled ``due`` or ``seek`` takes another row than the table; -1 without any.

    Every one of the guards that the law's rows look at, each with none, all and some of the other guards besides.
    ``seek`` looks at the state of a flight, so it is made for guards that read their bit from a field of it.
    """

    def reading(bit):
        @kernel
        def test(law_time):
            return int(law_time) & bit != 0

        return test

    toys = {guard: replace(guard, test=reading(guard.bit)) for guard in GUARDS}
    table = {
        law: tuple(
            replace(jump, when=tuple(map(toys.get, jump.when)), unless=tuple(map(toys.get, jump.unless)))
            for jump in jumps
        )
        for law, jumps in TABLE.items()
    }
    seek = Register(table=table).compile().seek
    put = writer(Flight, lambda flight: flight.controller.law_time)

    @njit(error_model="numpy")
    def first_wrong(law, required, forbidden, looked_at, others, flights):
        flight, held = flights[0], 0
        while True:
            for other in others:
                x = held | other & ~looked_at
                expected = first_row(x, required, forbidden)
                put(flight, float(x))
                if seek(law, flight, flight, flight) != expected:
                    return x
            held = (held - looked_at) & looked_at  # the next of its subsets
            if held == 0:
                return -1

    others = np.array([0, SITUATIONS - 1, *np.random.default_rng(11).integers(0, SITUATIONS, 14)])

    def found(law, jumps):
        required, forbidden = (np.array([getattr(j, part) for j in jumps], int) for part in ("required", "forbidden"))
        looked_at = bits(*{guard for jump in TABLE[law] for guard in (*jump.when, *jump.unless)})
        return first_wrong(int(law), required, forbidden, looked_at, others, np.zeros(1, record_type(Flight)))

    return found


@pytest.mark.long
@by_law
def test_the_compiled_table_takes_exactly_the_jumps_of_the_table(law, wrong):
    assert wrong(law, TABLE[law]) == -1
    assert wrong(law, TABLE[law][1:]) >= 0 or not TABLE[law]


@in_the_air
def test_disarming_always_lands(law):
    assert ends(law, every(g.armed, g.crashed)) == {(Law.LANDED, 1)}


@pytest.mark.parametrize("law", WHOLE, ids=lambda law: law.name)
def test_a_crash_ends_everything_at_once_and_for_good(law):
    assert ends(law, every(hold=(g.crashed,))) == {(Law.CRASHED, 1)}
    assert TABLE[Law.CRASHED] == ()


@in_the_air
def test_a_fall_is_always_caught_and_until_it_ends_nothing_else_is_tried(law):
    falling = every(g.resting, g.crashed, g.indi_chosen, hold=(g.armed, g.falling))
    jumps = 0 if law is Law.FAILSAFE else 1 + (law is Law.INDI)
    assert {end for end, _ in ends(law, falling)} == {Law.FAILSAFE}
    assert max(count for _, count in ends(law, falling)) == jumps


@in_the_air
def test_where_indi_is_chosen_it_flies_whatever_happens_and_catches_its_own_falls(law):
    """From every law within one jump; out of it leads the ground alone."""
    flying = every(g.resting, g.crashed, hold=(g.armed, g.indi_chosen, g.indi_alone))
    assert ends(law, flying) == {(Law.INDI, 0 if law is Law.INDI else 1)}


@pytest.mark.parametrize("law", [Law.HOVER_LINEAR, Law.HOVER_ZERO_MOMENT, Law.TO_HOVER], ids=lambda law: law.name)
def test_where_the_robust_pi_law_is_chosen_it_takes_over_every_hover_and_gives_back_what_it_loses(law):
    still = bits(g.armed, g.robust_pi_chosen, g.upright_and_slow, g.standing, g.recovered, g.dwell_elapsed)
    assert settle(TABLE, law, still)[0] is Law.ROBUST_PI
    assert settle(TABLE, law, still | g.forward_requested.bit | g.leg_long_enough.bit)[0] is Law.ROBUST_PI
    assert settle(TABLE, Law.ROBUST_PI, still & ~g.upright_and_slow.bit)[0] is Law.HOVER_ZERO_MOMENT
    assert settle(TABLE, Law.ROBUST_PI, still & ~g.robust_pi_chosen.bit)[0] is not Law.ROBUST_PI
    assert settle(TABLE, Law.ROBUST_PI, still | g.attitude_commanded.bit)[0] is Law.HOVER_ATTITUDE


def test_indi_does_not_change_between_hover_and_cruise():
    chosen = {g.indi_chosen, g.indi_alone}
    within = {jump.name for jump in TABLE[Law.INDI] if not chosen & {*jump.when, *jump.unless}}
    assert within == {"crash", "disarm", "touch_down"}


@pytest.mark.parametrize("law", [law for law in AIRBORNE if law is not Law.HOVER_LINEAR], ids=lambda law: law.name)
def test_in_the_hybrid_indi_takes_over_from_every_other_but_in_a_fall(law):
    flying = bits(g.armed, g.indi_chosen, g.recovered, g.dwell_elapsed)
    assert settle(TABLE, law, flying)[0] is Law.INDI


def test_in_the_hybrid_indi_gives_the_calm_hover_to_the_proved_law_and_takes_back_what_that_does_not_do():
    calm = bits(g.armed, g.indi_chosen, g.v_below_enter, g.standing, g.wind_calm, g.dwell_elapsed)
    assert settle(TABLE, Law.INDI, calm)[0] is Law.HOVER_LINEAR
    assert settle(TABLE, Law.INDI, calm | g.indi_alone.bit)[0] is Law.INDI
    assert settle(TABLE, Law.HOVER_LINEAR, calm | g.forward_requested.bit)[0] is Law.INDI
    left = calm & ~g.v_below_enter.bit | g.v_above_leave.bit
    assert settle(TABLE, Law.HOVER_LINEAR, left)[0] is Law.INDI
    assert settle(TABLE, Law.HOVER_LINEAR, calm)[0] is Law.HOVER_LINEAR


def test_attitudes_that_are_streamed_are_flown_by_their_own_law_unless_indi_is_alone():
    asked = bits(g.armed, g.indi_chosen, g.attitude_commanded, g.upright_and_slow)
    for law in (Law.INDI, Law.HOVER_LINEAR):
        assert settle(TABLE, law, asked)[0] is Law.HOVER_ATTITUDE
        assert settle(TABLE, law, asked | g.indi_alone.bit)[0] is Law.INDI
    assert settle(TABLE, Law.HOVER_ATTITUDE, asked & ~g.attitude_commanded.bit)[0] is Law.INDI


def test_in_the_hybrid_indi_gives_up_what_is_out_of_hand_and_takes_it_back_once_it_is_caught():
    thrown = bits(g.armed, g.indi_chosen, g.out_of_hand)
    assert settle(TABLE, Law.INDI, thrown)[0] is Law.FAILSAFE
    assert settle(TABLE, Law.INDI, thrown | g.indi_alone.bit)[0] is Law.INDI
    flying = bits(g.armed, g.indi_chosen)
    assert settle(TABLE, Law.FAILSAFE, flying)[0] is Law.FAILSAFE
    for enough in (g.caught.bit, bits(g.recovered, g.dwell_elapsed)):
        assert settle(TABLE, Law.FAILSAFE, flying | enough)[0] is Law.INDI
        assert settle(TABLE, Law.FAILSAFE, flying | enough | g.falling.bit)[0] is Law.FAILSAFE


# The table as an automaton


@settings(max_examples=200)
@given(law=st.sampled_from(list(Law)), x=st.integers(0, SITUATIONS - 1))
@example(law=Law.HOVER_ATTITUDE, x=bits(g.armed, g.v_below_enter))  # let go near: not linear at once
def test_settling_ends_in_the_flow_set_of_one_of_the_chains(law, x):
    settled, taken = settle(TABLE, law, x)
    assert (settled, len(taken)) in ends(law, Situations(x, SITUATIONS - 1 & ~x))
    for jump in taken:
        x = jump.after(x)
    assert enabled(TABLE, settled, x) is None
    assert settle(TABLE, settled, x) == (settled, [])


def test_some_situations_take_several_jumps_at_once():
    rng = np.random.default_rng(20)
    drawn = zip(rng.integers(0, SITUATIONS, 20_000).tolist(), rng.integers(0, len(Law), 20_000).tolist(), strict=True)
    assert 2 <= max(len(settle(TABLE, Law(law), x)[1]) for x, law in drawn) <= MAX_JUMPS


@in_the_air
def test_a_wish_for_the_hover_is_always_heard(law):
    """Armed, upright and slow, nowhere to go: from every law some chain of moments leads back to the hover."""
    calm = bits(
        g.armed,
        g.flight_requested,
        g.upright_and_slow,
        g.recovered,
        g.standing,
        g.v_below_enter,
        g.v_below_settled,
        g.wind_calm,
        g.dwell_elapsed,
    )
    here = law
    for _ in range(3):
        here, _ = settle(TABLE, here, calm)
    assert here is Law.HOVER_LINEAR


def test_every_law_has_its_row_and_every_jump_leads_to_another_law_for_a_reason():
    assert set(TABLE) == set(Law)
    jumps = [(law, jump) for law, rows in TABLE.items() for jump in rows]
    assert all(jump.target is not law and jump.target in TABLE and jump.reason for law, jump in jumps)
    assert all(jump.when or jump.unless for _, jump in jumps)
    assert all(not jump.required & jump.forbidden for _, jump in jumps)


def test_no_guard_is_registered_twice_nor_without_use_nor_without_a_meaning():
    assert [guard.bit for guard in GUARDS] == [1 << i for i in range(len(GUARDS))]
    assert len({guard.name for guard in GUARDS}) == len(GUARDS)
    used = {guard for rows in TABLE.values() for jump in rows for guard in (*jump.when, *jump.unless)}
    assert used == set(GUARDS)
    assert all(guard.meaning.endswith(".") for guard in GUARDS)


def test_the_diagram_draws_every_jump_of_the_table_once():
    head, *lines = diagram().splitlines()
    groups = dict(re.findall(r'state "all but (.*)" as (\w+)', "\n".join(lines)))
    most = {group: {law.name for law in Law} - set(others.split(", ")) for others, group in groups.items()}
    arrows = re.findall(r"^    (\w+) --> (\w+): (.*)$", "\n".join(lines), re.MULTILINE)
    assert (head, len(lines)) == ("stateDiagram-v2", len(groups) + len(arrows))
    assert sorted(
        (law, target, name)
        for begin, target, names in arrows
        for law in most.get(begin, [begin])
        for name in names.split(", ")
    ) == sorted((law.name, jump.target.name, jump.name) for law, jumps in TABLE.items() for jump in jumps)
