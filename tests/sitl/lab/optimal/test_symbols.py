"""The plant with CasADi's symbols: the numbers of the compiled plant, up to what kinks are rounded by."""

import numpy as np
import pytest

from sitl import Vector, load_airframe
from sitl.lab.identification.replay import accelerations
from sitl.model.battery import drawn_power
from sitl.model.state import Actuators

ca = pytest.importorskip("casadi")
symbols = pytest.importorskip("sitl.lab.optimal.symbols")

WIND = Vector(1.0, -2.0, 0.5)
FORCE, TURNING, POWER = 0.01, 0.05, 0.01  # tolerances: [m/s2], [rad/s2], share of the power


def drawn_states(a, count, seed):
    """States of the plant anywhere: tumbling, backwards, stalled, actuators anywhere within their limits, (n, 17)."""
    random = np.random.default_rng(seed)
    q = random.normal(size=(count, 4))
    return np.column_stack(
        [
            random.uniform(-50.0, 50.0, (count, 3)),
            random.uniform(-20.0, 20.0, (count, 3)),
            q / np.linalg.norm(q, axis=1, keepdims=True),
            random.uniform(-6.0, 6.0, (count, 3)),
            random.uniform(a.omega_min, a.omega_max, (count, 2)),
            random.uniform(-a.delta_max, a.delta_max, (count, 2)),
        ]
    )


def rotations(q):
    """Matrices from body to world, (n, 3, 3)."""
    w, x, y, z = q.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


@pytest.mark.parametrize("name", ["darko", "collage", "nominal", "passive"])
def test_it_accelerates_as_the_compiled_plant_anywhere(name):
    a = load_airframe(name).parameters
    x = ca.SX.sym("x", 17)
    plant = ca.Function("plant", [x], list(symbols.plant_rates(x, WIND, a)))
    states = drawn_states(a, 400, seed=3)
    rates, power = (np.asarray(value).T for value in plant.map(len(states))(states.T))
    body = rotations(states[:, 6:10])
    through = np.einsum("kji,kj->ki", body, states[:, 3:6] - np.array(WIND))
    force, turning = accelerations(through, np.ascontiguousarray(states[:, 10:13]), states[:, 13:].copy(), a)
    expected = np.einsum("kij,kj->ki", body, force) - np.array([0.0, 0.0, a.g])
    assert np.array_equal(rates[:, :3], states[:, 3:6])
    assert np.abs(rates[:, 3:6] - expected).max() < FORCE
    assert np.abs(rates[:, 10:13] - turning).max() < TURNING
    exact = [drawn_power(Actuators(*s[13:]), float(v[0]), a) for s, v in zip(states, through, strict=True)]
    assert np.abs(power[:, 0] - exact).max() < POWER * np.abs(exact).max()


def test_both_ways_of_a_decision_are_kept():
    from sitl.model.stall import slipstream_speed

    a = load_airframe("darko").parameters
    v, T = ca.SX.sym("v"), ca.SX.sym("T")
    found = symbols.symbolic(slipstream_speed)(symbols.Symbol(v), symbols.Symbol(T), a)
    speed = ca.Function("speed", [v, T], [found.expression])
    for ahead, thrust in ((10.0, 2.0), (-15.0, 1.0), (2.0, -3.0)):
        assert float(speed(ahead, thrust)) == pytest.approx(slipstream_speed(ahead, thrust, a), abs=1e-3)
    assert float(speed(-15.0, 1.0)) < 0.0 < float(speed(10.0, 2.0))


def test_the_larger_and_the_smaller_are_rounded_off_only_where_they_meet():
    x = ca.SX.sym("x")
    larger, smaller = (symbols._REPLACED[name](symbols.Symbol(x), 1.0).expression for name in ("max", "min"))
    f = ca.Function("f", [x], [larger, smaller])
    for value in (-3.0, 0.5, 2.0):
        assert [float(y) for y in f(value)] == pytest.approx([max(value, 1.0), min(value, 1.0)], abs=1e-4)
    assert float(f(1.0)[0]) == pytest.approx(1.0 + 0.5 * symbols.ROUNDED_WITHIN)
    assert symbols._REPLACED["max"](1.0, 2.0, 1.5) == 2.0
