"""A whole flight by a plain pymavlink script. Needs ``pip install pymavlink`` and a running ``darko-sitl``.

By hand::

    darko-sitl --speed 5 &
    python scripts/clients/pymavlink_session.py

It uses pymavlink's own dialect, which lacks DarkO's messages, and the calls that its examples use. Every step
prints a line; the first that fails ends the session with exit code 1 (5 when nothing is heard).
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

os.environ["MAVLINK20"] = "1"  # pymavlink reads it on import; without it frames are those of version 1

from pymavlink import mavutil, mavwp

mav = mavutil.mavlink

FLIGHT_TIMEOUT = 60.0  # for anything that is flown [s]
ANSWER_TIMEOUT = 10.0  # [s]
NO_VEHICLE = 5  # exit code
METRE = 1.0 / 111195.08  # of latitude [deg]


class SessionError(Exception):
    """The vehicle did not do what was asked."""


class Pilot:
    """One connection, and the steps of the session."""

    def __init__(self, url: str) -> None:
        self.link: Any = mavutil.mavlink_connection(url)
        self.home: Any = None

    def hear(
        self, kind: str, holds: Callable[[Any], bool] = lambda _message: True, timeout: float = FLIGHT_TIMEOUT
    ) -> Any:  # noqa: ANN401
        """The next message of a kind for which something holds.

        Raises:
            SessionError: If it does not come in time.
        """
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            message = self.link.recv_match(type=kind, blocking=True, timeout=0.5)
            if message is not None and holds(message):
                return message
        raise SessionError(f"no {kind} as expected within {timeout:g} s")

    def command(self, command: int, *params: float) -> int:
        """Send COMMAND_LONG; the MAV_RESULT."""
        padded = (*params, *(0.0,) * (7 - len(params)))
        self.link.mav.command_long_send(self.link.target_system, self.link.target_component, command, 0, *padded)
        return int(self.hear("COMMAND_ACK", lambda ack: ack.command == command, ANSWER_TIMEOUT).result)

    # The steps

    def connect(self) -> str:
        """HEARTBEAT identifies the vehicle; home comes on request."""
        heartbeat = self.link.wait_heartbeat(timeout=ANSWER_TIMEOUT)
        if heartbeat is None:
            raise ConnectionError
        _ensure(heartbeat.autopilot == mav.MAV_AUTOPILOT_PX4, "not a PX4 by its heartbeat")
        _ensure("MISSION" in self.link.mode_mapping(), "no mode is called MISSION")
        _ensure(self.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_HOME_POSITION) == 0, "no home")
        self.home = self.hear("HOME_POSITION", timeout=ANSWER_TIMEOUT)
        return f"system {self.link.target_system}, home {self.home.latitude / 1e7:.4f}, {self.home.longitude / 1e7:.4f}"

    def parameters(self) -> str:
        """The whole table, then one changed and read back."""
        self.link.param_fetch_all()
        first = self.hear("PARAM_VALUE", timeout=ANSWER_TIMEOUT)
        names = {first.param_id}
        while len(names) < first.param_count:
            names.add(self.hear("PARAM_VALUE", timeout=ANSWER_TIMEOUT).param_id)
        self.link.param_set_send("MIS_TAKEOFF_ALT", 4.0, mav.MAV_PARAM_TYPE_REAL32)
        answer = self.hear("PARAM_VALUE", lambda p: p.param_id == "MIS_TAKEOFF_ALT", ANSWER_TIMEOUT)
        _ensure(answer.param_value == 4.0, "MIS_TAKEOFF_ALT is not what was set")
        return f"{len(names)} parameters"

    def rates(self) -> str:
        """A message at a chosen rate, and one that the vehicle does not have."""
        asked = (mav.MAVLINK_MSG_ID_ATTITUDE, 20000.0)
        _ensure(self.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, *asked) == mav.MAV_RESULT_ACCEPTED, "no interval")
        known = self.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_VIDEO_STREAM_INFORMATION)
        _ensure(known == mav.MAV_RESULT_UNSUPPORTED, "the vehicle claims to stream videos")
        times = [self.hear("ATTITUDE", timeout=ANSWER_TIMEOUT).time_boot_ms for _ in range(30)]
        return f"ATTITUDE every {(times[-1] - times[9]) / 20.0:.0f} ms"  # the first ones may be of the old rate

    def mission(self) -> str:
        """Upload a plan with the float items of old scripts, and download it."""
        plan, lat, lon = mavwp.MAVWPLoader(), self.home.latitude / 1e7, self.home.longitude / 1e7
        plan.add(self._item(mav.MAV_CMD_NAV_TAKEOFF, lat, lon, 6.0))
        plan.add(self._item(mav.MAV_CMD_NAV_WAYPOINT, lat + 12.0 * METRE, lon, 6.0))
        plan.add(self._item(mav.MAV_CMD_NAV_WAYPOINT, lat + 12.0 * METRE, lon + 12.0 * METRE, 8.0))
        self.link.waypoint_clear_all_send()
        self.hear("MISSION_ACK", timeout=ANSWER_TIMEOUT)
        self.link.waypoint_count_send(plan.count())
        while True:
            message = self.hear(["MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK"], timeout=ANSWER_TIMEOUT)  # type: ignore[arg-type]
            if message.get_type() == "MISSION_ACK":
                break
            self.link.mav.send(plan.wp(message.seq))
        _ensure(message.type == mav.MAV_MISSION_ACCEPTED, f"plan refused: {message.type}")
        self.link.waypoint_request_list_send()
        count = self.hear("MISSION_COUNT", timeout=ANSWER_TIMEOUT).count
        for seq in range(count):
            self.link.mav.mission_request_int_send(self.link.target_system, self.link.target_component, seq)
            item = self.hear("MISSION_ITEM_INT", partial(_is, seq), ANSWER_TIMEOUT)
            _ensure(abs(item.x / 1e7 - plan.wp(seq).x) < 2e-6, f"item {seq} came back elsewhere")
        self.link.mav.mission_ack_send(self.link.target_system, self.link.target_component, mav.MAV_MISSION_ACCEPTED)
        return f"{count} items uploaded and downloaded"

    def fly(self) -> str:
        """Arm once the vehicle is ready, fly the mission, and see every item reached."""
        ready = mav.MAV_SYS_STATUS_PREARM_CHECK
        self.hear("SYS_STATUS", lambda status: status.onboard_control_sensors_health & ready)
        self.link.arducopter_arm()
        self.link.motors_armed_wait()
        self.link.set_mode_px4("MISSION", None, None)
        for seq in range(3):
            self.hear("MISSION_ITEM_REACHED", partial(_is, seq))
        self.hear("HEARTBEAT", lambda _beat: self.link.flightmode == "LOITER")
        lyapunov = self.hear("NAMED_VALUE_FLOAT", lambda value: value.name == "V")
        return f"3 items flown, V = {lyapunov.value:.2g}"

    def set_points(self) -> str:
        """OFFBOARD: a position, streamed at 10 Hz of this computer's clock."""
        target, mask = (5.0, 3.0, -7.0), 0b1101_1111_1000
        end, asked = time.monotonic() + FLIGHT_TIMEOUT, False
        while time.monotonic() < end:
            self.link.mav.set_position_target_local_ned_send(
                0, self.link.target_system, self.link.target_component, mav.MAV_FRAME_LOCAL_NED, mask,
                *target, 0, 0, 0, 0, 0, 0, 0, 0,
            )  # fmt: skip
            if not asked:
                self.link.set_mode_px4("OFFBOARD", None, None)
                asked = True
            here = self.link.recv_match(type="LOCAL_POSITION_NED", blocking=True, timeout=0.1)
            if here is not None and math.dist((here.x, here.y, here.z), target) < 0.3:
                return f"at {here.x:.1f}, {here.y:.1f}, {here.z:.1f} m"
        raise SessionError("the set-point was not reached")

    def land(self) -> str:
        """Land by command; the vehicle disarms by itself."""
        _ensure(self.command(mav.MAV_CMD_NAV_LAND) == mav.MAV_RESULT_ACCEPTED, "landing refused")
        self.hear("EXTENDED_SYS_STATE", lambda state: state.landed_state == mav.MAV_LANDED_STATE_ON_GROUND)
        self.link.motors_disarmed_wait()
        return "landed, disarmed"

    def _item(self, command: int, lat: float, lon: float, height: float) -> Any:  # noqa: ANN401
        frame = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT
        return mav.MAVLink_mission_item_message(
            self.link.target_system, self.link.target_component, 0, frame, command, 0, 1, 0, 0, 0, math.nan,
            lat, lon, height,
        )  # fmt: skip


STEPS = (Pilot.connect, Pilot.parameters, Pilot.rates, Pilot.mission, Pilot.fly, Pilot.set_points, Pilot.land)


def main(argv: list[str] | None = None) -> int:
    """Fly the session; the exit code."""
    made = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("--url", default="udpin:127.0.0.1:14550", help="address that the vehicle sends to [%(default)s]")
    args = made.parse_args(argv)
    pilot = Pilot(args.url)
    for step in STEPS:
        try:
            print(f"ok {step.__name__}: {step(pilot)}", flush=True)
        except ConnectionError:
            print(f"no vehicle is heard at {args.url}", file=sys.stderr)
            return NO_VEHICLE
        except SessionError as error:
            print(f"FAILED {step.__name__}: {error}", file=sys.stderr)
            return 1
    pilot.link.close()
    return 0


def _is(seq: int, message: Any) -> bool:  # noqa: ANN401 - pymavlink is untyped
    return bool(message.seq == seq)


def _ensure(holds: bool, what: str) -> None:
    if not holds:
        raise SessionError(what)


if __name__ == "__main__":
    sys.exit(main())
