"""The navigation filter of one vehicle: what it is set to, and everything it keeps between two periods."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl.compiled import kernel
from sitl.control.wind_estimator import WindGains
from sitl.estimation.gust_meter import (
    FIRST_LEVEL,
    FIRST_SHARE,
    FIRST_SHARE_DOUBT,
    FIXED_LEVEL,
    GustMeter,
    LackingModel,
    unknown_gusts,
)
from sitl.estimation.nominal_state import (
    ACCEL_BIAS_ERROR,
    ARENA_ERRORS,
    ATTITUDE_ERROR,
    BAROMETER_DRIFT_ERROR,
    ERRORS,
    GNSS_DRIFT_ERROR,
    GYRO_BIAS_ERROR,
    MAGNETIC_BIAS_ERROR,
    MISALIGNMENT_ERROR,
    POSITION_ERROR,
    STATIC_PORT_ERROR,
    STEADY_WIND_ERROR,
    TUBE_BIAS_ERROR,
    TUBE_SPEED_ERROR,
    VELOCITY_ERROR,
    WIND_ERROR,
    WING_ERROR,
    NominalState,
    at_origin,
)
from sitl.estimation.notch import Notch, quiet
from sitl.estimation.strapdown import Increment, no_increment
from sitl.model.airframe import Airframe, Array
from sitl.model.arithmetic import exponential
from sitl.model.state import Actuators
from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD, SLOW_PERIODS
from sitl.sensors.instruments import INSTRUMENTS, N_DELAYED, READING_SIZE, Inertial, SensorSet
from sitl.storage import writer

SLOW_STEP = SLOW_PERIODS * PERIOD  # of the filter [s]
MAX_HORIZON = 64  # slow steps that the filter may stand in the past
ALIGNING, RUNNING, REALIGNING = range(3)  # the last carries an estimate of before on meanwhile
GATE = 5.0  # innovations beyond so many of their standard deviations are refused
# Density that vibration adds to the accelerometer's noise, over its amplitude [1/sqrt(Hz)]: it does not add up as
# noise does, and counts for more the more exact the velocity is otherwise.
SHAKEN, SHAKEN_IN_ARENA = 0.002, 0.009
SHAKEN_TURN = 1e-4  # likewise to the gyroscope's [rad/s/sqrt(Hz)]
# Deviation of the wing's force over mass from its model's, as a share: two constants that are a tenth off.
LACKED_SHARE, LACKED_TIME = 0.14, 30.0  # [-], how long it lasts [s]
CALM_UP = 0.3  # deviation of the steady wind's upward part [m/s]
WEATHER_TIME = 1800.0  # in which the steady wind becomes another [s]
MAX_TIMES = 50.0  # time constants after which all is forgotten
SLOTS = N_DELAYED + 2  # lines, velocity of the satellite receiver, attitude of a pose
POSE_HORIZON = 0.06  # what a pose from outside may be late [s]


class FilterSettings(NamedTuple):
    """Parameters of the filter; made of the instruments' specifications."""

    states: int  # used, ARENA_ERRORS or ERRORS
    horizon: int  # slow steps that the filter stands in the past
    gate: float  # [standard deviations]
    decay: Array  # share of every error left after a slow step, (ERRORS,)
    process_noise: Array  # variance that every error gains in a slow step, (ERRORS,)
    gnss_repeats: float  # readings of the receiver that tell as much as one whose noise were new
    misaligned: float  # deviation of the inertial unit's axes [rad]
    shaken: float  # variance that vibration adds to the velocity's, of propellers at vibration_speed [m2/s2]
    initial: Array  # covariance after an alignment on the ground, (ERRORS, ERRORS)
    wind: WindGains


class Step(NamedTuple):
    """One slow step of inertial readings, kept until the filter comes to it."""

    increment: Increment  # with the biases of then taken off
    gyro_bias: Vector  # of then [rad/s]
    accel_bias: Vector  # of then [m/s2]
    force: Vector  # mean specific force as read; outdoors without the propellers' vibration [m/s2]
    rates: Vector  # mean body rates as read [rad/s]
    actuators: Actuators  # as believed at its end


class Filter(NamedTuple):
    """Everything the filter keeps."""

    settings: FilterSettings
    model: Airframe  # as the vehicle knows it
    phase: int  # ALIGNING, RUNNING or REALIGNING
    nominal: NominalState  # at the horizon
    ahead: Increment  # from the horizon to now
    step: Step  # being filled
    actuators: Actuators  # where the commands have brought them
    notch: Notch  # of the gyroscope
    speed_notch: Notch  # of the velocity, which the shaken accelerometer gives
    force_notch: Notch  # of the accelerometer, for what the wing tells
    rates: Vector  # body rates now, smoothed [rad/s]
    velocity: Vector  # now, smoothed, world NWU [m/s]
    acceleration: Vector  # now, smoothed, world NWU [m/s2]
    gusts: GustMeter  # how strong they are
    wing: LackingModel  # how wrong its force
    air_doubt: float  # deviation of what the air is believed to push across the wing [m/s2]
    support: float  # upward force on the vehicle that neither air nor propellers make, smoothed [m/s2]
    support_of_late: float  # the same, smoothed once more [m/s2]
    last: Inertial  # the reading before
    filled: int  # slow steps between the horizon and now
    oldest: int  # place of the oldest of them
    aligned_periods: int  # periods that the present alignment has lasted
    moved: int  # the last of them in which the vehicle moved
    mean_rates: Vector  # of them [rad/s]
    mean_force: Vector  # of them [m/s2]
    decay: Array  # share of every error left after a slow step, (ERRORS,)
    process_noise: Array  # variance that every error gains in a slow step, (ERRORS,)
    covariance: Array  # (ERRORS, ERRORS)
    work: Array  # (ERRORS, ERRORS)
    H: Array  # (ERRORS,)
    PH: Array  # (ERRORS,)
    errors: Array  # (ERRORS,)
    ratio: Array  # squared innovation over its variance of the last reading, worst axis, (LINES,)
    fused_at: Array  # control period of the last reading that was fused, -1 before, (LINES,)
    refused_since: Array  # control period since which all readings are refused, -1 while not, (LINES,)
    refused_at: Array  # control period of the last refusal, by line; beyond: of what else a reading tells, (SLOTS,)
    first_refused_at: Array  # control period of the first refusal after a while without any, (SLOTS,)
    leapt: Array  # 1 where the first refusal for a while was by far, (SLOTS,)
    before: Array  # the reading before, (LINES, READING)
    fault_count: Array  # odd readings of late of gyroscope and accelerometer, (2,)
    failed: Array  # 1 where an instrument has failed, (INSTRUMENTS,)
    doubted_until: Array  # control period until which gyroscope and accelerometer count for less, (2,)
    repeated: Array  # how often in a row it has come again to the last bit, (LINES,)
    squares: Array  # sum of squared innovations over their variances, of the lines and the wing, (LINES + 1,)
    scalars: Array  # how many were summed, (LINES + 1,)
    late: Array  # readings that came after the horizon, (LINES,)
    tube_error: float  # of the pitot's airspeed against the one that the force along the nose tells, smoothed [m/s]
    tube_usual: float  # slow mean of that error [m/s]
    tube_changed: float  # how long the error has been off that mean [s]
    tube_compared: float  # how long the two have been compared [s]
    tube_silent: float  # how long ago that was for the last time [s]
    tube_agreed: float  # how long they have agreed [s]
    tube_missed: float  # how long no reading of a tube that is expected to help could be fused [s]
    standing_time: float  # on the ground, without a break [s]
    resets: int  # of position, velocity or attitude to a reading
    numb: bool  # the model's force stands in for the accelerometer
    lands: bool  # the vehicle wants to touch the ground
    on_ground: bool  # the last, since what follows a flag is out of line in memory


@kernel
def meters_gusts(f: Filter) -> bool:
    """Whether it estimates the gusts' level and what the wing's model lacks, as outdoors; in the arena both are fixed.

    Steps and waves of a wind wall are no turbulence: with a level that is metered vehicles held worse before it.
    """
    return bool(f.settings.states == ERRORS)


put_nominal = writer(Filter, lambda f: f.nominal)
put_ahead = writer(Filter, lambda f: f.ahead)
put_filling = writer(Filter, lambda f: f.step)
put_believed_actuators = writer(Filter, lambda f: f.actuators)
put_notch = writer(Filter, lambda f: f.notch)
put_speed_notch = writer(Filter, lambda f: f.speed_notch)
put_force_notch = writer(Filter, lambda f: f.force_notch)
put_smooth_rates = writer(Filter, lambda f: f.rates)
put_smooth_velocity = writer(Filter, lambda f: f.velocity)
put_smooth_acceleration = writer(Filter, lambda f: f.acceleration)
put_mean_rates = writer(Filter, lambda f: f.mean_rates)
put_mean_force = writer(Filter, lambda f: f.mean_force)
put_last = writer(Filter, lambda f: f.last)
put_phase = writer(Filter, lambda f: f.phase)
put_numb = writer(Filter, lambda f: f.numb)
put_filled = writer(Filter, lambda f: f.filled)
put_oldest = writer(Filter, lambda f: f.oldest)
put_moved = writer(Filter, lambda f: f.moved)
put_aligned_periods = writer(Filter, lambda f: f.aligned_periods)
put_resets = writer(Filter, lambda f: f.resets)
put_standing_time = writer(Filter, lambda f: f.standing_time)
put_gusts = writer(Filter, lambda f: f.gusts)
put_wing = writer(Filter, lambda f: f.wing)
put_air_doubt = writer(Filter, lambda f: f.air_doubt)
put_support = writer(Filter, lambda f: f.support)
put_support_of_late = writer(Filter, lambda f: f.support_of_late)
put_on_ground = writer(Filter, lambda f: f.on_ground)
put_tube_error = writer(Filter, lambda f: f.tube_error)
put_tube_usual = writer(Filter, lambda f: f.tube_usual)
put_tube_changed = writer(Filter, lambda f: f.tube_changed)
put_tube_compared = writer(Filter, lambda f: f.tube_compared)
put_tube_silent = writer(Filter, lambda f: f.tube_silent)
put_tube_agreed = writer(Filter, lambda f: f.tube_agreed)
put_tube_missed = writer(Filter, lambda f: f.tube_missed)
put_step = writer(Step, lambda step: step)


def filter_settings(s: SensorSet, wind: WindGains, *, arena: bool) -> FilterSettings:
    """Parameters of the filter for these instruments.

    Args:
        s: Their specifications.
        wind: Of it the greatest deviation, the threshold of the tube, and how the wind fades without one.
        arena: Whether motion capture aids it; else satellites, magnetic field and pressure.
    """
    aids = (s.motion_capture,) if arena else (s.gnss, s.magnetometer, s.barometer)
    late = max(POSE_HORIZON, *(aid.timing.delay + 3.0 * aid.timing.jitter for aid in aids))
    return FilterSettings(
        states=ARENA_ERRORS if arena else ERRORS,
        horizon=min(math.ceil(late / SLOW_STEP - 1e-9) + 1, MAX_HORIZON - 1),
        gate=GATE,
        decay=_decay(s),
        process_noise=_process_noise(s, wind),
        gnss_repeats=_repeats(s),
        misaligned=s.mounting.misalignment,
        shaken=0.5 * ((SHAKEN_IN_ARENA if arena else SHAKEN) * s.accelerometer.vibration) ** 2 * SLOW_STEP,
        initial=_initial(s, wind, arena=arena),
        wind=wind,
    )


def _repeats(s: SensorSet) -> float:
    """Of a first-order Gauss-Markov noise, (1 + c) / (1 - c) by the correlation c of a reading with the one before."""
    if s.gnss.noise_time == 0.0:
        return 1.0
    correlation = exponential(-min(1.0 / (s.gnss.timing.rate * s.gnss.noise_time), MAX_TIMES))
    return (1.0 + correlation) / (1.0 - correlation)


def _left_after_step(time: float) -> float:
    x = SLOW_STEP / time
    return (1.0 - 0.5 * x) / (1.0 + 0.5 * x)  # rounded the same way by every machine, unlike exp


def _decay(s: SensorSet) -> Array:
    decay = np.ones(ERRORS)
    decay[STEADY_WIND_ERROR : STEADY_WIND_ERROR + 3] = _left_after_step(WEATHER_TIME)
    decay[WING_ERROR] = _left_after_step(LACKED_TIME)
    decay[GNSS_DRIFT_ERROR : GNSS_DRIFT_ERROR + 3] = _left_after_step(s.gnss.drift_time)
    decay[BAROMETER_DRIFT_ERROR] = _left_after_step(s.barometer.drift_time)
    return decay


def _process_noise(s: SensorSet, wind: WindGains) -> Array:
    dt, process_noise = SLOW_STEP, np.zeros(ERRORS)
    process_noise[ATTITUDE_ERROR : ATTITUDE_ERROR + 3] = 0.5 * (s.gyroscope.noise**2 + SHAKEN_TURN**2) * dt
    process_noise[VELOCITY_ERROR : VELOCITY_ERROR + 3] = 0.5 * s.accelerometer.noise**2 * dt
    process_noise[GYRO_BIAS_ERROR : GYRO_BIAS_ERROR + 3] = 2.0 * s.gyroscope.drift**2 / s.gyroscope.drift_time * dt
    process_noise[ACCEL_BIAS_ERROR : ACCEL_BIAS_ERROR + 3] = (
        2.0 * s.accelerometer.drift**2 / s.accelerometer.drift_time * dt
    )
    process_noise[WING_ERROR] = 2.0 * LACKED_SHARE**2 / LACKED_TIME * dt
    process_noise[STEADY_WIND_ERROR : STEADY_WIND_ERROR + 3] = 2.0 * _steady_wind(wind) ** 2 / WEATHER_TIME * dt
    drift = 2.0 / s.gnss.drift_time * dt
    process_noise[GNSS_DRIFT_ERROR : GNSS_DRIFT_ERROR + 3] = (
        np.array([s.gnss.drift_level, s.gnss.drift_level, s.gnss.drift_up]) ** 2 * drift
    )
    process_noise[BAROMETER_DRIFT_ERROR] = 2.0 * s.barometer.drift**2 / s.barometer.drift_time * dt
    return process_noise


def _steady_wind(wind: WindGains) -> Array:
    """Deviations of a steady wind that nothing is known of [m/s]."""
    return np.array([wind.max_deviation, wind.max_deviation, CALM_UP])


def _initial(s: SensorSet, wind: WindGains, *, arena: bool) -> Array:
    """Covariance of a vehicle that has stood or hovered for some seconds."""
    v = np.zeros(ERRORS)
    capture = s.motion_capture
    field = s.magnetometer
    bias = s.accelerometer.bias
    if s.mounting.misalignment > 0.0:  # in the hover a unit that is askew reads as one whose accelerometer is biased
        bias = math.hypot(bias, 9.8 * s.mounting.misalignment)
    tilt = bias / 9.8
    level = math.hypot(field.field_north, field.field_west)
    turn = max(tilt, capture.misalignment if arena else field.bias / level)
    v[POSITION_ERROR : POSITION_ERROR + 3] = 0.01**2 if arena else 0.3**2
    v[VELOCITY_ERROR : VELOCITY_ERROR + 3] = 0.02**2 if arena else 0.1**2
    v[ATTITUDE_ERROR : ATTITUDE_ERROR + 3] = turn**2
    v[GYRO_BIAS_ERROR : GYRO_BIAS_ERROR + 3] = (0.05 * s.gyroscope.bias) ** 2 + s.gyroscope.drift**2
    v[ACCEL_BIAS_ERROR : ACCEL_BIAS_ERROR + 3] = bias**2
    v[STEADY_WIND_ERROR : STEADY_WIND_ERROR + 3] = _steady_wind(wind) ** 2
    v[WIND_ERROR : WIND_ERROR + 3] = _steady_wind(wind) ** 2 + (FIXED_LEVEL if arena else FIRST_LEVEL) ** 2
    v[WING_ERROR] = LACKED_SHARE**2
    v[TUBE_BIAS_ERROR], v[STATIC_PORT_ERROR] = s.pitot.bias**2, s.barometer.position_error**2
    v[TUBE_SPEED_ERROR] = v[WIND_ERROR]
    v[MISALIGNMENT_ERROR : MISALIGNMENT_ERROR + 3] = capture.misalignment**2
    v[MAGNETIC_BIAS_ERROR : MAGNETIC_BIAS_ERROR + 3] = s.magnetometer.bias**2
    P = np.diag(v)
    for k in range(3):
        w, steady = WIND_ERROR + k, STEADY_WIND_ERROR + k
        P[w, steady] = P[steady, w] = v[steady]
    return P


def new_filter(settings: FilterSettings, model: Airframe) -> Filter:
    """A filter that has yet to be aligned."""
    zero, off = Vector(0.0, 0.0, 0.0), Actuators(0.0, 0.0, 0.0, 0.0)
    none = no_increment()
    return Filter(
        settings=settings,
        model=model,
        phase=ALIGNING,
        nominal=at_origin(),
        ahead=none,
        step=Step(increment=none, gyro_bias=zero, accel_bias=zero, force=zero, rates=zero, actuators=off),
        actuators=off,
        notch=quiet(zero),
        speed_notch=quiet(zero),
        force_notch=quiet(zero),
        rates=zero,
        velocity=zero,
        acceleration=zero,
        support=model.g,
        support_of_late=model.g,
        gusts=unknown_gusts(FIRST_LEVEL if settings.states == ERRORS else FIXED_LEVEL),
        wing=LackingModel(FIRST_SHARE, FIRST_SHARE_DOUBT),
        air_doubt=0.0,
        last=Inertial(zero, zero),
        filled=0,
        oldest=0,
        aligned_periods=0,
        moved=0,
        mean_rates=zero,
        mean_force=zero,
        decay=settings.decay.copy(),
        process_noise=settings.process_noise.copy(),
        covariance=np.zeros((ERRORS, ERRORS)),
        work=np.zeros((ERRORS, ERRORS)),
        H=np.zeros(ERRORS),
        PH=np.zeros(ERRORS),
        errors=np.zeros(ERRORS),
        ratio=np.zeros(N_DELAYED),
        fused_at=np.full(N_DELAYED, -1.0),
        refused_since=np.full(N_DELAYED, -1.0),
        refused_at=np.full(SLOTS, -1e9),
        first_refused_at=np.full(SLOTS, -1e9),
        leapt=np.zeros(SLOTS),
        before=np.zeros((N_DELAYED, READING_SIZE)),
        fault_count=np.zeros(2),
        failed=np.zeros(INSTRUMENTS),
        doubted_until=np.full(2, -1.0),
        repeated=np.zeros(N_DELAYED),
        squares=np.zeros(N_DELAYED + 1),
        scalars=np.zeros(N_DELAYED + 1),
        late=np.zeros(N_DELAYED),
        tube_error=0.0,
        tube_usual=0.0,
        tube_changed=0.0,
        tube_compared=0.0,
        tube_silent=0.0,
        tube_agreed=0.0,
        tube_missed=0.0,
        standing_time=0.0,
        resets=0,
        numb=False,
        lands=False,
        on_ground=True,
    )
