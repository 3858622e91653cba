"""MAVSDK flies the real process through everything its users ask of an autopilot, step by step."""

import re
from dataclasses import replace

import pytest

from protocol.flight_plans.plan_package import pack_plan
from sitl.defaults import HOME
from tests.e2e.support import BRISK, fly, free_ports, need, vehicle
from tests.support.plans import plan_of

BLOCKS = (
    '<block name="Up"><call_once fun="NavResurrect()"/><stay wp="HOME" vmode="climb" climb="1"/></block>'
    '<block name="Leg"><go from="A" wp="B" hmode="route" /><deroute block="Leg"/></block>'
    '<block name="Ring"><circle wp="HOME" radius="-2.5"/></block>'
)
PLAN = replace(plan_of(BLOCKS), lat0=HOME.lat_deg, lon0=HOME.lon_deg)


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    need("mavsdk")
    (port,) = free_ports(1)
    folder = tmp_path_factory.mktemp("mavsdk")
    (folder / "flight_plan.xml").write_bytes(pack_plan(PLAN))
    with vehicle(port, folder, "--speed", "10", *BRISK):
        code, output = fly("mavsdk_session.py", "--url", f"udpin://127.0.0.1:{port}")
    assert code == 0, output
    return {step: line for line, step in re.findall(r"^  (.*)\nok (\w+) at", output, re.MULTILINE)}


@pytest.mark.long
def test_health_parameters_missions_and_logs_answer(session):
    assert "health all ok, armable" in session["health"]
    assert session["parameters"].endswith("NO_SUCH_PARAM: DOES_NOT_EXIST")
    assert session["missions"] == "4 raw items and 5 items up and down"
    assert session["log_files"].endswith(" bytes downloaded")


@pytest.mark.long
def test_every_telemetry_topic_arrives_and_a_fence_comes_back(session):
    assert session["telemetry_topics"] == "altitude, flight, ground_truth, imu, odometry, raw_imu, scaled_imu"
    assert session["fence"] == "a fence of a polygon and a circle up, down and cleared"


@pytest.mark.long
def test_failures_are_injected_once_they_are_allowed(session):
    assert session["failures"].endswith("a magnetometer lost and healed; optical flow: UNSUPPORTED")


@pytest.mark.long
def test_the_vehicle_lifts_off_by_attitudes(session):
    assert session["lift_off"] == "lifted off by attitude and thrust, then hold"


@pytest.mark.long
def test_the_vehicle_takes_off_follows_set_points_and_lands(session):
    assert session["take_off"].endswith("disarm in the air: COMMAND_DENIED")
    assert {"go_to", "set_points", "attitudes", "land"} <= set(session)


def test_the_vehicle_flies_a_mission_with_forward_flight_and_returns(session):
    states = session["fly_mission"].removeprefix("mission flown: ").split()
    assert states[:5] == ["MC", "TRANSITION_TO_FW", "FW", "TRANSITION_TO_MC", "MC"]
    assert {"wings", "come_home"} <= set(session)


@pytest.mark.long
def test_the_vehicle_reboots_healthy_with_its_parameters(session):
    assert session["restart"] == "rebooted, healthy, parameters kept"


def test_the_vehicle_returns_to_a_home_that_was_moved(session):
    assert session["move_home"] == "home moved 15 m north, 1 m up; to the antipodes: COMMAND_DENIED"
    assert float(re.search(r"landed ([\d.]+) m from home", session["come_home"])[1]) < 1.0


def test_the_present_leg_of_a_flight_plan_is_a_mission_that_cannot_be_changed(session):
    assert session["flight_plan"] == "a leg of 2 ends, a circle of -2.5 m; upload: DENIED; own mission back"
