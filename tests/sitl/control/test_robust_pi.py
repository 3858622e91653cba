"""The robust PI law: its biquads are those of the library, it begins without a step, and its set-point walks."""

import math

import numpy as np
import pytest

from sitl.control import robust_pi
from sitl.control.allocation import PITCH, ROLL, THRUST, YAW
from sitl.control.reference import hover_at
from sitl.design.robust_pi_gains import CALM_TUNING, WINDY_TUNING, robust_pi_gains
from sitl.model.airframe_files import load
from sitl.model.quaternions import from_euler, hover, multiply
from sitl.sensors.draws import PERIOD
from tests.support.flights.estimates import estimate, rotation, vector

DARKO = load("darko").parameters
GAINS = robust_pi_gains()
TICKS = 200


def begun(seen, **changes):
    return robust_pi.start(seen, GAINS)._replace(**changes)


def flown(seen, reference, state, ticks):
    """Commands of an estimate that does not change."""
    commands = []
    for _ in range(ticks):
        command, flags, state = robust_pi.step(seen, reference, GAINS, DARKO, state, PERIOD)
        commands.append(command)
    return np.array(commands), flags, state


def test_at_the_set_point_nothing_is_added_to_the_hover():
    seen = estimate()
    commands, flags, _ = flown(seen, hover_at((0, 0, 0), 0.0), begun(seen, thrust=0.0, elevon=0.0), TICKS)
    assert commands[:, :2] == pytest.approx(math.sqrt(GAINS.thrust / GAINS.k_f))
    assert commands[:, 2:] == pytest.approx(0.0, abs=1e-12)
    assert flags == 0


@pytest.mark.parametrize(
    ("seen", "x"),
    [
        (estimate(p=(0.1, 0.0, 0.0)), {0: 0.1}),
        (estimate(v=(0.0, 0.2, -0.3)), {4: 0.2, 5: -0.3}),
        (estimate(w=(0.1, -0.2, 0.3)), {8: 0.1, 9: -0.2, 10: 0.3}),
        (estimate(q=multiply(rotation((0.0, 0.0, 0.02)), estimate().attitude)), {6: math.sin(0.01) * math.sqrt(0.5)}),
    ],
    ids=["offset", "velocity", "rates", "heading"],
)
def test_integrals_and_biquads_are_those_of_the_equations(seen, x):
    full = np.zeros(11)
    full[list(x)] = list(x.values())
    if 6 in x:  # turned about the vertical, the vector part turns along x_b and z_b alike
        full[7] = math.sin(0.01) * math.sqrt(0.5)
    start = begun(seen, set_point=vector((0, 0, 0)), heading=0.0, thrust=0.0, elevon=0.0)
    commands, _, _ = flown(seen, hover_at((0, 0, 0), 0.0), start, TICKS)
    driven = np.outer(GAINS.K @ full, np.ones(TICKS))
    from scipy.signal import lfilter  # it takes a second to load

    filtered = lfilter((0.0, *GAINS.ahead), (1.0, *GAINS.back), driven)
    integrals = np.outer(GAINS.H @ full, PERIOD * np.arange(1, TICKS + 1))
    outputs = filtered + np.repeat(integrals, 2, axis=0)
    expected = np.vstack((np.sqrt(np.maximum(GAINS.thrust + outputs[:2], 0.0) / GAINS.k_f), outputs[2:])).T
    assert np.ptp(outputs) > 1e-3
    np.testing.assert_allclose(commands, expected, rtol=1e-9, atol=1e-12)


def test_it_begins_with_the_thrust_and_the_elevons_there_are():
    seen = estimate(p=(3.0, 1.0, 9.0), q=from_euler(0.0, -1.2, 0.0), actuators=(1200.0, 1200.0, 0.1, 0.1))
    commands, _, state = flown(seen, hover_at((3.0, 1.0, 9.0), 0.0), begun(seen), 1)
    assert commands[0] == pytest.approx((1200.0, 1200.0, 0.1, 0.1))
    assert state.set_point == seen.position


def test_the_set_point_walks_to_the_reference_no_faster_than_it_may():
    seen = estimate()
    _, _, state = flown(seen, hover_at((3.0, 0.0, 4.0), 0.0), begun(seen), 100)
    walked = 100 * PERIOD * GAINS.set_point_speed / 5.0
    assert state.set_point == pytest.approx((3.0 * walked, 0.0, 4.0 * walked))
    _, _, state = flown(seen, hover_at((3.0, 0.0, 4.0), 0.0, 0.25), begun(seen), 100)
    assert state.set_point == pytest.approx((0.75 * walked, 0.0, walked))
    _, _, state = flown(seen, hover_at((0.01, 0.0, 0.0), 0.0), begun(seen), 100)
    assert state.set_point == pytest.approx((0.01, 0.0, 0.0))


def test_the_heading_turns_to_the_reference_the_short_way_no_faster_than_it_may():
    seen = estimate(q=hover(3.0))
    _, _, state = flown(seen, hover_at((0, 0, 0), -3.0), begun(seen), 20)
    assert state.heading == pytest.approx(3.0 + 20 * PERIOD * GAINS.turn_rate)
    _, _, state = flown(seen, hover_at((0, 0, 0), 2.999), begun(seen), 20)
    assert state.heading == pytest.approx(2.999)


def test_what_it_asks_for_beyond_the_limits_is_flagged():
    seen = estimate()
    for start, bits in ((begun(seen, thrust=20.0, elevon=0.0), THRUST | YAW), (begun(seen, elevon=0.6), PITCH | ROLL)):
        state = start if bits & THRUST else start._replace(thrust=0.0)
        assert flown(seen, hover_at((0, 0, 0), 0.0), state, 1)[1] == bits


def test_numbers_are_those_of_the_headers_in_our_frames():
    """Motors of the hover turn at 12,387 rpm."""
    assert math.sqrt(GAINS.thrust / GAINS.k_f) * 30.0 / math.pi == pytest.approx(12387.5, abs=0.1)
    assert GAINS.K[0, 0] == 0.232198556071961
    assert GAINS.K[2, 9] == -57.188522405898993
    assert GAINS.H[1, 3] == -4.800294095772698
    calm = robust_pi_gains(CALM_TUNING)
    assert calm.k_f / GAINS.k_f == pytest.approx(1.9412 / 1.8767)
    assert robust_pi_gains(WINDY_TUNING) is not calm
