"""The end of a flight to a point, told in the log."""

import pytest

from darko_gcs.state.arrivals import accepted_point, arrived, asked_point
from protocol.dialect import mavlink
from tests.support.gcs.snapshots import HOVERING, snapshot_with

POINT = (10.0, -5.0, -4.0)
GO_TO = mavlink.MAV_CMD_DO_REPOSITION


def placed(s, from_home, v=(0.0, 0.0, 0.0)):
    p = tuple(a + b for a, b in zip(from_home, s.position.home_p, strict=True))
    return snapshot_with(s, position={"p": p, "v": v}, status={"mode": "HOLD"})


def lines(s):
    return [line.text for line in s.log.lines if "arrived" in line.text]


SENT = accepted_point(asked_point(HOVERING, POINT), GO_TO)


def test_an_arrival_is_told_once_when_the_vehicle_hovers_there():
    on_the_way = arrived(placed(SENT, (5.0, -5.0, -4.0)), 1.0)
    passing = arrived(placed(on_the_way, POINT, (2.0, 0.0, 0.0)), 2.0)
    assert lines(passing) == []
    there = arrived(placed(passing, (10.3, -5.0, -4.2)), 3.0)
    assert lines(there) == ["Go to: arrived at 10.0 m north, -5.0 m east of home, 4.0 m above it"]
    assert lines(arrived(there, 4.0)) == lines(there)


def test_a_point_that_was_not_accepted_or_is_not_flown_to_any_more_is_not_told():
    assert lines(arrived(placed(asked_point(HOVERING, POINT), POINT), 1.0)) == []
    assert lines(arrived(placed(asked_point(SENT, (0.0, 0.0, -9.0)), POINT), 1.0)) == []
    landing = accepted_point(SENT, mavlink.MAV_CMD_NAV_LAND)
    assert lines(arrived(placed(landing, POINT), 1.0)) == []
    by_hand = snapshot_with(placed(SENT, POINT), status={"mode": "POSCTL"})
    assert lines(arrived(by_hand, 1.0)) == []


@pytest.mark.parametrize("command", [mavlink.MAV_CMD_DO_CHANGE_SPEED, mavlink.MAV_CMD_REQUEST_MESSAGE])
def test_another_speed_is_no_other_flight(command):
    assert len(lines(arrived(placed(accepted_point(SENT, command), POINT), 1.0))) == 1
