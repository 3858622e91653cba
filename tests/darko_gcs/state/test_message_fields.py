"""A message's fields as rows: units, names of enumerations and bits, set-points."""

import math

from pymavlink.dialects.v20 import ardupilotmega

from darko_gcs.state.message_fields import NO_VALUE, field_rows, value_words
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.wire.codec import Codec
from protocol.wire.other_dialects import OtherDialect
from tests.support.gcs.messages import arrived, heartbeat, position


def rows(message, *others):
    known = {other.get_type(): other for other in others}
    return {row.name or f"+{row.meaning}": row for row in field_rows(message, known.get)}


def test_a_field_has_the_wire_s_unit_and_the_value_as_it_is_read():
    place = arrived(mavlink.MAVLink_global_position_int_message(5, 473977420, -85000000, 2500, 0, 0, 0, 0, 9000))
    found = rows(place)
    assert (found["lat"].value, found["lat"].unit, found["lat"].meaning) == ("473977420", "degE7", "47.397742 deg")
    assert (found["alt"].meaning, found["hdg"].meaning) == ("2.5 m", "90 deg")
    assert found["lat"].path == "GLOBAL_POSITION_INT.lat"


def test_enumerations_modes_and_bits_are_spelled_out():
    found = rows(arrived(heartbeat(armed=True)))
    assert found["type"].meaning == "VTOL_DUOROTOR"
    assert found["custom_mode"].meaning == "HOLD"
    assert found["base_mode"].value == "0x81"
    assert "+SAFETY_ARMED" in found
    assert "+CUSTOM_MODE_ENABLED" in found


def test_numbers_that_no_enumeration_has_are_said_to_be_none():
    found = rows(arrived(heartbeat(kind=250)))
    assert found["type"].meaning == "not in MAV_TYPE"


def test_bits_without_a_name_are_told_by_number():
    target = mavlink.MAVLink_extended_sys_state_message(0, 0)
    assert rows(arrived(target))["landed_state"].meaning == "UNDEFINED"
    wanted = mavlink.MAVLink_position_target_local_ned_message(0, 1, 1 << 15 | 1, *[0.0] * 11)
    assert {"+X_IGNORE", "+bit 15"} <= rows(arrived(wanted)).keys()


def test_the_largest_number_of_a_field_with_a_unit_is_no_value():
    state = mavlink.MAVLink_sys_status_message(0, 0, 0, 500, 0xFFFF, -1, -1, 0, 0, 0, 0, 0, 0)
    assert rows(arrived(state))["voltage_battery"].meaning == NO_VALUE


def target(mask):
    return arrived(mavlink.MAVLink_position_target_local_ned_message(0, 1, mask, 4.0, 5.0, -6.0, *[0.0] * 8))


def test_a_set_point_stands_beside_its_value_unless_it_is_to_be_ignored():
    here = arrived(position(10, 1.0))
    assert rows(here, target(0))["x"].wanted == "4"
    assert rows(here, target(mavlink.POSITION_TARGET_TYPEMASK_X_IGNORE))["x"].wanted == ""
    assert rows(here)["x"].wanted == ""


def test_each_number_of_a_short_array_is_a_field_and_a_long_one_is_a_row():
    moved = arrived(mavlink.MAVLink_actuator_output_status_message(0, 3, [1.0, 2.0, *[0.0] * 30]))
    assert "1 2 0" in rows(moved)["actuator"].value
    attitude = mavlink.MAVLink_attitude_quaternion_message(0, 1, 0, 0, 0, 0, 0, 0, [0.5, 0.0, 0.0, 0.0])
    found = rows(arrived(attitude))
    assert (found["repr_offset_q[0]"].value, found["repr_offset_q[0]"].path) == (
        "0.5", "ATTITUDE_QUATERNION.repr_offset_q[0]",
    )  # fmt: skip


def test_text_that_could_control_a_terminal_is_made_harmless():
    text = arrived(mavlink.MAVLink_statustext_message(4, b"\x1b[31mred"))
    assert rows(text)["text"].value == '"?[31mred"'
    assert rows(text)["severity"].meaning == "WARNING"
    assert rows(text)["text"].path == ""


def test_a_message_of_another_dialect_has_that_one_s_names():
    report = ardupilotmega.MAVLink_ekf_status_report_message(3, 0.1, 0.2, 0.3, 0.4, 0.5)
    frame = bytes(report.pack(ardupilotmega.MAVLink(None, srcSystem=1, srcComponent=1)))
    (message,) = Codec(255, 190, other=OtherDialect("ardupilotmega")).decode(frame)
    found = rows(message)
    assert {"+EKF_ATTITUDE", "+EKF_VELOCITY_HORIZ"} <= {key.replace("EKF_STATUS_FLAGS_", "") for key in found}


def test_a_value_of_a_curve_is_told_in_words_where_its_field_is_an_enumeration():
    assert value_words("DARKO_HYBRID_STATE.law", float(Law.FORWARD_LINEAR)) == "forward linear"
    assert value_words("HEARTBEAT.system_status", 4.0) == "active"
    for other in ("DARKO_HYBRID_STATE.v_hover", "DARKO_ACTUATORS.limits", "2*DARKO_HYBRID_STATE.law", "NOTHING.x"):
        assert value_words(other, 1.0) == ""
    assert value_words("DARKO_HYBRID_STATE.law", math.nan) == ""
