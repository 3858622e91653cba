"""The top line."""

import pytest

from darko_gcs.state.reduce import reduce
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from darko_gcs.state.values import SigningState, Simulator
from darko_gcs.tui.widgets.status_bar import StatusBar
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.events import CommandProgress
from tests.support.gcs.messages import arrived
from tests.support.gcs.planned_snapshots import planned
from tests.support.gcs.screens import line_text, panel_text
from tests.support.gcs.snapshots import snapshot_with
from tests.support.vehicle.darko_messages import hybrid_state

HEARD = snapshot_with(EMPTY_SNAPSHOT, identity={"source": (1, 1)}, link={"heartbeat_at": 0.0})


def shown(s, width=120):
    return panel_text(StatusBar(), s, width=width, height=1)


@pytest.mark.parametrize(
    ("simulator", "words"),
    [
        (Simulator.NONE, "waiting for a vehicle"),
        (Simulator.STARTING, "starting darko-sitl"),
        (Simulator.ENDED, "darko-sitl has ended  Ctrl+R"),
    ],
)
def test_before_a_vehicle_is_heard_it_says_what_is_waited_for(simulator, words):
    assert words in shown(snapshot_with(EMPTY_SNAPSHOT, session={"simulator": simulator}))


def test_a_dead_simulator_is_named_beside_the_lost_link_on_the_smallest_screen():
    s = snapshot_with(HEARD, link={"lost": True}, session={"simulator": Simulator.ENDED}, status={"mode": "MISSION"})
    assert "Ctrl+R restarts darko-sitl" in panel_text(StatusBar(), s, width=80, height=1)


def test_the_battery_of_another_autopilot_is_shown():
    told = mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 11_100, -1, 64, 0, 0, 0, 0, 0, 0)
    s = reduce(HEARD, arrived(told), 1.0)
    assert "battery 64 %" in shown(s)
    unknown = mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 11_100, -1, -1, 0, 0, 0, 0, 0, 0)
    assert "battery 11.1 V" in shown(reduce(s, arrived(unknown), 2.0))


def test_a_critical_vehicle_is_shown_in_failsafe():
    assert "FAILSAFE" in shown(snapshot_with(HEARD, status={"critical": True}))
    assert "FAILSAFE" not in shown(HEARD)


def test_a_crash_is_shown_in_words_and_not_as_a_failsafe():
    crashed = reduce(snapshot_with(HEARD, status={"critical": True}), arrived(hybrid_state(100, Law.CRASHED)), 1.0)
    text = shown(snapshot_with(crashed, status={"armed": False, "prearm_ok": False}))
    assert "CRASHED" in text
    assert "Ctrl+R to reset" in text
    assert "FAILSAFE" not in text
    assert "CRASHED" not in shown(reduce(HEARD, arrived(hybrid_state(100, Law.LANDED)), 1.0))
    assert "to reset" not in shown(snapshot_with(crashed, session={"is_replay": True}))


def test_where_there_is_no_room_the_mission_stays_rather_than_a_link_that_is_good():
    mission = {"total": 3, "current": 1, "state": mavlink.MISSION_STATE_ACTIVE}
    s = snapshot_with(HEARD, status={"armed": True, "mode": "MISSION"}, mission=mission, link={"rate": 177.0})
    width = len(shown(s, width=99).rstrip()) - len(" vehicle 1 ") - len(" loss 0.0 % ") - 1
    assert "mission 1/2" in shown(s, width=width)
    assert "177/s" not in shown(s, width=width)
    assert "loss 9.0 %" in shown(snapshot_with(s, link={"loss": 0.09}), width=width)


def test_of_several_vehicles_the_one_that_is_shown_is_always_named():
    full = snapshot_with(HEARD, status={"armed": False}, link={"rate": 152.0})
    narrow = len(shown(full, width=200).strip()) - 3
    assert "vehicle 1" not in shown(full, width=narrow)
    assert "vehicle 1" in shown(snapshot_with(full, session={"vehicles": 2}), width=narrow)
    lost = snapshot_with(full, session={"vehicles": 2}, link={"lost": True})
    assert "vehicle 1" in shown(lost)


@pytest.mark.parametrize(
    ("state", "refused", "words"),
    [
        (SigningState.SIGNED, 0, "signed"),
        (SigningState.SIGNED, 7, "signed 7 refused"),
        (SigningState.OPEN, 0, "UNSIGNED"),
        (SigningState.NO_KEY, 0, "vehicle signs, no key here"),
    ],
)
def test_the_state_of_signing_is_shown(state, refused, words):
    assert words in shown(snapshot_with(HEARD, link={"signing": state, "refused": refused}))


def test_a_vehicle_that_does_not_use_our_key_is_shown():
    assert "VEHICLE NOT SIGNED" in shown(snapshot_with(EMPTY_SNAPSHOT, link={"signing": SigningState.UNSIGNED_VEHICLE}))


@pytest.mark.parametrize(("width", "between"), [(80, "/"), (120, ", stage ")])
def test_a_flight_plan_is_told_by_block_and_stage_and_not_as_a_mission(width, between):
    leg = {"total": 2, "current": 1, "state": mavlink.MISSION_STATE_ACTIVE}
    flown = snapshot_with(planned()[1], mission=leg)
    plan = flown.flight_plan
    text = panel_text(StatusBar(), flown, width=width, height=1)
    assert f" {plan.block_name(plan.block)}{between}{plan.stage} " in text
    assert "mission" not in text
    assert "mission at item 1, last 1" in shown(snapshot_with(planned("MISSION")[1], mission=leg))
    assert "mission" not in shown(flown._replace(flight_plan=None))


def test_a_vehicle_that_does_not_tell_whether_it_flies_leaves_no_gap():
    assert " QLOITER  battery -- " in shown(snapshot_with(HEARD, status={"mode": "QLOITER", "armed": True}))


HOLDING = snapshot_with(
    HEARD,
    status={"mode": "HOLD", "landed_state": mavlink.MAV_LANDED_STATE_IN_AIR, "vtol_state": mavlink.MAV_VTOL_STATE_MC},
    position={"p": (0.0, 0.0, -3.0), "v": (0.0, 0.0, 0.0)},
    guidance={"target": (30.0, 40.0, -3.0)},
)


def test_on_the_way_to_a_point_it_tells_how_far_it_has_to_go():
    assert "HOLD, 50 m to go" in shown(HOLDING)
    assert "to go" not in shown(snapshot_with(HOLDING, guidance={"target": (0.5, 0.0, -3.0)}))
    assert "to go" not in shown(snapshot_with(HOLDING, status={"mode": "MISSION"}))
    forward = snapshot_with(HOLDING, status={"vtol_state": mavlink.MAV_VTOL_STATE_FW})
    assert "HOLD, 50 m to go" in shown(snapshot_with(forward, position={"v": (8.0, 11.0, 0.0)}))
    assert "to go" not in shown(snapshot_with(forward, position={"v": (11.0, -8.0, 0.0)}))  # it circles the target


def test_a_transition_under_way_is_no_way_to_a_point():
    command = CommandProgress(1, mavlink.MAV_CMD_DO_VTOL_TRANSITION, 20)
    assert "to go" not in shown(snapshot_with(HOLDING, operator={"in_progress": command}))


@pytest.mark.parametrize(
    ("state", "current", "words"),
    [
        (mavlink.MISSION_STATE_NOT_STARTED, 0, "mission ready, 4 items"),
        (mavlink.MISSION_STATE_NOT_STARTED, 2, "mission ready from item 2"),
        (mavlink.MISSION_STATE_ACTIVE, 2, "mission at item 2, last 3"),
        (mavlink.MISSION_STATE_COMPLETE, 3, "mission done"),
    ],
)
def test_the_mission_is_told_in_words_that_are_no_count_before_it_begins(state, current, words):
    assert words in shown(snapshot_with(HEARD, mission={"state": state, "current": current, "total": 4}))


def test_a_starting_simulator_shows_a_sign_that_moves_and_for_how_long():
    bar = StatusBar()
    bar.set_reactive(StatusBar.now, 100.0)
    starting = snapshot_with(EMPTY_SNAPSHOT, session={"simulator": Simulator.STARTING, "simulator_since": 100.0})
    first = line_text(bar.draw(starting, 80, 1)[0])
    bar.set_reactive(StatusBar.now, 123.25)
    later = line_text(bar.draw(starting, 80, 1)[0])
    assert "starting darko-sitl, 23 s" in later
    assert first[:3] != later[:3]
    other_screen = StatusBar()
    other_screen.set_reactive(StatusBar.now, 123.25)
    assert line_text(other_screen.draw(starting, 80, 1)[0]) == later


def test_a_simulation_that_is_not_in_real_time_says_so():
    assert "simulated" not in shown(HEARD)
    assert "simulated 5x" in shown(snapshot_with(HEARD, session={"simulation_speed": 5.0}))


@pytest.mark.parametrize(
    ("port", "hint"),
    [(14550, "darko-sitl, or use --sitl"), (14661, "darko-sitl --gcs-port 14661"), (0, "nothing has answered")],
)
def test_the_hint_starts_a_vehicle_that_finds_this_station(port, hint):
    waiting = snapshot_with(EMPTY_SNAPSHOT, session={"port": port})
    assert hint in panel_text(StatusBar(), waiting, 80, 1)
