"""Specifications of the instruments: what is shipped, what a user's file changes, and how a bad one is refused."""

import math
from typing import get_type_hints

import pytest

from sitl import SitlError
from sitl.model.quaternions import Quaternion, rotate
from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD, Timing
from sitl.sensors.instruments import Mounting, SensorSet
from sitl.sensors.sensor_files import ARMS, FIELD, IMU_ANGLES, MOUNTED, SCALES, SensorError, load_sensors, shipped


@pytest.fixture
def file(tmp_path):
    def written(text):
        path = tmp_path / "own.toml"
        path.write_text(text, encoding="utf-8")
        return str(path)

    return written


def stated(where, value, unit, source="a data sheet"):
    return f'[{where}]\nvalue = {value}\nunit = "{unit}"\nsource = "{source}"\n'


def numbers(sensors):
    """Every number of a set, by instrument and key."""
    for name, part in sensors._asdict().items():
        for key, value in part._asdict().items():
            if key == "timing":
                yield from (((name, inner), number) for inner, number in value._asdict().items())
            else:
                yield (name, key), value


def test_every_value_has_a_unit_that_is_known_and_a_source():
    table = shipped()
    assert set(table) == set(SensorSet._fields)
    for name, entries in table.items():
        for key, entry in entries.items():
            assert entry.unit in SCALES, (name, key)
            assert len(entry.source) > 4, (name, key)


def test_every_field_of_a_specification_is_stated_and_no_other():
    for name, kind in get_type_hints(SensorSet).items():
        wanted = {key for key in kind._fields if key != "timing" and not key.startswith("field_")}
        wanted |= set(Timing._fields) if "timing" in kind._fields else set()
        wanted |= set(FIELD) if name == "magnetometer" else set()
        if name == "mounting":
            wanted = wanted - {"imu_attitude", *MOUNTED} | {*IMU_ANGLES, *ARMS}
        assert set(shipped()[name]) == wanted, name


def test_values_are_brought_to_si():
    sensors = load_sensors()
    assert sensors.gyroscope.bias == pytest.approx(math.radians(1.0))
    assert sensors.accelerometer.noise == pytest.approx(150e-6 * 9.80665)
    assert sensors.accelerometer.bias == pytest.approx(0.020 * 9.80665)
    assert sensors.accelerometer.range == pytest.approx(16.0 * 9.80665)
    assert sensors.motion_capture.noise == pytest.approx(0.5e-3)
    assert sensors.magnetometer.noise == pytest.approx(0.5e-6)


def test_the_field_points_north_east_of_north_and_down_over_europe():
    field = load_sensors().magnetometer
    strength = math.sqrt(field.field_north**2 + field.field_west**2 + field.field_up**2)
    assert strength == pytest.approx(46.9e-6)
    assert math.atan2(-field.field_up, math.hypot(field.field_north, field.field_west)) == pytest.approx(
        math.radians(59.3)
    )
    assert math.atan2(-field.field_west, field.field_north) == pytest.approx(math.radians(1.9))


def test_a_file_states_single_values_anew_and_leaves_all_others(file):
    path = file(stated("gnss.delay", 0.2, "s") + stated("gyroscope.bias", 3, "deg/s"))
    own, before = dict(numbers(load_sensors(path))), dict(numbers(load_sensors()))
    assert own.keys() == before.keys()
    changed = {key: own[key] for key in own if own[key] != before[key]}
    assert changed == {("gnss", "delay"): 0.2, ("gyroscope", "bias"): pytest.approx(math.radians(3.0))}


NOT_AN_ENTRY = "must be { value = ..., unit = ..., source = ... }"
BAD = {
    "no TOML": ("gnss = [", "not a TOML file"),
    "no table": ("gnss = 3", "gnss must be a table of values"),
    "no entry": ("[gnss]\ndelay = 0.1", f"gnss.delay {NOT_AN_ENTRY}"),
    "no source": ('[gnss.delay]\nvalue = 0.1\nunit = "s"', f"gnss.delay {NOT_AN_ENTRY}"),
    "empty source": (stated("gnss.delay", 0.1, "s", ""), "gnss.delay names no source"),
    "one key too many": (stated("gnss.delay", 0.1, "s") + "note = 1", f"gnss.delay {NOT_AN_ENTRY}"),
    "text": (stated("gnss.delay", '"late"', "s"), "gnss.delay = 'late' is not a finite number"),
    "flag": (stated("gnss.delay", "true", "s"), "gnss.delay = True is not a finite number"),
    "nan": (stated("gnss.delay", "nan", "s"), "gnss.delay = nan is not a finite number"),
    "infinite": (stated("gnss.delay", "inf", "s"), "gnss.delay = inf is not a finite number"),
    "longer than a float": (stated("gnss.delay", "1" + 400 * "0", "s"), "is not a finite number"),
    "unknown instrument": (stated("gns.delay", 0.1, "s"), "there is no instrument 'gns'; did you mean 'gnss'?"),
    "unknown key": (stated("gnss.dealy", 0.1, "s"), "gnss has no 'dealy'; did you mean 'delay'?"),
    "unit": (stated("gnss.delay", 100, "ms"), "gnss.delay is in 'ms', must be in 's'"),
    "negative": (stated("gnss.noise_up", -0.1, "m"), "gnss.noise_up = -0.1 must not be negative"),
    "shorter than a step": (stated("pitot.lag", 0.001, "s"), "pitot.lag = 0.001 s is below 0.01 s"),
    "drift like noise": (stated("gnss.drift_time", 0.005, "s"), "gnss.drift_time = 0.005 s is below 0.01 s"),
    "no rate": (stated("gnss.rate", 0, "Hz"), "gnss.rate must be positive"),
    "no step": (stated("barometer.step", 0, "m"), "barometer.step must be positive"),
    "too often": (stated("gnss.rate", 120, "Hz"), "gnss.rate = 120 Hz is above 100 Hz"),
    "poses too often": (stated("motion_capture.rate", 251, "Hz"), "motion_capture.rate = 251 Hz is above 250 Hz"),
    "too late": (stated("gnss.delay", 0.48, "s"), "gnss.delay = 0.48 s with its jitter is above 0.5 s"),
    "more than all lost": (stated("gnss.dropout", 1.5, "-"), "gnss.dropout = 1.5 is above 1"),
    "never a frame": (stated("pipeline.servo_rate", 0, "Hz"), "pipeline.servo_rate must be positive"),
    "noise of no time": (stated("gnss.noise_time", 0.005, "s"), "gnss.noise_time = 0.005 s is below 0.01 s"),
    "slow pipeline": (stated("pipeline.latency", 0.11, "s"), "pipeline.latency = 0.11 s is above 0.1 s"),
    "field straight down": (
        stated("magnetometer.field_inclination", 90, "deg"),
        "magnetometer.field_inclination = 90 deg leaves no level field to tell north by; at most 85 deg",
    ),
}


@pytest.mark.parametrize("kind", BAD)
def test_a_bad_file_is_refused_in_one_line_that_names_it(kind, file):
    text, message = BAD[kind]
    path = file(text)
    with pytest.raises(SensorError) as refused:
        load_sensors(path)
    said = str(refused.value)
    assert said.startswith(f"{path}: ")
    assert message in said
    assert "\n" not in said


def test_the_mounting_is_told_by_angles_and_axes(file):
    said = stated("mounting.imu_pitch", -90, "deg") + stated("mounting.imu_yaw", 0, "deg")
    mounting = load_sensors(file(said + stated("mounting.antenna_x", -0.1, "m"))).mounting
    assert rotate(mounting.imu_attitude, Vector(1.0, 0.0, 0.0)) == pytest.approx((0.0, 0.0, 1.0), abs=1e-12)
    assert mounting.antenna == (-0.1, 0.0, 0.0)
    pitched = load_sensors("truthful").mounting
    assert rotate(pitched.imu_attitude, Vector(0.0, 1.0, 0.0)) == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)
    tilt = rotate(pitched.imu_attitude, Vector(1.0, 0.0, 0.0)).x
    assert math.degrees(math.acos(tilt)) == pytest.approx(17.0)


def test_instruments_as_shipped_have_none_of_what_the_truthful_ones_have():
    """So that flights on the former do not pay for the latter."""
    shipped, truthful = load_sensors(), load_sensors("truthful")
    assert shipped.mounting == Mounting(Quaternion(1.0, 0.0, 0.0, 0.0), *2 * (Vector(0.0, 0.0, 0.0),), 0.0, 0.0)
    assert (shipped.gnss.noise_time, shipped.motion_capture.burst) == (0.0, 0.0)
    frames = shipped.pipeline
    assert (frames.servo_rate * PERIOD, frames.motor_rate * PERIOD, frames.mean_delay) == (1.0, 1.0, 0.0)
    changed = [name for name, a, b in zip(shipped._fields, shipped, truthful, strict=True) if a != b]
    assert changed == ["gnss", "motion_capture", "pipeline", "mounting"]


def test_a_servo_waits_half_a_frame_in_the_mean():
    pipeline = load_sensors("truthful").pipeline._replace(latency=0.01)
    assert pipeline.mean_delay == pytest.approx(0.01 + 0.009)
    assert pipeline._replace(servo_rate=1000.0).mean_delay == 0.01


def test_a_file_that_is_not_there_or_not_text_is_refused(tmp_path):
    with pytest.raises(SitlError, match=r"none\.toml: No such file"):
        load_sensors(str(tmp_path / "none.toml"))
    path = tmp_path / "bytes.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SitlError, match=r"bytes\.toml: not a TOML file"):
        load_sensors(str(path))
