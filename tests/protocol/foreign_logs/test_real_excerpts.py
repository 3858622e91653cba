"""Lines that Paparazzi's recorders wrote, as they stand in logs that are public, are read as they were meant.

Of the repositories tudelft/paparazzi_log_parsing (new_python/example: 20_06_02__14_19_30, a Disco's telemetry, and
80_01_06__06_58_24_SD, its own card) and alrochas1/ros_paparazzi (data/25_02_06__10_14_35, a rover's telemetry).
"""

import numpy as np
import pytest

from protocol.flight_log.flight_summary import summarise
from protocol.foreign_logs import read_log
from protocol.foreign_logs.utm import from_utm

COMMENTS = """\
<!-- logged with runtime paparazzi_version v5.15_devel-232-gea25c49d7-dirty -->
<!-- logged with build paparazzi_version v5.15_devel-222-ge5825a29f-dirty -->
"""
MESSAGES = """\
      <message NAME="ALIVE" ID="2">
        <description>alive/heartbeat message containing the MD5sum of the aircraft configuration</description>
        <field TYPE="uint8[]" NAME="md5sum"></field>
      </message>
      <message NAME="PONG" ID="3">
        <description>Answer to PING datalink message, to measure latencies</description>
      </message>
      <message NAME="ATTITUDE" ID="6">
        <field UNIT="rad" TYPE="float" NAME="phi" ALT_UNIT="deg"></field>
        <field UNIT="rad" TYPE="float" NAME="psi" ALT_UNIT="deg"></field>
        <field UNIT="rad" TYPE="float" NAME="theta" ALT_UNIT="deg"></field>
      </message>
      <message NAME="GPS" ID="8">
        <field UNIT="byte_mask" TYPE="uint8" NAME="mode"></field>
        <field UNIT="cm" TYPE="int32" NAME="utm_east" ALT_UNIT="m"></field>
        <field UNIT="cm" TYPE="int32" NAME="utm_north" ALT_UNIT="m"></field>
        <field UNIT="decideg" TYPE="int16" NAME="course" ALT_UNIT="deg"></field>
        <field UNIT="mm" TYPE="int32" NAME="alt" ALT_UNIT="m">Altitude above geoid (MSL)</field>
        <field UNIT="cm/s" TYPE="uint16" NAME="speed" ALT_UNIT="m/s">norm of 2d ground speed in cm/s</field>
        <field UNIT="cm/s" TYPE="int16" NAME="climb" ALT_UNIT="m/s"></field>
        <field UNIT="weeks" TYPE="uint16" NAME="week"></field>
        <field UNIT="ms" TYPE="uint32" NAME="itow"></field>
        <field TYPE="uint8" NAME="utm_zone"></field>
        <field TYPE="uint8" NAME="gps_nb_err"></field>
      </message>
      <message NAME="PPRZ_MODE" ID="11">
        <field VALUES="MANUAL|AUTO1|AUTO2|HOME|NOGPS|FAILSAFE" TYPE="uint8" NAME="ap_mode"></field>
        <field VALUES="MANUAL|AUTO_THROTTLE|AUTO_CLIMB|AUTO_ALT" TYPE="uint8" NAME="ap_gaz"></field>
        <field VALUES="MANUAL|ROLL_RATE|ROLL|COURSE" TYPE="uint8" NAME="ap_lateral"></field>
        <field VALUES="WAYPOINT|ROUTE|CIRCLE" TYPE="uint8" NAME="ap_horizontal"></field>
        <field VALUES="NONE|DOWN|UP" TYPE="uint8" NAME="if_calib_mode"></field>
        <field VALUES="LOST|OK|REALLY_LOST" TYPE="uint8" NAME="mcu1_status"></field>
      </message>
      <message NAME="ENERGY" ID="12">
        <field UNIT="%" TYPE="uint8" NAME="throttle">Throttle setting</field>
        <field UNIT="V" TYPE="float" NAME="voltage">Input battery voltage</field>
        <field UNIT="A" TYPE="float" NAME="current">Current consumption</field>
        <field UNIT="W" TYPE="float" NAME="power">Electrical power</field>
        <field UNIT="Ah" TYPE="float" NAME="charge">Accumulated consumed charge</field>
        <field UNIT="Wh" TYPE="float" NAME="energy">Accumulated consumed energy</field>
      </message>
      <message NAME="IMU_GYRO" ID="200">
        <field UNIT="rad/s" TYPE="float" NAME="gp" ALT_UNIT_COEF="57.29578" ALT_UNIT="deg/s"></field>
        <field UNIT="rad/s" TYPE="float" NAME="gq" ALT_UNIT_COEF="57.29578" ALT_UNIT="deg/s"></field>
        <field UNIT="rad/s" TYPE="float" NAME="gr" ALT_UNIT_COEF="57.29578" ALT_UNIT="deg/s"></field>
      </message>
      <message NAME="IMU_ACCEL" ID="202">
        <field UNIT="m/s-2" TYPE="float" NAME="ax"></field>
        <field UNIT="m/s-2" TYPE="float" NAME="ay"></field>
        <field UNIT="m/s-2" TYPE="float" NAME="az"></field>
      </message>
      <message NAME="AIR_DATA" ID="222">
        <field UNIT="Pa" TYPE="float" NAME="pressure">static pressure</field>
        <field UNIT="Pa" TYPE="float" NAME="diff_p">differential pressure</field>
        <field UNIT="deg celcius" TYPE="float" NAME="temp">air temperature</field>
        <field UNIT="hPa" TYPE="float" NAME="qnh">barometric pressure adjusted to sea level</field>
        <field UNIT="m" TYPE="float" NAME="amsl_baro">barometric altitude above mean sea level</field>
        <field UNIT="m/s" TYPE="float" NAME="airspeed">Equivalent Air Speed</field>
        <field TYPE="float" NAME="tas">True Air Speed (when P, T and P_diff are available)</field>
      </message>
      <message NAME="GPS_INT" ID="155">
        <field UNIT="cm" TYPE="int32" NAME="ecef_x" ALT_UNIT="m"></field>
        <field UNIT="cm" TYPE="int32" NAME="ecef_y" ALT_UNIT="m"></field>
        <field UNIT="cm" TYPE="int32" NAME="ecef_z" ALT_UNIT="m"></field>
        <field UNIT="1e7deg" TYPE="int32" NAME="lat" ALT_UNIT_COEF="0.0000001" ALT_UNIT="deg"></field>
        <field UNIT="1e7deg" TYPE="int32" NAME="lon" ALT_UNIT_COEF="0.0000001" ALT_UNIT="deg"></field>
        <field UNIT="mm" TYPE="int32" NAME="alt" ALT_UNIT="m">altitude above WGS84 reference ellipsoid</field>
        <field UNIT="mm" TYPE="int32" NAME="hmsl" ALT_UNIT="m">height above mean sea level (geoid)</field>
        <field UNIT="cm/s" TYPE="int32" NAME="ecef_xd" ALT_UNIT="m/s"></field>
        <field UNIT="cm/s" TYPE="int32" NAME="ecef_yd" ALT_UNIT="m/s"></field>
        <field UNIT="cm/s" TYPE="int32" NAME="ecef_zd" ALT_UNIT="m/s"></field>
        <field UNIT="cm" TYPE="uint32" NAME="pacc" ALT_UNIT="m"></field>
        <field UNIT="cm/s" TYPE="uint32" NAME="sacc" ALT_UNIT="m/s"></field>
        <field TYPE="uint32" NAME="tow"></field>
        <field TYPE="uint16" NAME="pdop"></field>
        <field TYPE="uint8" NAME="numsv"></field>
        <field VALUES="NONE|NA|2D|3D|DGPS|RTK" TYPE="uint8" NAME="fix"></field>
        <field VALUES="NONE|UBX|NMEA|SIRF|SKYTRAQ|MTK" TYPE="uint8" NAME="comp_id"></field>
      </message>
      <message NAME="ROTORCRAFT_FP" ID="147">
        <field TYPE="int32" NAME="east" ALT_UNIT_COEF="0.0039063" ALT_UNIT="m"></field>
        <field TYPE="int32" NAME="north" ALT_UNIT_COEF="0.0039063" ALT_UNIT="m"></field>
        <field TYPE="int32" NAME="up" ALT_UNIT_COEF="0.0039063" ALT_UNIT="m"></field>
        <field TYPE="int32" NAME="veast" ALT_UNIT_COEF="0.0000019" ALT_UNIT="m/s"></field>
        <field TYPE="int32" NAME="vnorth" ALT_UNIT_COEF="0.0000019" ALT_UNIT="m/s"></field>
        <field TYPE="int32" NAME="vup" ALT_UNIT_COEF="0.0000019" ALT_UNIT="m/s"></field>
        <field TYPE="int32" NAME="phi" ALT_UNIT_COEF="0.0139882" ALT_UNIT="deg"></field>
        <field TYPE="int32" NAME="theta" ALT_UNIT_COEF="0.0139882" ALT_UNIT="deg"></field>
        <field TYPE="int32" NAME="psi" ALT_UNIT_COEF="0.0139882" ALT_UNIT="deg"></field>
        <field TYPE="int32" NAME="carrot_east" ALT_UNIT_COEF="0.0039063" ALT_UNIT="m"></field>
        <field TYPE="int32" NAME="carrot_north" ALT_UNIT_COEF="0.0039063" ALT_UNIT="m"></field>
        <field TYPE="int32" NAME="carrot_up" ALT_UNIT_COEF="0.0039063" ALT_UNIT="m"></field>
        <field TYPE="int32" NAME="carrot_psi" ALT_UNIT_COEF="0.0139882" ALT_UNIT="deg"></field>
        <field TYPE="int32" NAME="thrust"></field>
        <field UNIT="s" TYPE="uint16" NAME="flight_time"></field>
      </message>
"""
DISCO = """\
130.571 185 GPS 0 41454841 563392736 0 12755746 0 0 2109 217318750 26 0
130.573 185 PONG\x20
130.823 185 AIR_DATA 101711. 0. 32.43 0. 0. -1. -1.
131.134 185 ENERGY 0 11.368268 87.694901 996.939148 2.621082 29.765707
131.346 185 PPRZ_MODE 0 0 0 0 0 17
131.704 185 IMU_GYRO -0.006592 0.001709 -0.003662
131.810 185 IMU_ACCEL -7.799805 -2.958008 -17.941406
131.811 185 ATTITUDE 0.16649 3.105027 -0.41506
132.045 185 GPS 3 59416938 576079746 697 346873 1998 -1799 2109 217320250 31 0
132.166 185 AIR_DATA 101710. 0. 32.450001 0. 0. -1. -1.
132.295 185 GPS 3 59417295 576079908 714 341702 1915 -1797 2109 217320500 31 0
132.295 185 IMU_GYRO -0.006104 0.00293 -0.003418
132.459 185 ATTITUDE 0.166461 3.105109 -0.415056
"""
ROVER = """\
4.537 1 ATTITUDE -2.246075 0.526051 0.164044
4.537 1 ROTORCRAFT_FP 0 0 0 0 0 -2304 -9205 649 2156 0 0 0 0 -144 0
4.609 1 GPS_INT 637813700 0 0 0 0 0 -17000 0 0 0 649519040 3434 378897250 9999 0 0 1
6.932 1 ALIVE 229,41,65,11,167,17,13,234,91,165,163,242,39,165,13,188
"""


def read(folder, data, comments=COMMENTS, head='time_of_day="1591100370.43" data_file="20_06_02__14_19_30.data"'):
    log = f'{comments}<configuration {head}>\n<protocol><class NAME="telemetry" ID="1">\n{MESSAGES}</class></protocol>'
    path = folder / "20_06_02__14_19_30.log"
    path.write_text(log + "</configuration>\n")
    path.with_suffix(".data").write_text(data)
    return read_log(path)


def test_a_disco_over_delft(tmp_path):
    reader = read(tmp_path, DISCO)
    assert not reader.damage
    assert summarise(reader).start_usec == pytest.approx((1591100370.43 + 130.573) * 1e6, abs=2e6)
    place = reader.columns("GLOBAL_POSITION_INT")
    assert len(place["lat"]) == 2  # the places before the fix are none
    assert (place["lat"][0], place["lon"][0]) == (pytest.approx(519898.51e3, abs=5), pytest.approx(43714.42e3, abs=5))
    assert place["alt"].tolist() == [346873, 341702]
    assert (place["vx"][0], place["vy"][0], place["vz"][0]) == (693, 1874, 1799)  # 19.98 m/s to 69.7 deg, sinking
    moved = (place["lat"][1] - place["lat"][0]) * 1.1132e-2, (place["lon"][1] - place["lon"][0]) * 1.1132e-2 * 0.6158
    assert moved == pytest.approx((1.57, 3.59), abs=0.1)  # by the grid's 3.57 east and 1.62 north, turned by 1.1 deg
    assert reader.columns("SYS_STATUS")["voltage_battery"][0] == 11368
    assert not len(reader.rows("VFR_HUD"))  # there is no tube


def test_fields_stand_in_the_order_of_their_definition(tmp_path):
    angles = read(tmp_path, DISCO).columns("ATTITUDE")
    assert (angles["roll"][0], angles["pitch"][0], angles["yaw"][0]) == pytest.approx((0.16649, -0.41506, 3.105027))
    imu = read(tmp_path, DISCO).columns("HIGHRES_IMU")
    assert (imu["xgyro"][0], imu["zacc"][0]) == pytest.approx((-0.006592, -17.941406))


def test_two_messages_of_a_rover_tell_the_same_attitude(tmp_path):
    whole = read(tmp_path, ROVER).columns("ATTITUDE")
    binary = read(tmp_path, "".join(line for line in ROVER.splitlines(True) if " ATTITUDE " not in line))
    angles = binary.columns("ATTITUDE")
    for name in ("roll", "pitch", "yaw"):
        assert angles[name][0] == pytest.approx(whole[name][0], abs=0.01)
    assert not len(binary.rows("GLOBAL_POSITION_INT"))  # its receiver had no fix


@pytest.mark.parametrize("comments", ["", COMMENTS, "\n<!-- a > b -->\n"])
def test_comments_before_the_configuration_are_passed_over(tmp_path, comments):
    assert len(read(tmp_path, DISCO, comments).rows("ATTITUDE")) == 2


def test_a_date_of_1980_is_none(tmp_path):
    head = 'data_file="80_01_06__06_58_24_SD.data" time_of_day="315986304.442"'
    assert summarise(read(tmp_path, DISCO, "", head)).start_usec < 1e9


def test_places_in_utm_are_those_of_the_globe():
    """Muret, where flight plans of Paparazzi begin: its NAVIGATION_REF in the log, its degrees in the plans."""
    lat, lon = from_utm(np.array([360285.0, 500000.0]), np.array([4813595.0, -1000.0]), np.array([31.0, 1.0]))
    assert (lat[0], lon[0]) == pytest.approx((43.46223, 1.27289), abs=1e-5)
    assert (lat[1], lon[1]) == pytest.approx((-1000.0 / 0.9996 / 110574.4, -177.0), abs=1e-6)
