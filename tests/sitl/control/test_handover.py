"""Bumpless transfer: nothing steps, and what was added is gone in the end."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.control import handover
from sitl.control.allocation import Virtual, allocate
from sitl.control.handover import FADE
from sitl.model.airframe_files import load
from sitl.model.state import Actuators

A = load("nominal").parameters
DT = 0.002

virtuals = st.builds(Virtual, st.floats(0.5, 5.0), st.floats(0.5, 5.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
commands = st.builds(
    Actuators, st.floats(200.0, 1000.0), st.floats(200.0, 1000.0), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)
)


@given(u=virtuals, acting=commands)
def test_the_first_command_is_where_the_actuators_are(u, acting):
    flown, after = handover.smoothed(u, acting, A, handover.requested(), DT)
    command, _ = allocate(flown, A)
    assert command == pytest.approx(acting, rel=1e-9, abs=1e-9)
    assert not after.pending


@given(u=virtuals, acting=commands)
def test_without_a_transfer_the_law_s_own_command_is_flown(u, acting):
    assert handover.smoothed(u, acting, A, handover.none(), DT) == (u, handover.none())


@given(u=virtuals, acting=commands)
def test_the_difference_fades_and_ends(u, acting):
    transfer, sizes, tau = handover.requested(), [], round(FADE / DT)
    while len(sizes) <= tau or (transfer != handover.none() and len(sizes) < 3000):
        flown, transfer = handover.smoothed(u, acting, A, transfer, DT)
        sizes.append(sum(abs(x - y) for x, y in zip(flown, u, strict=True)))
    assert sizes[tau] == pytest.approx(sizes[0] * (1.0 - DT / FADE) ** tau, rel=1e-6, abs=1e-12)
    assert transfer == handover.none()  # to the bit: it does not fade for ever


def test_a_transfer_begins_with_nothing_to_fade():
    assert handover.requested() == (True, (0.0, 0.0, 0.0, 0.0))
    assert handover.none() == (False, (0.0, 0.0, 0.0, 0.0))


def test_where_no_inflow_is_told_a_transfer_takes_the_air_to_stand_still():
    a, acting = load("collage").parameters, Actuators(600.0, 500.0, 0.1, -0.1)
    asked = Virtual(2.0, 2.0, 0.0, 0.0), acting, a, handover.requested(), DT
    assert handover.smoothed(*asked) == handover.smoothed(*asked, 0.0)
    assert handover.smoothed(*asked) != handover.smoothed(*asked, 1.0)
