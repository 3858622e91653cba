"""Quantities of a log by name: ``ATTITUDE.roll``, ``deg(DARKO_ACTUATORS.elevon[0])``, ``LOCAL_POSITION_NED.z * -1``."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.flight_log.field_expressions import (
    HELD,
    between,
    completions,
    longest_step,
    pieces,
    quantity,
    with_gaps,
)
from protocol.tlog import TlogReader, read_tlog
from tests.support.gcs.messages import position
from tests.support.logs import bare, log_of
from tests.support.paths import DATA

TIMES = np.array([0.0, 1.0, 2.0, 50.0, 51.0])
VALUES = np.array([0.0, 1.0, 2.0, 50.0, 51.0])


def test_values_between_neighbours_are_in_proportion_and_in_a_gap_there_are_none():
    found = between(np.array([-1.0, 0.5, 2.0, 2.5, 30.0, 49.9, 50.0, 50.5, 52.0]), TIMES, VALUES)
    assert np.array_equal(found, [0.0, 0.5, 2.0, np.nan, np.nan, np.nan, 50.0, 50.5, 51.0], equal_nan=True)


@pytest.mark.parametrize(
    ("turn", "told", "found"),
    [
        (HELD, [4.0, 7.0, 7.0], [4.0, 4.0, 7.0]),
        (360.0, [170.0, -170.0, -150.0], [170.0, 175.0, -160.0]),
        (360.0, [350.0, 10.0, 20.0], [350.0, 355.0, 15.0]),
        (360.0, [10.0, 350.0, 340.0], [10.0, 5.0, 345.0]),
        (360.0, [700.0, 740.0, 780.0], [700.0, 710.0, 760.0]),  # turns were counted: nothing crosses
        (360.0, [np.nan, -170.0, 170.0], [np.nan, np.nan, -180.0]),
    ],
)
def test_codes_are_held_and_angles_go_the_shorter_way_round(turn, told, found):
    values = between(np.array([0.0, 0.25, 1.5]), np.arange(3.0), np.array(told), turn)
    assert np.array_equal(values, found, equal_nan=True)


def test_one_angle_alone_is_known_near_it():
    assert between(np.array([0.5]), np.array([0.0]), np.array([3.0]), 360.0).tolist() == [3.0]


def test_where_messages_meet_codes_stay_codes_and_a_heading_passes_north():
    def attitude(ms, yaw):
        return mavlink.MAVLink_attitude_message(ms, 0.0, 0.0, yaw, 0.0, 0.0, 0.0)

    def mode(number):
        return mavlink.MAVLink_heartbeat_message(19, 12, 129, number, 4, 3)

    told = [attitude(0, 3.0), mode(50593792), position(0, 1.0), position(0, 2.0), attitude(0, -3.0), mode(84148224)]
    met = TlogReader(log_of(map(bare, told), step=100_000))
    assert quantity(met, "LOCAL_POSITION_NED.x * 0 + HEARTBEAT.custom_mode").values.tolist() == [50593792.0] * 2
    yaw = quantity(met, "LOCAL_POSITION_NED.x * 0 + ATTITUDE.yaw").values
    assert np.remainder(yaw, 2.0 * np.pi) == pytest.approx([np.pi, 3.0 + 1.5 * (np.pi - 3.0)], abs=1e-6)
    at_attitude = quantity(met, "LOCAL_POSITION_NED.x", message="ATTITUDE")
    assert at_attitude.rows.tolist() == [0, 4]
    assert at_attitude.values.tolist() == [1.0, 2.0]


def test_a_power_may_be_written_with_either_sign():
    assert values("ATTITUDE.roll^2 + 1").tolist() == values("ATTITUDE.roll**2 + 1").tolist()


def test_far_outside_nothing_is_known():
    assert np.isnan(between(np.array([-9.0, 60.0]), TIMES, VALUES)).all()


def test_a_drawn_line_breaks_in_the_middle_of_a_gap():
    times, values = with_gaps(TIMES, VALUES)
    assert times.tolist() == [0.0, 1.0, 2.0, 26.0, 50.0, 51.0]
    assert np.array_equal(values, [0.0, 1.0, 2.0, np.nan, 50.0, 51.0], equal_nan=True)
    assert with_gaps(TIMES, np.stack((VALUES, VALUES), axis=1))[1].shape == (6, 2)


def test_a_slow_message_has_no_gap_at_its_own_rate():
    slow = np.arange(5) * 30.0
    assert len(with_gaps(slow, slow)[0]) == 5


@given(st.lists(st.floats(0.0, 1e4), min_size=1, max_size=20))
def test_at_its_own_times_a_series_is_itself(times):
    times = np.unique(np.array(times))
    assert between(times, times, times * 2.0).tolist() == (times * 2.0).tolist()
    assert longest_step(times) >= 2.0


def test_a_series_falls_into_pieces_between_its_gaps():
    assert [(piece.start, piece.stop) for piece in pieces(TIMES)] == [(0, 3), (3, 5)]


LOG = read_tlog(DATA / "square-flight.tlog")


def values(text):
    return quantity(LOG, text).values


def test_quantities_have_the_names_of_the_panels_too():
    assert values("power * 2") == pytest.approx(2.0 * LOG.columns("DARKO_ENERGY")["power"])
    assert quantity(LOG, "altitude - 1").values == pytest.approx(
        LOG.columns("GLOBAL_POSITION_INT")["relative_alt"] / 1000.0 - 1.0
    )
    units = {
        "tilt": "deg",
        "climb": "m/s",
        "altitude - 1": "m",
        "SYS_STATUS.voltage_battery / 1000": "V",
        "east / 1000": "",
    }
    assert {text: quantity(LOG, text).unit for text in units} == units


def test_tilt_is_the_angle_from_upright_and_the_nose_s_the_one_above_the_horizon():
    roll, pitch = (LOG.columns("ATTITUDE")[name].astype(float) for name in ("roll", "pitch"))
    assert values("tilt") == pytest.approx(np.degrees(np.arccos(np.cos(roll) * np.cos(pitch))), abs=1e-3)
    assert values("tilt + nose") == pytest.approx(np.full(len(roll), 90.0))
    assert values("tilt").max() > 45.0  # it flew forward


@pytest.mark.parametrize(
    ("typed", "becomes"),
    [
        ("ti", ["tilt"]),
        ("2 * darko_e", ["2 * DARKO_ENERGY."]),
        ("deg(ATTITUDE.pi", ["deg(ATTITUDE.pitch", "deg(ATTITUDE.pitchspeed"]),
        ("hy", ["hypot("]),
        ("NOTHING.x", []),
        ("3 + ", []),
        ("", []),
    ],
)
def test_what_is_typed_is_completed(typed, becomes):
    assert completions(typed, LOG.names) == becomes


def test_a_field_is_its_column():
    found = quantity(LOG, " ATTITUDE.roll ")
    assert found.values == pytest.approx(LOG.columns("ATTITUDE")["roll"])
    assert (found.rows == LOG.rows("ATTITUDE")).all()


def test_arithmetic_functions_and_constants():
    z = LOG.columns("LOCAL_POSITION_NED")["z"].astype(float)
    assert values("-LOCAL_POSITION_NED.z * 2 + 1") == pytest.approx(1.0 - 2.0 * z)
    roll = LOG.columns("ATTITUDE")["roll"]
    assert values("deg(ATTITUDE.roll)") == pytest.approx(values("ATTITUDE.roll * 180 / pi"))
    assert values("max(abs(ATTITUDE.roll), 0.1)") == pytest.approx(np.maximum(np.abs(roll), 0.1))


def test_an_array_has_an_index():
    elevon = LOG.columns("DARKO_ACTUATORS")["elevon"]
    for index in (0, 1):
        assert values(f"DARKO_ACTUATORS.elevon[{index}]") == pytest.approx(elevon[:, index])


def test_messages_meet_at_the_times_of_the_first():
    found = quantity(LOG, "LOCAL_POSITION_NED.z - ATTITUDE.roll * 0")
    assert found.values == pytest.approx(LOG.columns("LOCAL_POSITION_NED")["z"])


def test_fields_of_one_message_meet_record_by_record_also_where_the_recording_clock_stands():
    positions = [position(0, north, vx=10.0 * north) for north in (1.0, 2.0, 3.0)]
    stopped = TlogReader(log_of(map(bare, positions), step=0))
    found = quantity(stopped, "LOCAL_POSITION_NED.x + LOCAL_POSITION_NED.vx").values
    assert found.tolist() == [11.0, 22.0, 33.0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is not an expression"),
        ("1 + 2", "names no field"),
        ("ATTITUDE", "ATTITUDE is not a field: of this message they are time_boot_ms, roll, pitch"),
        ("deg(ATIT)", "ATIT is not a field: write MESSAGE.field; did you mean ATTITUDE"),
        ("tlt", "^tlt is not a field: did you mean tilt"),
        ("xyz + 1", r"^xyz \+ 1: xyz is not a field: write MESSAGE.field, or one of V, .*; it has .* and \d+ more$"),
        ("ATTITUDE.rol", "ATTITUDE has no field rol"),
        ("NOTHING.x", "the dialect has no message NOTHING"),
        ("VIBRATION.vibration_x", "the log has no VIBRATION"),
        ("STATUSTEXT.text", "STATUSTEXT.text is text"),
        ("DARKO_ACTUATORS.elevon", r"has the numbers \[0\] to \[1\]"),
        ("ATTITUDE.roll[0]", "is a single number"),
        ("hypot(ATTITUDE.roll)", "hypot takes 2 values, not 1"),
        ("__import__('os').system('true')", "is not a field"),
        ("(lambda: 1)()", "is not a field"),
        ("ATTITUDE.roll if 1 else 2", "is not a field"),
        ("True + ATTITUDE.roll", "True is not a field"),
        ("(" * 150 + "1" + ")" * 150, "names no field|is not an expression"),
        ("1" * 401, "longer than"),
    ],
)
def test_what_it_cannot_read_is_an_error_that_says_what(text, said):
    with pytest.raises(FileError, match=said):
        quantity(LOG, text)


@given(st.text(alphabet="ATIUDE.rol pi()[]0123456789+-*/,_", max_size=40))
def test_no_text_raises_another_error(text):
    try:
        found = quantity(LOG, text)
    except FileError:
        return
    assert found.values.shape == found.rows.shape


def test_constants_in_numbers():
    assert values("ATTITUDE.roll * 0 + g") == pytest.approx(9.80665)
    assert values("ATTITUDE.roll * 0 + pi") == pytest.approx(np.pi)
