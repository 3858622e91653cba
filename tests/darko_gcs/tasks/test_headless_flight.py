"""A scripted flight waits for its own vehicle process to compile, but not for ever."""

import argparse
import asyncio
import sys

import pytest

from darko_gcs.errors import FlightError, LinkError
from darko_gcs.feed import sitl_process
from darko_gcs.state.values import LogLine
from darko_gcs.tasks import headless_flight
from protocol.dialect import mavlink
from protocol.plans import MissionItem, Plan, load
from tests.support.gcs.plan_holder import PlanHolder
from tests.support.gcs.snapshots import HOVERING, snapshot_with
from tests.support.paths import DATA

COMPILING = "print('darko-sitl: compiling', file=sys.stderr, flush=True); "
READY = "print('darko-sitl: ready after 0.1 s: on 127.0.0.1:1, sends to 2', file=sys.stderr, flush=True); "


@pytest.fixture
def fly(tmp_path, monkeypatch):
    """Fly with a vehicle process that runs one line of Python; returns the error of the flight."""

    def flown(program, **timeouts):
        script = tmp_path / "darko-sitl"
        script.write_text(f"#!{sys.executable}\nimport sys, time; {program}\n")
        script.chmod(0o755)
        monkeypatch.setattr(sitl_process, "SITL_PROGRAM", (str(script),))
        for name, seconds in timeouts.items():
            monkeypatch.setattr(headless_flight, name, seconds)
        args = argparse.Namespace(
            mission=DATA / "square.plan", signing_key=None, give_key=False, record=tmp_path / "flight.tlog",
            vehicle=None, id=255, host="127.0.0.1", port=0, sitl=True, api_port=0, state_dir=None, timeout=60.0,
            verify=True,
        )  # fmt: skip
        with pytest.raises(LinkError) as caught:
            asyncio.run(headless_flight.fly_headless(args, []))
        return str(caught.value)

    return flown


def test_a_vehicle_may_compile_longer_than_a_running_one_is_waited_for(fly, capsys):
    error = fly(COMPILING + "time.sleep(1.5); sys.exit(7)", HEARD_TIMEOUT=0.2)
    assert error == "darko-sitl ended with exit code 7"
    assert "compiling" in capsys.readouterr().err


def test_a_vehicle_that_is_ready_must_be_heard_soon(fly):
    assert fly(COMPILING + READY + "time.sleep(60)", HEARD_TIMEOUT=0.2) == "no vehicle heard for 0.2 s"


def test_a_vehicle_that_is_never_ready_is_given_up(fly):
    assert fly(COMPILING + "time.sleep(60)", READY_TIMEOUT=0.5) == "no vehicle heard for 0.5 s"


@pytest.mark.parametrize("verify", [True, False])
def test_a_mission_that_the_vehicle_changed_is_not_flown(verify, capsys, monkeypatch):
    monkeypatch.setattr("darko_gcs.scripting.vehicle.ANSWER_TIMEOUT", 3.0)  # nobody answers the start
    items = tuple(load(DATA / "square.plan").items)
    result = headless_flight.FlightResult(mission="x", log=None, items=len(items))
    pilot = headless_flight.Pilot(PlanHolder(lambda sent: sent[:-1]), None, result, 60.0)
    expected = ": - 5  Land" if verify else "mission start: no answer for 3 s"
    with pytest.raises(FlightError, match=expected):
        asyncio.run(pilot.fly(Plan(items=items), verify=verify))
    assert "items uploaded" in capsys.readouterr().err
    assert not result.verified


def test_a_vehicle_that_cannot_arm_is_said_to_be_not_ready_with_its_own_reason(monkeypatch):
    monkeypatch.setattr(headless_flight, "ANSWER_TIMEOUT", 3.0)
    items = tuple(load(DATA / "square.plan").items)
    vehicle = PlanHolder()
    warning = LogLine(0.0, mavlink.MAV_SEVERITY_WARNING, "Pre-arm: no position")
    vehicle.snapshot = snapshot_with(HOVERING, status={"prearm_ok": False}, log={"lines": (warning,)})
    pilot = headless_flight.Pilot(vehicle, None, headless_flight.FlightResult(mission="x", log=None, items=6), 60.0)
    with pytest.raises(FlightError, match=r"after 3 s: waited for ready to arm \(.*: Pre-arm: no position\)"):
        asyncio.run(pilot.fly(Plan(items=items), verify=False))


@pytest.mark.parametrize(
    ("frame", "x", "y", "z"), [(mavlink.MAV_FRAME_LOCAL_NED, 40, 30, -5.0), (mavlink.MAV_FRAME_LOCAL_ENU, 30, 40, 5.0)]
)
def test_the_distance_to_a_waypoint_is_measured_in_its_own_frame(frame, x, y, z):
    command, none = mavlink.MAV_CMD_NAV_WAYPOINT, (0.0,) * 4
    item = MissionItem(command=command, frame=frame, params=none, x=x * 10_000, y=y * 10_000, z=z)
    assert headless_flight._local_place(item, HOVERING) == pytest.approx((40.0, 30.0, -5.0), abs=1e-3)


def test_a_mission_that_pauses_after_an_item_is_continued_once(capsys):
    vehicle, starts = PlanHolder(), []
    vehicle.start_mission = starts.append
    pilot = headless_flight.Pilot(vehicle, None, headless_flight.FlightResult(mission="x", log=None, items=6), 60.0)
    active, paused = mavlink.MISSION_STATE_ACTIVE, mavlink.MISSION_STATE_PAUSED
    lines = tuple(LogLine(t, mavlink.MAV_SEVERITY_NOTICE, f"Mission paused after item {t:g}: x") for t in (1.0, 3.0))
    for state, said, begun in (
        (paused, (), 0),  # somebody else holds the vehicle
        (active, lines[:1], 0),
        (paused, lines[:1], 1),
        (paused, lines[:1], 1),
        (paused, lines, 2),
    ):
        pilot._continue_paused(snapshot_with(HOVERING, mission={"state": state}, log={"lines": said}))
        assert len(starts) == begun
    assert "mission paused after item 3: going on" in capsys.readouterr().err
