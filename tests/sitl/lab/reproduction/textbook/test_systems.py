"""The textbook systems against their closed forms."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.lab.reproduction import hybrid_systems
from sitl.lab.reproduction.hybrid_systems import SolutionEnd


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
