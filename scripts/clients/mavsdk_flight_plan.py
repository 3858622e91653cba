"""MAVSDK's view of a vehicle that flies a Paparazzi flight plan: its present leg, as a mission.

The plan has to be on the vehicle already, disarmed on the ground: block 0 takes off, block 1 is a leg of two ends, and
the last one circles.
"""

from __future__ import annotations

import json
from typing import Any

from mavsdk.plugins.mavlink_direct import MavlinkDirect, MavlinkMessage
from mavsdk.plugins.mission_raw import MissionRawError
from mavsdk.plugins.telemetry import FlightMode, LandedState
from mavsdk_plans import raw_plan
from mavsdk_watch import SessionError

__all__ = ["flight_plan"]

DO_SET_MODE, JUMP_TO_BLOCK = 176, 53010
CUSTOM, MAIN_MODE, FLIGHT_PLAN = 1.0, 4.0, 11.0  # PX4's AUTO, EXTERNAL1
WAYPOINT, LOITER = 16, 17
LEG, CIRCLE = 1.0, 2.0  # blocks
ANY_PLAN = None  # NaN in MAVSDK's JSON


def flight_plan(session: Any) -> None:  # noqa: ANN401 - a Session of mavsdk_session.py
    """Fly a flight plan: its leg and its circle are seen as missions that cannot be changed; then our own is back."""
    direct = MavlinkDirect(session.system)
    session.raw.subscribe_mission_progress(lambda progress, _data: session.watch.hear("current", progress.current))
    own = [item.command for item in session.raw.download_mission()]
    _command(direct, DO_SET_MODE, CUSTOM, MAIN_MODE, FLIGHT_PLAN)
    session.watch.until_is("landed_state", LandedState.IN_AIR)
    _command(direct, JUMP_TO_BLOCK, LEG, ANY_PLAN)
    session.watch.until_is("current", 1)
    leg = session.raw.download_mission()
    if [(item.command, item.current) for item in leg] != [(WAYPOINT, 0), (WAYPOINT, 1)]:
        raise SessionError(f"expected: a leg of two ends, not {leg}")
    home = session.watch.newest["home"]
    try:
        session.raw.upload_mission(raw_plan(home.latitude_deg, home.longitude_deg))
    except MissionRawError as error:
        refusal = error.result.name
    else:
        raise SessionError("expected: the present leg cannot be replaced")
    _command(direct, JUMP_TO_BLOCK, CIRCLE, ANY_PLAN)
    session.watch.until_is("current", 0)
    (circle,) = session.raw.download_mission()
    session.action.hold()
    session.watch.until_is("flight_mode", FlightMode.HOLD)
    if [item.command for item in session.raw.download_mission()] != own:
        raise SessionError("expected: our own mission is back")
    session.action.land()
    session.watch.until_is("landed_state", LandedState.ON_GROUND)
    session.watch.until_is("armed", value=False)
    name = "circle" if circle.command == LOITER else f"item {circle.command}"
    session.say(f"a leg of {len(leg)} ends, a {name} of {circle.param3:g} m; upload: {refusal}; own mission back")


def _command(direct: MavlinkDirect, command: int, *parameters: float | None) -> None:
    values = [*parameters, *[0.0] * (7 - len(parameters))]
    fields: dict[str, Any] = {f"param{number}": value for number, value in enumerate(values, 1)}
    fields |= {"target_system": 1, "target_component": 1, "command": command, "confirmation": 0}
    direct.send_message(MavlinkMessage("COMMAND_LONG", 0, 0, 1, 1, json.dumps(fields)))
