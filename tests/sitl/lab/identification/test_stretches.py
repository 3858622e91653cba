"""Parts of a log that are used for identification."""

import numpy as np
import pytest

from sitl.errors import SitlError
from sitl.lab.identification.flight_log import SensorRecord, Series
from sitl.lab.identification.identify_flight import MAX_USED, usable_stretches
from sitl.model.airframe_files import load
from tests.support.lab.identified_flight import still_record

PHYSICAL = load("physical").parameters


def spans(record):
    return [(s.time[0], s.time[-1]) for s in usable_stretches(record, PHYSICAL)]


def without(series, begin, end):
    kept = (series.time < begin) | (series.time > end)
    return Series(series.time[kept], series.values[kept])


@pytest.mark.parametrize("field", ["imu", "commands", "attitude", "motion"])
def test_a_gap_of_any_sensor_parts_the_flight(field):
    record = still_record(30.0)
    parts = {name: getattr(record, name) for name in ("imu", "commands", "attitude", "motion")}
    parts[field] = without(parts[field], 10.0, 12.0)
    (first, second) = spans(SensorRecord(**parts, sources=record.sources))
    assert first == pytest.approx((0.5, 9.5), abs=0.1)
    assert second == pytest.approx((12.5, 29.5), abs=0.1)


def test_the_ground_is_where_the_vehicle_was_with_its_motors_off():
    record = still_record(30.0, height=0.2)
    record.commands.values[record.commands.time < 5.0, :2] = 0.0
    record.motion.values[record.motion.time > 12.0, 2] = 3.0  # on the ground until then
    (only,) = spans(record)
    assert only == pytest.approx((12.5, 29.5), abs=0.1)


def test_a_blow_is_left_out():
    record = still_record(30.0)
    record.imu.values[1500, 4] = 100.0
    assert [round(end - begin) for begin, end in spans(record)] == [13, 13]


def test_of_a_long_flight_the_part_that_turns_most_is_used():
    record = still_record(600.0, rate=50.0)
    turning = (record.imu.time > 400.0) & (record.imu.time < 500.0)
    record.imu.values[turning, 1] += np.sin(record.imu.time[turning])
    found = spans(record)
    assert sum(end - begin for begin, end in found) <= MAX_USED
    assert sum(begin > 380.0 and end < 520.0 for begin, end in found) >= 4


def test_too_little_flight_is_said():
    with pytest.raises(SitlError, match="nothing to identify from: no 6 s in a row off the ground"):
        usable_stretches(still_record(6.5), PHYSICAL)


def test_commands_that_all_were_logged_hold_and_others_are_joined():
    often, seldom = still_record(8.0, rate=500.0), still_record(8.0, rate=100.0)
    for record in (often, seldom):
        record.commands.values[:, 0] = 600.0 + 10.0 * np.round(record.commands.time * 100.0)
    (held,), (joined,) = usable_stretches(often, PHYSICAL), usable_stretches(seldom, PHYSICAL)
    assert set(np.diff(held.commands[:, 0]).round(6)) == {0.0, 10.0}
    assert np.diff(joined.commands[:, 0]) == pytest.approx(1.0)
