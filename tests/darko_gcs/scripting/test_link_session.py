"""Words for missing conditions."""

from darko_gcs.scripting.link_session import last_seen, late_error, report, unknown_time, why_not_ready, words_since
from darko_gcs.state.message_log import add_line
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from protocol.frames import Geodetic
from tests.support.gcs.snapshots import snapshot_with

HEARD = snapshot_with(EMPTY_SNAPSHOT, identity={"source": (1, 1)}, status={"mode": "HOLD", "armed": False})
HOME = Geodetic(43.5, 1.5, 150.0)


def test_what_keeps_a_vehicle_from_arming_is_named():
    assert why_not_ready(HEARD) == (
        "ready to arm (home is not known; the vehicle has not told whether it can be armed)"
    )
    failing = add_line(
        snapshot_with(HEARD, position={"home": HOME}, status={"prearm_ok": False}), 1.0, 4, "Satellites: no fix"
    )
    assert why_not_ready(failing) == "ready to arm (its checks before arming fail: Satellites: no fix)"
    assert why_not_ready(snapshot_with(HEARD, position={"home": HOME}, status={"prearm_ok": True})) == "ready to arm"


def test_a_vehicle_that_sends_heartbeats_alone_is_heard_but_has_no_time():
    assert unknown_time(EMPTY_SNAPSHOT) == "a vehicle"
    assert unknown_time(HEARD) == "a message with the vehicle's time: only its heartbeats are heard"


def test_the_last_state_is_told_in_words_and_as_a_table():
    assert last_seen(EMPTY_SNAPSHOT) == "no vehicle heard"
    seen = add_line(snapshot_with(HEARD, link={"lost": True}), 1.0, 6, "Landed")
    assert last_seen(seen) == 'HOLD, disarmed, link lost, "Landed"'
    error = late_error("not done within 3 s", "the motors to stop", seen)
    assert str(error) == f"not done within 3 s: waited for the motors to stop; last seen: {last_seen(seen)}"
    assert error.details == {"waited_for": "the motors to stop", "seen": report(seen)}


def test_the_vehicles_words_are_those_since_the_request_without_the_stations_own():
    s = add_line(HEARD, 1.0, 4, "Battery low")
    s = add_line(s, 5.0, 4, "Mission refused: item 1: command 183 is not supported")
    s = add_line(s, 5.1, 4, "Mission upload failed: unsupported")
    s = add_line(s, 5.2, 6, "for information")
    assert words_since(s, 4.0, "unsupported") == ["Mission refused: item 1: command 183 is not supported"]
