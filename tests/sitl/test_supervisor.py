"""The supervisor's table in every situation there is, its guards as the compiled flow takes them, and its resets."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.flow import _leaves
from sitl.hybrid.automaton import enabled, settle
from sitl.hybrid.conditions import Condition
from sitl.hybrid.supervisor import TABLE, Law, jump_sets
from sitl.kernels.quaternion import from_rotation_vector, multiply
from sitl.kernels.state import P, Q, V, W
from sitl.watch import FALL
from tests.support.wing_flight import Flight, on_a_leg, waypoint

C = Condition
EVERY = np.arange(1 << int(max(C)).bit_length(), dtype=np.uint32)  # every situation: one bit per condition
AIRBORNE = [law for law in Law if law is not Law.LANDED]
LONGEST = 3  # jumps at one instant
BUSIEST = 16  # jumps in a minute of gusts

situations = st.integers(0, int(EVERY[-1]))
laws = st.sampled_from(list(Law))


def chains(law, x, depth=0):
    """Every chain of jumps from a law in situations ``x``: its end, its length and the situations that lead there."""
    assert depth <= len(TABLE), f"jumps without end from {law.name}"
    for jump in TABLE[law]:
        when, unless = np.uint32(jump.guard.when), np.uint32(jump.guard.unless)
        hit = ((x & when) == when) & ((x & unless) == 0)
        if hit.any():
            yield from chains(jump.target, x[hit] & np.uint32(jump.reset(int(EVERY[-1]))), depth + 1)
            x = x[~hit]
    yield law, depth, x


@pytest.mark.parametrize("law", list(Law), ids=lambda law: law.name)
def test_no_situation_whatever_makes_it_jump_without_end(law):
    """All combinations of bits, physically possible or not; and it ends where settling again does nothing."""
    ends = list(chains(law, EVERY))
    assert sum(x.size for *_, x in ends) == EVERY.size
    assert max(depth for _, depth, x in ends if x.size) <= LONGEST
    for end, _, x in ends:
        assert all(after == end for after, depth, y in chains(end, x) if y.size or depth == 0)


def test_settling_says_the_same_as_the_chains_in_twenty_thousand_random_situations():
    rng = np.random.default_rng(20)
    bits, modes = rng.integers(0, EVERY.size, 20_000), rng.integers(0, len(Law), 20_000)
    longest = 0
    for x, mode in zip(bits.tolist(), modes.tolist(), strict=True):
        settled, taken = settle(TABLE, Law(mode), x)
        ((end, depth, _),) = [chain for chain in chains(Law(mode), np.array([x], dtype=np.uint32)) if chain[2].size]
        assert (settled, len(taken)) == (end, depth)
        longest = max(longest, depth)
    assert 2 <= longest <= LONGEST


@settings(max_examples=300)
@given(law=laws, x=situations)
def test_the_compiled_flow_leaves_exactly_where_the_table_jumps(law, x):
    assert _leaves(x, int(law), jump_sets()) == (enabled(TABLE, law, x) is not None)


@pytest.mark.parametrize("law", AIRBORNE, ids=lambda law: law.name)
def test_the_compiled_guards_are_the_tables_in_every_situation(law):
    sets = jump_sets()[law].astype(np.uint32)
    hit = np.zeros(EVERY.size, dtype=bool)
    for when, unless in sets:
        hit |= ((EVERY & when) == when) & ((EVERY & unless) == 0)
    stays = np.concatenate([x for end, depth, x in chains(law, EVERY) if depth == 0])
    assert np.array_equal(np.sort(stays), EVERY[~hit])


@pytest.mark.parametrize("law", AIRBORNE, ids=lambda law: law.name)
def test_disarming_always_lands(law):
    disarmed = EVERY[(EVERY & C.ARMED) == 0]
    assert {(end, depth) for end, depth, x in chains(law, disarmed) if x.size} == {(Law.LANDED, 1)}


@pytest.mark.parametrize("law", AIRBORNE, ids=lambda law: law.name)
def test_a_fall_is_always_caught_and_until_it_ends_nothing_else_is_tried(law):
    falling = EVERY[(EVERY & (C.ARMED | C.FALLING | C.RESTING)) == C.ARMED | C.FALLING]
    caught = {(end, depth) for end, depth, x in chains(law, falling) if x.size}
    assert caught == {(Law.FAILSAFE, 0 if law is Law.FAILSAFE else 1)}


@pytest.mark.parametrize("law", AIRBORNE, ids=lambda law: law.name)
def test_a_wish_for_the_hover_is_always_heard(law):
    """Armed, upright and slow, nowhere to go: from every law some chain of moments leads back to the hover."""
    seen, here = [], law
    calm = C.ARMED | C.FLYING | C.CALM | C.RECOVERED | C.STANDING | C.NEAR | C.SETTLED | C.STILL | C.DWELT
    for _ in range(3):
        here, _ = settle(TABLE, here, int(calm))
        seen.append(here)
    assert seen[-1] is Law.HOVER_LINEAR


def test_every_law_is_flown_by_somebody():
    """From the ground over the wing and back, and out of a fall: the laws are the ones the table says."""
    flight = Flight(airborne=False)
    flight.fly_mission([waypoint(0.0, 0.0, 20.0), waypoint(120.0, 0.0, 20.0)])
    seen = {Law(int(law)) for law in flight.law} | {jump.source for jump in flight.vehicle.jumps}
    assert seen == set(Law) - {Law.FAILSAFE, Law.HOVER_ATTITUDE}  # what it falls into, and what a program streams


@pytest.mark.parametrize("beyond", [1.0, 4.0])
def test_a_fall_out_of_the_hover_is_caught_and_flown_on_from(beyond):
    """Tail first the elevons are reversed: it turns over, dives and pulls out before it stands again."""
    vehicle = on_a_leg()
    vehicle.plant[P + 2], vehicle.plant[V + 2] = 500.0, -FALL - beyond
    lowest = math.inf
    while "recover" not in [jump.name for jump in vehicle.jumps]:
        vehicle.advance(50)
        lowest = min(lowest, vehicle.plant[P + 2])
        assert vehicle.time < 30.0
    assert vehicle.jumps[0].name == "catch_fall"
    assert 500.0 - lowest < 100.0


def test_random_states_under_random_laws_in_gusts_settle_down():
    """No attitude, velocity or law to begin with makes the supervisor chatter for a minute."""
    rng = np.random.default_rng(16)
    for _ in range(8):
        vehicle = on_a_leg(gusts=1.0, seed=int(rng.integers(1000)))
        axis = rng.normal(size=3)
        turn = from_rotation_vector(rng.uniform(0.0, np.pi) * axis / np.linalg.norm(axis))
        vehicle.plant[P + 2] = 1000.0
        vehicle.plant[Q:W] = multiply(vehicle.plant[Q:W].copy(), turn)
        vehicle.plant[V:Q], vehicle.plant[W : W + 3] = rng.uniform(-8.0, 8.0, 3), rng.uniform(-3.0, 3.0, 3)
        vehicle.begin_flight(Law(int(rng.integers(1, len(Law)))))
        vehicle.advance(30_000)
        assert len(vehicle.jumps) <= BUSIEST, [jump.name for jump in vehicle.jumps]
        assert np.linalg.norm(vehicle.plant[W : W + 3]) < 5.0
