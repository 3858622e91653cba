"""Solutions on hybrid time: their laws, on systems whose solutions are known."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.lab.reproduction.hybrid_systems import (
    CYCLE,
    MAX_JUMPS_AT_ONCE,
    GuardedJump,
    HybridError,
    HybridSystem,
    SolutionEnd,
    accumulation,
    solve,
)

CLOCK = {"run": np.ones_like}  # x' = 1


def clock(*jumps, inside=None):
    return HybridSystem(CLOCK, {"run": jumps}, {"run": inside} if inside else {})


def wrap(limit):
    return GuardedJump("wrap", lambda x: x[0] >= limit, "run", "full", np.zeros_like)


@settings(max_examples=30, deadline=None)
@given(period=st.floats(0.05, 3.0), dt=st.floats(0.01, 0.5))
def test_jumps_are_located_whatever_the_step(period, dt):
    """A timer that wraps at ``period`` jumps at its multiples."""
    arc = solve(clock(wrap(period)), "run", (0.0,), 5.0, dt=dt)
    assert [event.t for event in arc.events] == pytest.approx(
        [period * n for n in range(1, len(arc.events) + 1)], abs=1e-9
    )
    assert int((5.0 - 1e-9) / period) <= len(arc.events) <= int((5.0 + 1e-9) / period)


def test_hybrid_time_only_grows_and_t_and_j_never_at_once():
    arc = solve(clock(wrap(0.3)), "run", (0.0,), 2.0, dt=0.1)
    assert (np.diff(arc.t) >= 0.0).all()
    assert set(np.diff(arc.j)) == {0, 1}
    assert (np.diff(arc.t)[np.diff(arc.j) == 1] == 0.0).all()
    assert len(arc.t) == len(arc.j) == len(arc.x) == len(arc.mode)


def test_an_event_records_the_jump_and_the_states_before_and_after():
    event = solve(clock(wrap(1.0)), "run", (0.0,), 1.5).events[0]
    assert (event.j, event.name, event.reason, event.source, event.target) == (1, "wrap", "full", "run", "run")
    assert event.before == pytest.approx([1.0])
    assert event.after == pytest.approx([0.0], abs=0.0)


def test_a_start_in_the_jump_set_jumps_before_it_flows():
    arc = solve(clock(wrap(1.0)), "run", (4.0,), 0.5)
    assert arc.events[0].t == 0.0
    assert arc.x[-1] == pytest.approx([0.5])


def test_jumps_have_priority_where_the_flow_set_overlaps():
    arc = solve(clock(wrap(1.0), inside=lambda x: x[0] <= 9.0), "run", (0.0,), 1.5)
    assert arc.x.max() == pytest.approx(1.0)


def test_a_solution_that_can_neither_flow_nor_jump_ends_there():
    arc = solve(clock(inside=lambda x: x[0] <= 0.7), "run", (0.0,), 2.0)
    assert arc.end is SolutionEnd.STUCK
    assert arc.t[-1] == pytest.approx(0.7)


def test_the_number_of_jumps_is_bounded():
    arc = solve(clock(wrap(0.1)), "run", (0.0,), 100.0, max_jumps=7)
    assert arc.end is SolutionEnd.JUMPS
    assert arc.j[-1] == 7


def test_jumps_without_end_at_one_instant_are_reported_as_zeno():
    arc = solve(clock(GuardedJump("again", lambda x: x[0] >= 1.0, "run")), "run", (0.0,), 5.0)
    assert arc.end is SolutionEnd.ZENO
    assert arc.zeno_time == pytest.approx(1.0)
    assert len(arc.events) == MAX_JUMPS_AT_ONCE + 1


def test_flow_is_integrated_to_fourth_order():
    spring = HybridSystem({"": lambda x: np.array((x[1], -x[0]))}, {"": ()})
    error = [abs(solve(spring, "", (1.0, 0.0), 1.0, dt=dt).x[-1, 0] - math.cos(1.0)) for dt in (0.1, 0.05)]
    assert error[0] / error[1] == pytest.approx(16.0, rel=0.1)


@given(ratio=st.floats(0.1, 0.95), first=st.floats(0.01, 10.0))
def test_the_accumulation_of_a_geometric_sequence_is_its_sum(ratio, first):
    times = np.cumsum(first * ratio ** np.arange(2 * CYCLE + 1))
    assert accumulation(times) == pytest.approx(first / (1.0 - ratio), rel=1e-6)


@given(period=st.floats(0.01, 10.0), growth=st.floats(1.0, 2.0))
def test_jumps_that_do_not_crowd_have_no_accumulation(period, growth):
    times = np.cumsum(period * growth ** np.arange(2 * CYCLE + 1))
    estimate = accumulation(times)
    assert estimate is None or estimate > times[-1] + 1e3  # rounding of an even rhythm


@pytest.mark.parametrize(
    ("flows", "jumps"),
    [
        (CLOCK, {}),
        (CLOCK, {"run": (GuardedJump("away", bool, "nowhere"),)}),
        (CLOCK, {"run": (), "extra": ()}),
    ],
)
def test_tables_that_do_not_fit_together_are_refused(flows, jumps):
    with pytest.raises(HybridError, match=r"nowhere|not those that jump"):
        HybridSystem(flows, jumps)


def test_an_unknown_start_and_a_step_of_zero_are_refused():
    with pytest.raises(HybridError, match="run"):
        solve(clock(), "stand", (0.0,), 1.0)
    with pytest.raises(HybridError, match="step 0"):
        solve(clock(), "run", (0.0,), 1.0, dt=0.0)


def test_a_flow_that_stops_being_finite_is_an_error_with_its_time():
    escape = HybridSystem({"": lambda x: x * x}, {"": ()})
    with np.errstate(over="ignore", invalid="ignore"), pytest.raises(HybridError, match="stops being finite"):
        solve(escape, "", (1e200,), 1.0)
