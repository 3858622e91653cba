"""Quantities of a log by name."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.errors import FileError
from protocol.flight_log.field_expressions import quantity
from protocol.tlog import TlogReader, read_tlog
from tests.support.gcs.messages import position
from tests.support.logs import bare, log_of
from tests.support.paths import DATA

LOG = read_tlog(DATA / "square-flight.tlog")


def values(text):
    return quantity(LOG, text).values


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
        ("ATTITUDE", "ATTITUDE is not a field"),
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
