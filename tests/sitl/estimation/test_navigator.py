"""The filter in flight: how far off, late and wild readings, jumps; and one seed is one flight, to the bit."""

import math

import numpy as np
import pytest

from sitl.estimation import navigator
from sitl.estimation.filter import ALIGNING, REALIGNING, RUNNING, SLOW_PERIODS, put_last, put_nominal
from sitl.estimation.nominal_state import ACCEL_BIAS_ERROR, ARENA_ERRORS, ERRORS, VELOCITY_ERROR, NominalState
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add, add_scaled
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import (
    ACCELEROMETER,
    BAROMETER,
    DELAYED,
    FIRST_DELAYED,
    GNSS,
    HEALTHY,
    INSTRUMENTS,
    MAGNETOMETER,
    MOTION_CAPTURE,
    OFF,
    PITOT,
    QUEUE_LENGTH,
    Inertial,
    put_inertial,
)
from sitl.storage import named_from
from tests.support.flights.ideal_sensors import SHIPPED, aboard
from tests.support.flights.sensed_flights import (
    MOCAP,
    SENSORS,
    changed,
    hovering,
    place_error,
    state_of_all,
    turn_error,
    watched,
)

SETTLING, SECONDS = 4.0, 12.0


def test_a_reading_beside_the_centre_of_mass_is_taken_to_it():
    """A spin that quickens by 50 rad/s2, read by a unit on an arm, whose gyroscope has a bias that is known."""
    _, f, _ = aboard()
    bias, rates, arm = Vector(0.02, -0.01, 0.03), Vector(3.0, -5.0, 2.0), Vector(0.03, 0.02, -0.04)
    turning, felt = Vector(50.0, -20.0, 10.0), Vector(9.0, 1.0, -2.0)
    put_nominal(f, named_from(NominalState, _plain(f["nominal"]))._replace(gyro_bias=bias))
    put_last(f, Inertial(add(add_scaled(rates, turning, -PERIOD), bias), felt))
    swing = np.cross(turning, arm) + np.cross(rates, np.cross(rates, arm))
    read = Inertial(add(rates, bias), Vector(*np.add(felt, swing)))
    assert navigator.at_centre(f, read, arm).force == pytest.approx(felt)
    assert navigator.at_centre(f, read, arm).rates == read.rates
    leapt = Inertial(add(read.rates, Vector(4.0, 0.0, 0.0)), read.force)
    assert navigator.at_centre(f, leapt, arm) == leapt  # nothing turns so fast: that tells of no force
    f["failed"][0] = 1.0
    assert navigator.at_centre(f, read, arm) == read


def _plain(folder):
    """Nested tuples of nested dictionaries."""
    return tuple(_plain(part) if isinstance(part, dict) else part for part in folder.values())


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def errors_in_hover(navigation, seed, **made):
    flown = hovering(navigation, seed, **made)
    flown.step(SETTLING)
    return flown, watched(flown, SECONDS, place_error)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_by_motion_capture_it_knows_its_place_to_three_centimetres(seed):
    flown, errors = errors_in_hover(MOCAP, seed)
    assert rms(errors) < 0.03
    assert np.linalg.norm(turn_error(flown)) < 0.03
    assert flown.avionics.filter["resets"] == 0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_by_satellites_it_knows_its_place_to_half_a_metre(seed):
    flown, errors = errors_in_hover(SENSORS, seed)
    assert rms(errors) < 0.5
    assert np.linalg.norm(turn_error(flown)) < 0.12
    assert flown.avionics.filter["resets"] == 0


def test_satellites_that_are_later_still_cost_accuracy_alone():
    flown, errors = errors_in_hover(SENSORS, 1, sensors=changed(gnss={"delay": 0.22}))
    assert rms(errors) < 0.8
    assert flown.avionics.filter["settings"]["horizon"] > hovering().avionics.filter["settings"]["horizon"]
    assert flown.avionics.filter["late"][GNSS - FIRST_DELAYED] == 0.0


@pytest.mark.parametrize("navigation", [SENSORS, MOCAP])
def test_a_pipeline_that_is_forty_milliseconds_late_is_survived(navigation):
    flown, _ = errors_in_hover(navigation, 1, sensors=changed(pipeline={"latency": 0.04}), gusts=0.0)
    assert flown.truth.body.position == pytest.approx((0.0, 0.0, 30.0), abs=1.5)


def test_a_late_pipeline_does_not_stop_the_motors_of_a_vehicle_that_begins_in_the_air():
    late = hovering(sensors=changed(pipeline={"latency": 0.1}), gusts=0.0, wind=(0.0, 0.0, 0.0))
    late.step(0.05)
    begun = hovering(gusts=0.0, wind=(0.0, 0.0, 0.0)).truth.actuators.left_motor
    assert late.truth.actuators.left_motor == pytest.approx(begun, rel=1e-6)


def newest(flown, instrument):
    """The reading that was put into a line last."""
    i, line = flown.avionics.instruments, instrument - FIRST_DELAYED
    at = (int(i["first"][line]) + int(i["waiting"][line]) - 1) % QUEUE_LENGTH
    return i["readings"][line, at]


@pytest.mark.parametrize(("navigation", "instrument"), [(SENSORS, GNSS), (MOCAP, MOTION_CAPTURE), (SENSORS, BAROMETER)])
def test_one_wild_reading_does_not_move_it(navigation, instrument):
    wild, tame = hovering(navigation), hovering(navigation)
    for flown in (wild, tame):
        flown.step(SETTLING)
    newest(wild, instrument)[:3] += 50.0
    for _ in range(40):
        wild.advance(5)
        tame.advance(5)
        assert np.abs(np.subtract(wild.estimate.position, tame.estimate.position)).max() < 0.3
    squares = [flown.avionics.filter["squares"][instrument - FIRST_DELAYED] for flown in (wild, tame)]
    assert squares[0] - squares[1] > 25.0  # it came, and far beyond the gate
    assert wild.avionics.filter["resets"] == 0
    assert wild.avionics.filter["refused_since"][instrument - FIRST_DELAYED] == -1.0


def test_satellites_that_leap_and_stay_somewhere_else_are_not_believed():
    flown = hovering()
    flown.step(SETTLING)
    flown.avionics.instruments["errors"]["gnss_drift"]["x"] += 20.0
    flown.step(0.8)
    assert flown.avionics.filter["resets"] == 0
    assert flown.estimate.position.x - flown.truth.body.position.x < 2.0
    assert flown.avionics.filter["refused_since"][GNSS - FIRST_DELAYED] > 0.0  # though the velocities fit
    flown.step(10.0)
    assert flown.avionics.filter["resets"] == 0
    assert math.dist(flown.estimate.position, flown.truth.body.position) < 2.0  # by the velocities


def test_satellites_that_were_away_while_the_belief_went_astray_are_believed_again_and_that_is_counted():
    flown = hovering()
    flown.step(SETTLING)
    flown.avionics.instruments["failures"][GNSS] = OFF
    flown.step(1.0)
    flown.avionics.filter["nominal"]["position"]["x"] += 20.0
    flown.avionics.instruments["failures"][GNSS] = HEALTHY
    flown.step(4.0)
    assert flown.avionics.filter["resets"] == 1
    assert math.dist(flown.estimate.position, flown.truth.body.position) < 2.0


def test_readings_that_come_after_their_time_are_counted_and_not_used():
    flown = hovering()
    flown.step(SETTLING)
    line, before = MAGNETOMETER - FIRST_DELAYED, float(flown.avionics.filter["scalars"][MAGNETOMETER - FIRST_DELAYED])
    assert not flown.avionics.filter["late"].any()
    flown.avionics.instruments["failures"][MAGNETOMETER] = DELAYED
    flown.step(2.0)
    f = flown.avionics.filter
    assert f["late"][line] == pytest.approx(100 - 8, abs=12)  # 50 Hz, from when the first of them is due
    assert f["scalars"][line] - before < 3 * 15
    assert not np.delete(f["late"], line).any()


def test_how_old_its_news_is_stands_in_the_estimate():
    flown = hovering()
    assert flown.estimate.age.position == 0.0
    ages = watched(flown, 3.0, lambda s: s.estimate.age.position)
    assert ages.max() < 0.4  # delay, horizon and the time between two fixes
    assert ages.min() > 0.1
    flown.avionics.instruments["failures"][GNSS] = 1.0
    flown.step(2.0)
    assert flown.estimate.age.position == pytest.approx(2.0, abs=0.4)
    assert flown.estimate.age.rates < 0.01


@pytest.mark.parametrize("navigation", [SENSORS, MOCAP])
def test_how_many_periods_are_flown_per_call_changes_no_bit(navigation):
    whole, pieces = hovering(navigation), hovering(navigation)
    whole.advance(6000)
    for length in (1, 2, 3, 5, 89, 400, 1, 4499, 7, 993):
        pieces.advance(length)
        pieces.sample()
    assert pieces.periods == whole.periods
    assert state_of_all(pieces) == state_of_all(whole)


def test_a_seed_is_a_flight_and_another_seed_another():
    flown = [hovering(seed=seed) for seed in (1, 1, 2)]
    for one in flown:
        one.step(1.0)
    assert state_of_all(flown[0]) == state_of_all(flown[1])
    assert flown[0].truth != flown[2].truth


def test_the_laws_fly_by_the_estimate_and_not_by_the_truth():
    """With the same plant, another seed of the instruments alone makes another command."""
    flown = [hovering(seed=seed, gusts=0.0, wind=(0.0, 0.0, 0.0)) for seed in (1, 2)]
    assert flown[0].truth == flown[1].truth
    for one in flown:
        one.advance(50)
    assert flown[0].command != flown[1].command


@pytest.mark.parametrize(("age", "tells"), [(0.5, False), (3.0, False), (3.002, True), (100.0, True)])
def test_the_wing_is_checked_by_a_tube_that_was_not_refused_for_three_seconds(monkeypatch, age, tells):
    i, f, steps = aboard(SHIPPED)
    f["settings"]["horizon"], now, seen = 0, 100_000, []
    f["refused_at"][PITOT - FIRST_DELAYED] = now - round(age / 0.002)
    monkeypatch.setattr(navigator, "observe_wing", lambda _f, _step, has_tube, _vibration: seen.append(has_tube))
    navigator._slow_step(f, i, steps, now, True)
    navigator._slow_step(f, i, steps, now, False)
    assert seen == [tells, False]


@pytest.mark.parametrize("failing", [(True, False), (False, True), (True, True), (False, False)])
def test_gyroscope_and_accelerometer_fail_each_for_itself(failing):
    i, f, _ = aboard(SHIPPED)
    for k in range(2000):
        rates, force = (Vector(1e-3 * (k % 3 + 1), 0.0, (k % 2) * 100.0 * wild) for wild in failing)
        put_inertial(i, Inertial(rates, force))
        navigator._detect_faults(f, i, k)
    assert f["failed"].tolist() == [*(float(wild) for wild in failing), *(INSTRUMENTS - 2) * [0.0]]


def test_the_bias_of_an_accelerometer_is_forgotten_once_where_it_fails():
    i, f, _ = aboard(SHIPPED)
    P = f["covariance"]
    P[ACCEL_BIAS_ERROR, ACCEL_BIAS_ERROR] = 7.0
    for k in range(2000):
        if f["failed"][1] > 0.0:
            break
        assert P[ACCEL_BIAS_ERROR, ACCEL_BIAS_ERROR] == 7.0
        put_inertial(i, Inertial(Vector(1e-3 * (k % 3), 0.0, 0.0), Vector(0.0, 0.0, 100.0 * (k % 2))))
        navigator._detect_faults(f, i, k)
    assert P[ACCEL_BIAS_ERROR, ACCEL_BIAS_ERROR] == navigator.MODEL_LACKS**2
    P[ACCEL_BIAS_ERROR, ACCEL_BIAS_ERROR] = 0.5
    navigator._detect_faults(f, i, 2000)
    assert P[ACCEL_BIAS_ERROR, ACCEL_BIAS_ERROR] == 0.5


def test_while_an_accelerometer_is_doubted_the_model_s_force_stands_in_for_it():
    i, f, _ = aboard(SHIPPED)
    f["doubted_until"][ACCELEROMETER] = 100.0
    read = Inertial(Vector(0.0, 0.0, 0.0), Vector(50.0, 0.0, 0.0))
    off = Actuators(0.0, 0.0, 0.0, 0.0)
    for period, doubted in [(99, True), (100, False)]:
        navigator._detect_faults(f, i, period)
        assert bool(f["numb"]) == doubted
        assert (navigator._believed(f, read, off) != read) == doubted
    assert not f["failed"].any()


@pytest.mark.parametrize(
    ("phase", "period", "done"),
    [
        (ALIGNING, 0, ["align"]),
        (REALIGNING, 0, ["_accumulate", "align"]),
        (RUNNING, 1, ["_accumulate"]),
        (RUNNING, SLOW_PERIODS, ["_accumulate", "_slow_step"]),
    ],
)
def test_what_a_period_does_is_told_by_the_phase(phase, period, done, monkeypatch):
    i, f, steps = aboard(SHIPPED)
    f["phase"], seen = phase, []
    for name in ("_accumulate", "align", "_slow_step"):
        monkeypatch.setattr(navigator, name, lambda *_, name=name: seen.append(name))
    navigator.navigate(f, i, steps, period, Actuators(500.0, 500.0, 0.0, 0.0), True)
    assert seen == done


def test_faster_propellers_leave_the_velocity_less_sure():
    _, f, _ = aboard(SHIPPED)
    gained = []
    reference = float(f["model"]["vibration_speed"])
    for speed in (0.0, reference, 1.5 * reference):
        navigator._shake(f, Actuators(speed, speed, 0.0, 0.0))
        gained.append(
            f["process_noise"][VELOCITY_ERROR : VELOCITY_ERROR + 3] - f["settings"]["process_noise"][VELOCITY_ERROR]
        )
    shaken = float(f["settings"]["shaken"]) * navigator.SHAKEN_AT / max(reference, navigator.SHAKEN_AT)
    assert np.allclose(gained, np.outer([0.0, shaken, 1.5**4 * shaken], np.ones(3)), rtol=1e-12, atol=0.0)


@pytest.mark.parametrize(("states", "left"), [(ERRORS, 0.5), (ARENA_ERRORS, 1.0)])
def test_what_shakes_as_hard_but_twice_as_fast_moves_the_vehicle_less_outdoors(states, left):
    _, f, _ = aboard(SHIPPED)
    f["settings"]["states"], f["model"]["vibration_speed"] = states, 2.0 * navigator.SHAKEN_AT
    navigator._shake(f, Actuators(2.0 * navigator.SHAKEN_AT, 2.0 * navigator.SHAKEN_AT, 0.0, 0.0))
    gained = f["process_noise"][VELOCITY_ERROR] - f["settings"]["process_noise"][VELOCITY_ERROR]
    assert gained == pytest.approx(left * float(f["settings"]["shaken"]))
