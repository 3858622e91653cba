"""The instruments that read now and then: when, how late, how wrongly, and what each failure does to them."""

import math

import numpy as np
import pytest

from sitl.model.aerodynamics import thrusts
from sitl.model.quaternions import conjugate, from_euler, multiply, rotate, rotate_inverse
from sitl.model.vectors import Vector
from sitl.sensors.aiding import (
    EXTRA_DELAY,
    GARBAGE_HEIGHT,
    GARBAGE_PLACE,
    GARBAGE_SPEED,
    WRONG_AIRSPEED,
    WRONG_FIELD,
    WRONG_HEIGHT,
    WRONG_PLACE,
    WRONG_TURN,
    arrival,
    is_lost,
    read_outdoors,
    read_pose,
    read_tube,
    reads,
    tube_speed_after,
)
from sitl.sensors.draws import PERIOD, SLOW_PERIODS, Timing
from sitl.sensors.instruments import (
    ATTITUDE_VARIANCE,
    BAROMETER,
    DELAYED,
    DROPOUT,
    FAST_COLUMNS,
    FIRST_DELAYED,
    GARBAGE,
    GNSS,
    HAS_ATTITUDE,
    HEALTHY,
    INTERMITTENT,
    MAGNETOMETER,
    MOTION_CAPTURE,
    OFF,
    PITOT,
    POSE_DROPOUT,
    POSITION_VARIANCE,
    QUEUE_LENGTH,
    SLOW_COLUMNS,
    STANDARD_GRAVITY,
    STUCK,
    TOO_SLOW,
    WRONG,
    drop,
    send,
)
from tests.support.flights.ideal_sensors import NO_ERRORS, NOMINAL, SHIPPED, aboard, ideal
from tests.support.flights.plant_flight import plant

TILTED = from_euler(0.4, -1.1, 2.0)
FLYING = plant(p=(10.0, -20.0, 30.0), v=(4.0, 3.0, -1.0), q=TILTED, w=(0.1, 0.2, 0.3), u=(600.0, 650.0, 0.1, -0.1))
CALM, WINDY = Vector(0.0, 0.0, 0.0), Vector(2.0, -1.0, 0.5)
LINES_READ = (MAGNETOMETER, BAROMETER, GNSS, PITOT)


def flown(periods, specification=None, errors=NO_ERRORS, *, plant=FLYING, seed=None, failed=None, wind=WINDY):
    """Instruments that have read outdoors for some periods, nobody taking the readings out of their lines."""
    i, _, _ = aboard(specification, errors)
    for instrument, failure in (failed or {}).items():
        i["failures"][instrument] = failure
    random = None if seed is None else np.random.default_rng(seed)
    draws = np.zeros(SLOW_COLUMNS)
    for period in range(1, periods + 1):
        if random is not None and (period - 1) % SLOW_PERIODS == 0:
            draws = random.standard_normal(SLOW_COLUMNS)
            draws[DROPOUT : DROPOUT + 4] = random.random(4)
        if period % SLOW_PERIODS == 0:  # between these nothing reads whose rate divides 100 Hz
            read_tube(i, period, draws, PERIOD)
            read_outdoors(i, period, plant, wind, draws, PERIOD)
    return i


def readings(i, instrument):
    """All readings in the line of an instrument, oldest first: periods of reading and arrival, and numbers."""
    line = instrument - FIRST_DELAYED
    at = (int(i["first"][line]) + np.arange(int(i["waiting"][line]))) % QUEUE_LENGTH
    return i["sampled"][line, at], i["arrives"][line, at], i["readings"][line, at]


def last(i, instrument):
    return i["last"][instrument - FIRST_DELAYED]


# When


@pytest.mark.parametrize("rate", [1.0, 7.0, 10.0, 50.0, 100.0, 250.0])
def test_it_reads_as_often_as_its_rate_says(rate):
    timing = Timing(rate, 0.0, 0.0, 0.0)
    taken = [period for period in range(1, 5001) if reads(period, timing, HEALTHY, 0.5, PERIOD)]
    assert len(taken) == 10 * rate
    gaps = np.diff(taken) * PERIOD
    assert np.abs(gaps - 1.0 / rate).max() < PERIOD


def test_it_arrives_late_by_delay_and_jitter_and_never_early():
    timing = Timing(10.0, 0.1, 0.01, 0.0)
    assert arrival(1000, timing, HEALTHY, 0.0, PERIOD) == 1050
    assert arrival(1000, timing, HEALTHY, 2.0, PERIOD) == arrival(1000, timing, HEALTHY, -2.0, PERIOD) == 1060
    assert arrival(1000, timing, DELAYED, 0.0, PERIOD) == 1050 + round(EXTRA_DELAY / PERIOD)
    assert arrival(1000, Timing(10.0, 0.0, 0.0, 0.0), HEALTHY, 3.0, PERIOD) == 1000


def test_readings_stand_in_their_line_in_the_order_they_were_taken_whenever_they_arrive():
    timing = Timing(100.0, 0.05, 0.02, 0.0)
    i = flown(500, ideal(timing), seed=1)
    sampled, arrives, _ = readings(i, PITOT)
    assert len(sampled) == 100
    assert (np.diff(sampled) == SLOW_PERIODS).all()
    late = (arrives - sampled) * PERIOD
    assert late.min() >= 0.05
    # Half a normal distribution: its mean is 0.8 of the deviation, within a tenth of it for 100 draws.
    assert late.mean() - 0.05 == pytest.approx(0.02 * math.sqrt(2.0 / math.pi), abs=0.005)
    assert (np.diff(arrives) < 0.0).any()  # some overtake another


def test_so_many_readings_are_lost():
    i = flown(1000, ideal(Timing(50.0, 0.0, 0.0, 0.3)), seed=2)
    kept = [len(readings(i, instrument)[0]) for instrument in LINES_READ]
    assert kept == pytest.approx([70.0] * 4, abs=14.0)  # of 100; three deviations
    assert len({tuple(readings(i, instrument)[0]) for instrument in LINES_READ}) == 4  # each by itself


@pytest.mark.parametrize(("share", "burst"), [(0.01, 0.1), (0.2, 0.05), (0.3, 0.005)])
def test_poses_are_lost_in_bursts_of_geometric_length(share, burst):
    """Gilbert's model: the share that is lost, the mean length, and as many of each length as have a constant risk."""
    spec = SHIPPED.motion_capture._replace(timing=Timing(200.0, 0.0, 0.0, share), burst=burst)
    lost, now = [], False
    for drawn in np.random.default_rng(1).random(200_000):
        now = is_lost(now, spec, drawn)
        lost.append(now)
    ends = np.flatnonzero(np.diff(np.array([False, *lost, False], dtype=int)))
    lengths = ends[1::2] - ends[::2]
    mean = max(200.0 * burst, 1.0)
    known = 4.0 * math.sqrt(2.0 / len(lengths))  # four deviations of the mean of so many
    assert np.mean(lost) == pytest.approx(share, rel=known)
    assert lengths.mean() == pytest.approx(mean, rel=known)
    for longer in (0.5 * mean, mean, 2.0 * mean):
        assert np.mean(lengths > int(longer)) == pytest.approx((1.0 - 1.0 / mean) ** int(longer), abs=known)


def test_without_bursts_each_pose_is_lost_by_itself():
    spec = SHIPPED.motion_capture._replace(timing=Timing(200.0, 0.0, 0.0, 0.3), burst=0.0)
    for was in (False, True):
        assert [is_lost(was, spec, drawn) for drawn in (0.0, 0.29, 0.31)] == [True, True, False]


def test_of_cameras_that_lose_all_or_nothing_no_chance_decides():
    spec = SHIPPED.motion_capture
    all_lost = spec._replace(timing=spec.timing._replace(dropout=1.0))
    assert is_lost(False, all_lost, 0.999)
    assert not is_lost(False, spec._replace(timing=spec.timing._replace(dropout=0.0)), 0.0)


def test_what_is_lost_is_not_sent_and_what_is_sent_was_seen():
    timing = Timing(200.0, 0.0, 0.0, 0.2)
    parts = ideal(timing)
    spec = parts._replace(motion_capture=parts.motion_capture._replace(burst=0.05))
    sampled, _, _ = readings(captured(800, spec, seed=3), MOTION_CAPTURE)
    gaps = np.diff(sampled) * PERIOD
    assert gaps.max() > 0.02
    assert np.mean(gaps > 0.0061) < 0.1


def test_a_full_line_forgets_its_oldest():
    i, _, _ = aboard()
    line = GNSS - FIRST_DELAYED
    for period in range(QUEUE_LENGTH + 3):
        i["last"][line, 0] = float(period)
        send(line, i, period, period + 60)
    sampled, arrives, numbers = readings(i, GNSS)
    assert sampled.tolist() == numbers[:, 0].tolist() == list(range(3, QUEUE_LENGTH + 3))
    assert (arrives - sampled == 60.0).all()
    drop(line, i)
    assert readings(i, GNSS)[0][0] == 4.0
    assert i["waiting"][line] == QUEUE_LENGTH - 1.0


# How wrongly


def test_without_errors_they_read_the_truth():
    i = flown(100)
    field = SHIPPED.magnetometer
    earth = Vector(field.field_north, field.field_west, field.field_up)
    assert last(i, MAGNETOMETER)[:3] == pytest.approx(np.array(rotate_inverse(TILTED, earth)), abs=1e-9)
    assert last(i, BAROMETER)[0] == pytest.approx(30.0)
    assert last(i, GNSS)[:6] == pytest.approx((10.0, -20.0, 30.0, 4.0, 3.0, -1.0))


HIDDEN = NO_ERRORS._replace(
    magnetic_bias=Vector(1e-6, 2e-6, -3e-6),
    gnss_drift=Vector(0.5, -0.4, 0.8),
    gnss_noise=Vector(0.1, 0.2, -0.3),
    gnss_velocity_noise=Vector(0.01, 0.02, 0.03),
    barometer_drift=0.7,
)


def test_hidden_errors_add_to_what_is_read():
    parts = ideal()
    lasting = parts._replace(gnss=parts.gnss._replace(noise_time=1.0))
    wrong, right = flown(50, lasting, HIDDEN), flown(50)
    assert (last(wrong, MAGNETOMETER) - last(right, MAGNETOMETER))[:3] == pytest.approx([1e-6, 2e-6, -3e-6], abs=3e-9)
    assert (last(wrong, BAROMETER) - last(right, BAROMETER))[0] == pytest.approx(0.7)
    assert (last(wrong, GNSS) - last(right, GNSS))[:6] == pytest.approx([0.6, -0.2, 0.5, 0.01, 0.02, 0.03])


def test_the_antenna_stands_aside_and_swings_with_the_body():
    parts, known, error = ideal(), Vector(0.08, 0.01, -0.02), Vector(0.01, -0.02, 0.005)
    spec = parts._replace(mounting=parts.mounting._replace(antenna=known))
    fix = last(flown(50, spec, NO_ERRORS._replace(antenna_arm=error)), GNSS)
    arm = rotate(TILTED, Vector(0.09, -0.01, -0.015))
    assert fix[:3] == pytest.approx(np.add((10.0, -20.0, 30.0), arm))
    swing = np.cross(rotate(TILTED, Vector(0.1, 0.2, 0.3)), arm)
    assert fix[3:6] == pytest.approx(np.add((4.0, 3.0, -1.0), swing))


def test_their_noise_is_as_specified():
    every = Timing(100.0, 0.0, 0.0, 0.0)
    parts = ideal(every)
    parts = parts._replace(
        magnetometer=parts.magnetometer._replace(noise=2e-7),
        barometer=parts.barometer._replace(noise=0.1),
        gnss=parts.gnss._replace(noise_level=0.2, noise_up=0.4, velocity_noise_level=0.05, velocity_noise_up=0.1),
    )
    taken = [flown(QUEUE_LENGTH * SLOW_PERIODS, parts, seed=seed) for seed in (1, 2, 3)]

    def deviation(instrument, columns):
        return np.std(np.vstack([readings(i, instrument)[2][:, columns] for i in taken]), axis=0)

    # The deviation of 480 draws is known to 3 %.
    assert deviation(MAGNETOMETER, slice(0, 3)) == pytest.approx(3 * [2e-7], rel=0.12)
    assert deviation(BAROMETER, slice(0, 1)) == pytest.approx([0.1], rel=0.12)
    assert deviation(GNSS, slice(0, 6)) == pytest.approx([0.2, 0.2, 0.4, 0.05, 0.05, 0.1], rel=0.12)


def test_the_barometer_takes_a_share_of_the_dynamic_pressure_for_static():
    parts = ideal()
    spec = parts._replace(barometer=parts.barometer._replace(position_error=0.1))
    square = (4.0 - 2.0) ** 2 + (3.0 + 1.0) ** 2 + (-1.0 - 0.5) ** 2
    assert last(flown(50, spec), BAROMETER)[0] == pytest.approx(30.0 - 0.1 * square / (2.0 * STANDARD_GRAVITY))


def test_they_read_whole_steps_within_their_range():
    parts = ideal()
    spec = parts._replace(
        magnetometer=parts.magnetometer._replace(step=1e-6, range=2e-5), barometer=parts.barometer._replace(step=0.4)
    )
    i = flown(50, spec)
    exact = last(flown(50), MAGNETOMETER)[:3]
    assert last(i, MAGNETOMETER)[:3] == pytest.approx(np.clip(np.rint(exact / 1e-6) * 1e-6, -2e-5, 2e-5))
    assert last(i, BAROMETER)[0] == pytest.approx(30.0)
    assert np.abs(exact).max() > 2e-5


def tube_reading(felt, *, bias=0.0, **changed):
    """Reading of a tube whose diaphragm feels a speed."""
    parts = ideal()
    spec = parts._replace(pitot=parts.pitot._replace(min_speed=3.0, **changed))
    i = flown(10, spec, NO_ERRORS._replace(tube_speed=felt, pitot_bias=bias))
    return last(i, PITOT)[0]


def test_the_tube_reads_what_its_diaphragm_feels_from_some_speed_on():
    assert tube_reading(12.0) == pytest.approx(12.0)
    assert tube_reading(12.0, bias=0.3) == pytest.approx(12.3)
    assert tube_reading(2.9) == 0.0
    assert tube_reading(-8.0) == 0.0
    assert tube_reading(60.0, range=50.0) == pytest.approx(50.0)
    assert tube_reading(12.3, step=0.5) == pytest.approx(12.5)


def test_the_diaphragm_follows_the_air_ahead_and_a_share_of_the_slipstream():
    spec = SHIPPED.pitot._replace(lag=0.1, slipstream=0.0)
    along = rotate_inverse(TILTED, Vector(2.0, 4.0, -1.5)).x
    errors = NO_ERRORS
    for _ in range(50):  # one time constant
        errors = errors._replace(tube_speed=tube_speed_after(errors, FLYING, WINDY, NOMINAL, spec, PERIOD))
    assert errors.tube_speed == pytest.approx(along * (1.0 - math.exp(-1.0)), rel=1e-3)
    swift, errors = spec._replace(lag=0.01, slipstream=0.2), NO_ERRORS
    for _ in range(100):
        errors = errors._replace(tube_speed=tube_speed_after(errors, FLYING, WINDY, NOMINAL, swift, PERIOD))
    both = sum(thrusts(FLYING.actuators, along, NOMINAL))
    # Momentum theory: the discs' thrust is 2 rho A w (v + w) with w the inflow, the slipstream v + 2 w.
    ahead, discs = max(along, 0.0), NOMINAL.S / (2.0 * NOMINAL.S_ratio)
    inflow = -0.5 * ahead + math.sqrt(0.25 * ahead**2 + both / (2.0 * NOMINAL.rho * discs))
    assert errors.tube_speed == pytest.approx(along + 0.2 * 2.0 * inflow, rel=1e-6)


def captured(periods=10, specification=None, errors=NO_ERRORS, *, seed=None, failure=HEALTHY, plant=FLYING):
    i, _, _ = aboard(specification, errors, arena=True)
    i["failures"][MOTION_CAPTURE] = failure
    random = np.random.default_rng(0 if seed is None else seed)
    for period in range(1, periods + 1):
        draws = np.zeros(FAST_COLUMNS) if seed is None else random.standard_normal(FAST_COLUMNS)
        draws[POSE_DROPOUT] = random.random()
        read_pose(i, period, plant, draws, PERIOD)
    return i


def turn_between(q, reading):
    """The small rotation from an attitude to the one that was read."""
    off = multiply(conjugate(q), type(q)(*reading[3:7]))
    return 2.0 * math.copysign(1.0, off.w) * np.array(off[1:])


def test_motion_capture_reads_place_and_attitude_and_says_how_well():
    pose = last(captured(), MOTION_CAPTURE)
    assert pose[:3] == pytest.approx((10.0, -20.0, 30.0))
    assert turn_between(TILTED, pose) == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    assert pose[HAS_ATTITUDE] == 1.0
    pose = last(captured(specification=SHIPPED), MOTION_CAPTURE)
    assert pose[POSITION_VARIANCE] == pytest.approx((0.5e-3) ** 2)
    assert pose[ATTITUDE_VARIANCE] == pytest.approx(math.radians(0.2) ** 2)


def test_motion_capture_s_errors_are_as_specified():
    turned = Vector(0.01, -0.02, 0.005)
    pose = last(captured(errors=NO_ERRORS._replace(misalignment=turned)), MOTION_CAPTURE)
    assert turn_between(TILTED, pose) == pytest.approx(np.array(turned), abs=1e-5)
    parts = ideal(Timing(200.0, 0.0, 0.0, 0.0))
    spec = parts._replace(motion_capture=parts.motion_capture._replace(noise=1e-3, attitude_noise=5e-3))
    _, _, poses = readings(captured(400, spec, seed=3), MOTION_CAPTURE)
    assert len(poses) == QUEUE_LENGTH
    assert np.std(poses[:, :3], axis=0) == pytest.approx(3 * [1e-3], rel=0.2)  # of 160 draws: 6 %
    assert np.std([turn_between(TILTED, pose) for pose in poses], axis=0) == pytest.approx(3 * [5e-3], rel=0.2)


def test_the_tube_is_read_by_itself():
    i, _, _ = aboard(arena=True)
    for period in range(1, 101):
        read_tube(i, period, np.zeros(SLOW_COLUMNS), PERIOD)
    assert [bool(len(readings(i, instrument)[0])) for instrument in LINES_READ] == [False, False, False, True]


# Failures

ALL = dict.fromkeys(LINES_READ)


@pytest.mark.parametrize("instrument", LINES_READ)
def test_an_instrument_that_is_off_reads_nothing_and_leaves_the_others_alone(instrument):
    i = flown(500, failed={instrument: OFF})
    assert [bool(len(readings(i, other)[0])) for other in LINES_READ] == [other != instrument for other in LINES_READ]


def test_stuck_ones_repeat_their_last_reading():
    i = flown(100, failed=dict.fromkeys(LINES_READ, STUCK))
    for instrument in LINES_READ:
        sampled, _, numbers = readings(i, instrument)
        assert len(sampled) > 0
        assert (numbers == 0.0).all()
    assert (last(captured(failure=STUCK), MOTION_CAPTURE) == 0.0).all()


def test_wrong_ones_are_off_by_so_much():
    errors = NO_ERRORS._replace(tube_speed=12.0)
    wrong, right = flown(50, errors=errors, failed=dict.fromkeys(LINES_READ, WRONG)), flown(50, errors=errors)
    off = {instrument: last(wrong, instrument) - last(right, instrument) for instrument in LINES_READ}
    assert off[MAGNETOMETER][:3] == pytest.approx([0.0, WRONG_FIELD, WRONG_FIELD], abs=3e-9)
    assert off[BAROMETER][0] == pytest.approx(WRONG_HEIGHT)
    assert off[GNSS][:6] == pytest.approx([WRONG_PLACE] * 3 + [0.0] * 3)
    assert off[PITOT][0] == pytest.approx(WRONG_AIRSPEED)
    pose = last(captured(failure=WRONG), MOTION_CAPTURE)
    assert pose[:3] == pytest.approx((10.5, -19.5, 30.0))
    assert turn_between(TILTED, pose)[0] == pytest.approx(2.0 * math.sin(0.5 * WRONG_TURN), rel=1e-6)


def test_garbage_has_nothing_to_do_with_the_vehicle():
    broken = dict.fromkeys(LINES_READ, GARBAGE)
    one, other = flown(500, seed=4, failed=broken), flown(500, seed=4, failed=broken, plant=plant(), wind=CALM)
    for instrument in LINES_READ:
        assert readings(one, instrument)[2].tolist() == readings(other, instrument)[2].tolist()
    assert np.std(readings(one, BAROMETER)[2][:, 0]) == pytest.approx(GARBAGE_HEIGHT, rel=0.5)
    assert np.std(readings(one, GNSS)[2][:, :3]) == pytest.approx(GARBAGE_PLACE, rel=0.6)
    assert np.std(readings(one, GNSS)[2][:, 3:6]) == pytest.approx(GARBAGE_SPEED, rel=0.6)
    poses = [captured(50, seed=5, failure=GARBAGE, plant=at) for at in (FLYING, plant(q=TILTED))]
    assert readings(poses[0], MOTION_CAPTURE)[2].tolist() == readings(poses[1], MOTION_CAPTURE)[2].tolist()


def test_too_slow_delayed_and_intermittent_ones_still_tell_the_truth():
    timing = Timing(50.0, 0.0, 0.0, 0.0)
    slow = readings(flown(1000, ideal(timing), failed={BAROMETER: TOO_SLOW}), BAROMETER)
    assert len(slow[0]) == 10
    late = readings(flown(1000, ideal(timing), failed={BAROMETER: DELAYED}), BAROMETER)
    assert (late[1] - late[0] == round(EXTRA_DELAY / PERIOD)).all()
    flickering = readings(flown(1500, ideal(timing), failed={BAROMETER: INTERMITTENT}), BAROMETER)
    assert len(flickering[0]) == pytest.approx(100, abs=1)
    assert not ((flickering[0] > 500) & (flickering[0] < 1000)).any()
    for taken in (slow, late, flickering):
        assert taken[2][:, 0] == pytest.approx(30.0)
