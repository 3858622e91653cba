"""Tables of jumps: settling, and its bound."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.errors import ZenoError
from sitl.lab.reproduction import hybrid_systems
from sitl.lab.reproduction.hybrid_systems import (
    CYCLE,
    MAX_JUMPS_AT_ONCE,
    GuardedJump,
    HybridError,
    HybridSystem,
    SolutionEnd,
    accumulation,
    enabled,
    settle,
    solve,
)

THERMOSTAT = {
    "off": (GuardedJump("too_cold", lambda x: x <= 19.0, "on"),),
    "on": (GuardedJump("warm_enough", lambda x: x >= 21.0, "off"),),
}


@given(x=st.floats(-50.0, 50.0), mode=st.sampled_from(["off", "on"]))
def test_settling_twice_is_settling_once(x, mode):
    once, _ = settle(THERMOSTAT, mode, x)
    assert settle(THERMOSTAT, once, x) == (once, [])


def test_hysteresis_keeps_the_mode_inside_its_band():
    assert settle(THERMOSTAT, "off", 20.0) == ("off", [])
    assert settle(THERMOSTAT, "on", 20.0) == ("on", [])


def test_jumps_follow_each_other_at_one_instant():
    chain = {n: (GuardedJump(f"to_{n + 1}", lambda x, n=n: x > n, n + 1),) for n in range(4)} | {4: ()}
    mode, taken = settle(chain, 0, 2.5)
    assert mode == 3
    assert [jump.name for jump in taken] == ["to_1", "to_2", "to_3"]


def test_the_first_enabled_jump_has_priority():
    table = {0: (GuardedJump("first", bool, 1), GuardedJump("second", bool, 2)), 1: (), 2: ()}
    assert enabled(table, 0, True).name == "first"
    assert enabled(table, 0, False) is None


def test_thresholds_without_a_gap_are_an_endless_chain_of_jumps():
    inverted = {
        "off": (GuardedJump("up", lambda x: x <= 21.0, "on"),),
        "on": (GuardedJump("down", lambda x: x >= 19.0, "off"),),
    }
    with pytest.raises(ZenoError, match="up -> down -> up"):
        settle(inverted, "off", 20.0)


# Solutions on hybrid time: their laws, on systems whose solutions are known.


CLOCK = {"run": np.ones_like}  # x' = 1


def clock(*jumps, inside=None):
    return HybridSystem(CLOCK, {"run": jumps}, {"run": inside} if inside else {})


def wrap(limit):
    return GuardedJump("wrap", lambda x: x[0] >= limit, "run", "full", np.zeros_like)


@pytest.mark.long
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


# The textbook systems against their closed forms.


def test_an_undamped_pendulum_keeps_its_energy():
    arc = hybrid_systems.pendulum().run()
    energy = hybrid_systems.pendulum_energy(arc.x, 1.0)
    assert np.ptp(energy) < 1e-6 * energy[0]
    assert arc.j[-1] == 0


def test_a_damped_pendulum_loses_energy_all_the_time():
    energy = hybrid_systems.pendulum_energy(hybrid_systems.pendulum(damping=0.5).run().x, 1.0)
    assert (np.diff(energy) <= 1e-9).all()


def test_a_pendulum_meets_an_upright_wall_at_the_speed_its_energy_gives():
    arc = hybrid_systems.pendulum_wall().run()
    assert arc.events[0].before[1] == pytest.approx(
        -math.sqrt(2.0 * hybrid_systems.G * (1.0 - math.cos(1.0))), rel=1e-6
    )


@pytest.mark.long
@settings(max_examples=10, deadline=None)
@given(restitution=st.floats(0.3, 1.0))
def test_each_wall_impact_keeps_the_square_of_the_restitution(restitution):
    arc = hybrid_systems.pendulum_wall(restitution=restitution).run()
    speeds = np.array([event.before[1] for event in arc.events])
    assert speeds[1:] == pytest.approx(restitution * speeds[:-1], rel=1e-5)
    assert arc.x[:, 0].min() > -1e-9
    assert arc.end is SolutionEnd.HORIZON


def test_a_pendulum_pressed_against_its_wall_is_zeno():
    arc = hybrid_systems.pendulum_wall(wall=0.5).run()
    assert arc.end is SolutionEnd.ZENO
    assert arc.x[-1] == pytest.approx([0.5, 0.0], abs=1e-4)


@pytest.mark.long
@settings(max_examples=15, deadline=None)
@given(inflow=st.floats(0.55, 0.85), shift=st.floats(-0.04, 0.04))
def test_the_hose_alternates_until_the_zeno_time(inflow, shift):
    outflows = (0.5 + shift, 0.5 - shift)
    arc = hybrid_systems.water_tanks(inflow, outflows).run()
    names = [event.name for event in arc.events]
    assert names == [("tank_2_low", "tank_1_low")[n % 2] for n in range(len(names))]
    expected = hybrid_systems.water_tanks_zeno_time((1.0, 1.0), inflow, outflows)
    assert arc.end is SolutionEnd.ZENO
    assert arc.zeno_time == pytest.approx(expected, abs=1e-6)


def test_tanks_that_gain_water_are_not_zeno():
    arc = hybrid_systems.water_tanks(inflow=1.2).run()
    assert arc.end is SolutionEnd.HORIZON
    assert math.isinf(hybrid_systems.water_tanks_zeno_time((1.0, 1.0), 1.2, (0.5, 0.5)))
    assert "not Zeno" in hybrid_systems.water_tanks(inflow=1.2).summary()


def test_the_room_stays_in_its_band_with_the_period_of_the_closed_form():
    arc = hybrid_systems.room_heating().run()
    assert 19.0 - 1e-9 <= arc.x.min() <= arc.x.max() <= 21.0 + 1e-9
    starts = np.array([event.t for event in arc.events if event.name == "too_cold"])
    period = hybrid_systems.room_heating_period(5.0, 25.0, (19.0, 21.0), 600.0)
    assert np.diff(starts) == pytest.approx(period, rel=1e-6)


@pytest.mark.long
@settings(max_examples=15, deadline=None)
@given(height=st.floats(0.1, 20.0), restitution=st.floats(0.2, 0.8))
def test_the_ball_comes_to_rest_at_the_zeno_time_of_the_closed_form(height, restitution):
    arc = hybrid_systems.bouncing_ball(height, restitution).run()
    assert arc.end is SolutionEnd.ZENO
    assert arc.zeno_time == pytest.approx(hybrid_systems.bouncing_ball_zeno_time(height, restitution), abs=1e-6)
    assert arc.x[:, 0].min() > -1e-9


def test_a_ball_that_loses_nothing_bounces_back_to_its_height_for_ever():
    arc = hybrid_systems.bouncing_ball(1.0, 1.0).run()
    assert arc.end is SolutionEnd.HORIZON
    assert arc.x[arc.t > 10.0, 0].max() == pytest.approx(1.0, abs=1e-3)
    assert math.isinf(hybrid_systems.bouncing_ball_zeno_time(1.0, 1.0))


@pytest.mark.parametrize("name", hybrid_systems.systems())
def test_every_system_summarises_its_run_as_text(name):
    system = hybrid_systems.systems()[name]
    text = system.summary()
    assert text.startswith(system.description)
    assert all(line.isprintable() and len(line) <= 120 for line in text.splitlines())
    assert ("stateDiagram" in text) == (name != "pendulum")
