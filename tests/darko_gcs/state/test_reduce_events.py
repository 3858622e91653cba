"""Events of the ground station's side of the link, folded into the snapshot."""

from darko_gcs.state.reduce import reduce
from darko_gcs.state.reduce_events import reduce_event
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from protocol.dialect import mavlink
from protocol.events import CommandDone, MissionFailed, ParametersComplete, VehicleLost, VehicleReturned
from tests.support.gcs.messages import arrived, heartbeat

HEARD = reduce(EMPTY_SNAPSHOT, arrived(heartbeat()), 1.0)


def test_answers_are_shown_in_words():
    refused = CommandDone(
        request=1,
        command=mavlink.MAV_CMD_NAV_TAKEOFF,
        result=mavlink.MAV_RESULT_TEMPORARILY_REJECTED,
        reason="TEMPORARILY_REJECTED",
    )
    s = reduce_event(EMPTY_SNAPSHOT, refused, 2.0)
    assert s.messages[-1].text == "take off: temporarily rejected"
    s = reduce_event(s, MissionFailed("upload", None, "no answer"), 3.0)
    assert s.messages[-1].text == "Mission upload failed: no answer"


def test_loss_and_return_of_the_vehicle_are_shown():
    s = reduce_event(HEARD, VehicleLost(3.0), 4.0)
    assert s.lost
    assert not reduce_event(s, VehicleReturned(5.0), 9.0).lost
    assert not reduce(s, arrived(heartbeat()), 9.0).lost


def test_an_event_without_a_handler_changes_nothing():
    assert reduce_event(HEARD, ParametersComplete(3), 2.0) is HEARD
