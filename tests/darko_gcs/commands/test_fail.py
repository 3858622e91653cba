"""``darko-gcs fail``: its words, and its command on the wire to a real vehicle."""

import pytest

from darko_gcs.__main__ import main
from protocol.dialect import mavlink
from protocol.events import CommandDone
from protocol.names import FAILURE_TYPES, FAILURE_UNITS
from sitl.autopilot.settings import Settings
from tests.support.gcs.linked_station import LinkedStation


def test_units_and_types_have_short_names():
    assert FAILURE_UNITS["gyro"] == mavlink.FAILURE_UNIT_SENSOR_GYRO
    assert FAILURE_UNITS["motor"] == mavlink.FAILURE_UNIT_SYSTEM_MOTOR
    assert FAILURE_TYPES["ok"] == 0
    assert FAILURE_TYPES["intermittent"] == mavlink.FAILURE_TYPE_INTERMITTENT


@pytest.mark.parametrize("arguments", [["wing", "off"], ["motor", "broken"], ["motor"]])
def test_unknown_words_are_refused(arguments, capsys):
    with pytest.raises(SystemExit):
        main(["fail", *arguments])
    assert "darko-gcs fail" in capsys.readouterr().err


def test_the_command_reaches_a_vehicle_that_allows_it(tmp_path):
    link = LinkedStation(tmp_path, up=5.0, settings=Settings(failure_injection=1))
    link.run(1.5)
    link.station.inject_failure(link.now, FAILURE_UNITS["motor"], FAILURE_TYPES["slow"], 2)
    link.run(0.5)
    (done,) = link.events_of(CommandDone)
    assert (done.command, done.result) == (mavlink.MAV_CMD_INJECT_FAILURE, mavlink.MAV_RESULT_ACCEPTED)
    assert "Failure injected: motor 2 slow" in link.text
