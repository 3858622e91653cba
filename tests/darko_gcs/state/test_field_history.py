"""The last minutes of a vehicle's messages as arrays, by the vehicle's own clock."""

import numpy as np
import pytest

from darko_gcs.state import field_history
from darko_gcs.state.field_history import FieldHistory
from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.names import Mode, custom_mode
from tests.support.gcs.messages import OTHER_VEHICLE, arrived, heartbeat, jump, position


@pytest.fixture
def history():
    history = FieldHistory()
    history.follow((1, 1))
    return history


def take(history, *messages, now=0.0, codec=None):
    history.take([arrived(message, *filter(None, [codec])) for message in messages], now)


def fly(history, count, begin=0.0):
    for k in range(count):
        take(history, position(round(1e3 * (begin + 0.1 * k)), float(k)), now=500.0 + 0.1 * k)


def test_a_curve_has_the_vehicle_s_own_times(history):
    fly(history, 2000)
    found = history.curve("LOCAL_POSITION_NED.x * 2")
    assert found.times == pytest.approx(0.1 * np.arange(2000))
    assert found.values == pytest.approx(2.0 * np.arange(2000))
    assert (history.begin, history.now) == (0.0, pytest.approx(199.9))
    assert history.curve("LOCAL_POSITION_NED.z").unit == "m"


def test_messages_without_a_time_stand_at_that_of_the_newest_with_one(history):
    fly(history, 10)
    take(history, mavlink.MAVLink_vfr_hud_message(7.0, 0, 0, 0, 0, 0), now=500.95)
    assert history.curve("VFR_HUD.airspeed").times == pytest.approx([0.95])


def test_late_messages_stand_where_they_were_made(history):
    take(history, position(1000, 1.0), position(3000, 3.0), position(2000, 2.0))
    assert history.curve("LOCAL_POSITION_NED.x").values.tolist() == [1.0, 2.0, 3.0]


def test_what_is_too_old_goes(history, monkeypatch):
    monkeypatch.setattr(field_history, "KEPT_TIME", 20.0)
    fly(history, 2000)
    times = history.curve("LOCAL_POSITION_NED.x").times
    assert 20.0 <= times[-1] - times[0] < 20.0 + 0.1 * field_history.SETTLED_AT


def test_a_restart_begins_anew_and_a_late_message_does_not(history):
    fly(history, 100, begin=50.0)
    take(history, position(10_000, 1.0))
    assert len(history.curve("LOCAL_POSITION_NED.x").times) == 101
    fly(history, 10, begin=0.0)
    assert history.curve("LOCAL_POSITION_NED.x").times[-1] == pytest.approx(0.9)


def test_only_the_vehicle_that_is_followed_is_kept(history):
    take(history, position(1000, 1.0), codec=OTHER_VEHICLE)
    with pytest.raises(FileError, match="the vehicle has no LOCAL_POSITION_NED"):
        history.curve("LOCAL_POSITION_NED.x")
    history.follow((7, 1))
    take(history, position(1000, 1.0), codec=OTHER_VEHICLE)
    assert history.curve("LOCAL_POSITION_NED.x").values.tolist() == [1.0]


def test_an_expression_that_names_nothing_known_says_what_there_is(history):
    fly(history, 3)
    with pytest.raises(FileError, match="LOCAL_POSITION_NED has no field q; it has time_boot_ms, x"):
        history.curve("LOCAL_POSITION_NED.q")
    with pytest.raises(FileError, match="did you mean LOCAL_POSITION_NED"):
        history.curve("LOCAL_POSITION.x")


def test_jumps_of_the_law_and_modes_are_marks(history):
    take(history, heartbeat(), position(1000, 0.0))
    take(history, jump(1, 5.0), heartbeat())
    take(history, heartbeat(mode=custom_mode(Mode.MISSION)), position(2000, 0.0))
    assert [(mark.time, mark.text) for mark in history.marks] == [(1.0, "hover linear"), (1.0, "MISSION")]
