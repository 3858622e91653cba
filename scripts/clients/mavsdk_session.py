"""A whole flight by MAVSDK, as its users write one. Needs ``pip install mavsdk`` and a running ``darko-sitl``.

By hand::

    darko-sitl --speed 5 &
    python scripts/clients/mavsdk_session.py

Every step prints a line; the first that fails ends the session with exit code 1 (5 when nothing is heard).
"""

from __future__ import annotations

import argparse
import math
import queue
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mavsdk import ComponentType, Configuration, Mavsdk, MavsdkError
from mavsdk.plugins.action import Action, ActionError, OrbitYawBehavior
from mavsdk.plugins.failure import Failure, FailureError, FailureType, FailureUnit
from mavsdk.plugins.geofence import Circle, FenceType, Geofence, GeofenceData, Point, Polygon
from mavsdk.plugins.info import Info
from mavsdk.plugins.log_files import Entry, LogFiles, LogFilesError, LogFilesResult
from mavsdk.plugins.mission import Mission, MissionPlan
from mavsdk.plugins.mission_raw import MissionRaw
from mavsdk.plugins.offboard import Attitude, Offboard, PositionNedYaw, VelocityBodyYawspeed, VelocityNedYaw
from mavsdk.plugins.param import Param, ParamError
from mavsdk.plugins.telemetry import FlightMode, LandedState, Telemetry, VtolState
from mavsdk_flight_plan import flight_plan
from mavsdk_plans import METRE, bits, distance, forward_plan, raw_plan
from mavsdk_watch import FLIGHT_TIMEOUT, SessionError, Watch

LOG_TIMEOUT = 60.0  # [s]
LATE_ANSWER = 1.0  # to a command that MAVSDK repeated; it would take it for one to the same command that follows [s]
NO_VEHICLE = 5  # exit code
G = 9.81  # [m/s2]
HOVER_THRUST = 0.505  # share of what both motors give at rest that carries the vehicle


class Session:
    """One client, one vehicle; each method is a step."""

    def __init__(self, system: Any, say: Callable[[str], None]) -> None:  # noqa: ANN401
        self.say = say
        self.action, self.info, self.param = Action(system), Info(system), Param(system)
        self.mission, self.raw, self.offboard = Mission(system), MissionRaw(system), Offboard(system)
        self.logs, self.telemetry, self.geofence = LogFiles(system), Telemetry(system), Geofence(system)
        self.system = system
        self.watch = Watch(self.telemetry)
        self.info.subscribe_flight_information(lambda flight, _data: self.watch.hear("flight", flight.flight_uid))
        self.mission.subscribe_mission_progress(lambda progress, _data: self.watch.hear("progress", progress.current))

    def health(self) -> None:
        """All health checks pass, and the vehicle reports its version."""
        self.watch.until("health_all_ok", lambda now: now["health_all_ok"] and "home" in now, 30.0)
        self.watch.until("armable", lambda _: self.telemetry.health().is_armable, 30.0)
        version = self.info.get_version()
        self.say(f"health all ok, armable; version {version.flight_sw_major}.{version.flight_sw_minor}")

    def parameters(self) -> None:
        """Read all, set and read back one of each type; an unknown name is refused."""
        everything = self.param.get_all_params()
        floats = {p.name: p.value for p in everything.float_params}
        integers = {p.name: p.value for p in everything.int_params}
        _ensure("MIS_TAKEOFF_ALT" in floats and bool(integers), "floats and integers listed")
        for name, value in integers.items():
            _ensure(self.param.get_param_int(name) == value, f"{name} is {value} again")
        before = floats["MIS_TAKEOFF_ALT"]
        self.param.set_param_float("MIS_TAKEOFF_ALT", before + 1.0)
        _ensure(self.action.get_takeoff_altitude() == before + 1.0, "take-off altitude follows")
        self.action.set_takeoff_altitude(before)
        self.action.set_return_to_launch_altitude(10.0)
        _ensure(self.param.get_param_float("RTL_RETURN_ALT") == 10.0, "return altitude follows")
        # Set-points come at 20 Hz of the client's clock and time out on the vehicle's, which may run faster.
        self.param.set_param_float("COM_OF_LOSS_T", 8.0)
        refusal = _refused(ParamError, self.param.get_param_float, "NO_SUCH_PARAM")
        self.say(f"{len(floats)} floats, {len(integers)} integers; set and read back; NO_SUCH_PARAM: {refusal}")

    def missions(self) -> None:
        """Upload and download in both of MAVSDK's forms; every bit comes back."""
        home = self.watch.newest["home"]
        plan = raw_plan(home.latitude_deg, home.longitude_deg)
        self.raw.upload_mission(plan)
        back = self.raw.download_mission()
        _ensure([bits(item) for item in back] == [bits(item) for item in plan], "the plan came back bit for bit")
        _ensure(not self.raw.download_geofence() and not self.raw.download_rallypoints(), "no fence, no rally points")
        self.mission.clear_mission()
        _ensure(not self.raw.download_mission(), "cleared")
        plan = forward_plan(home.latitude_deg, home.longitude_deg)
        self.mission.set_return_to_launch_after_mission(False)
        self.mission.upload_mission(MissionPlan(plan))
        got = self.mission.download_mission().mission_items
        _ensure([i.vehicle_action for i in got] == [i.vehicle_action for i in plan], "the actions came back")
        _ensure(all(math.isclose(a.latitude_deg, b.latitude_deg, abs_tol=1e-7) for a, b in zip(got, plan, strict=True)),
                "the places came back")  # fmt: skip
        self.say(f"{len(back)} raw items and {len(got)} items up and down")

    def telemetry_topics(self) -> None:
        """The less common topics, and rates for some, which are low again afterwards."""
        fast = ("odometry", "imu", "raw_imu", "scaled_imu")
        for topic in fast:
            getattr(self.telemetry, f"set_rate_{topic}")(10.0)
        wanted = {"altitude", "flight", "ground_truth", "imu", "odometry", "raw_imu", "scaled_imu"}
        self.watch.until("receiving all topics", lambda now: wanted <= now.keys(), 10.0)
        here, truth = self.watch.newest["position"], self.watch.newest["ground_truth"]
        _ensure(abs(here.latitude_deg - truth.latitude_deg) < METRE, "position and ground truth agree")
        felt = self.watch.newest["imu"].acceleration_frd
        _ensure(abs(felt.down_m_s2 + G) < 0.2, f"the accelerometer of a vehicle that stands reads {felt}")
        for topic in fast:
            getattr(self.telemetry, f"set_rate_{topic}")(1.0)
        self.say(", ".join(sorted(wanted)))

    def fence(self) -> None:
        """Upload both kinds of fence, download and clear them."""
        home = self.watch.newest["home"]
        lat, lon, away = home.latitude_deg, home.longitude_deg, 400.0 * METRE
        corners = [Point(lat + n * away, lon + e * away) for n, e in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        zone = Circle(Point(lat - 0.5 * away, lon), 20.0, FenceType.EXCLUSION)
        self.geofence.upload_geofence(GeofenceData([Polygon(corners, FenceType.INCLUSION)], [zone]))
        back = self.geofence.download_geofence()
        _ensure([len(polygon.points) for polygon in back.polygons] == [4], "the polygon came back")
        _ensure([circle.radius for circle in back.circles] == [20.0], "the circle came back")
        self.geofence.clear_geofence()
        _ensure(not self.geofence.download_geofence().polygons, "cleared")
        self.say("a fence of a polygon and a circle up, down and cleared")

    def take_off(self) -> None:
        """Arm, climb; disarming in the air is refused."""
        self.action.arm()
        self.watch.until_is("armed", value=True)
        self.action.takeoff()
        self.watch.until("taking off", lambda _: LandedState.TAKING_OFF in self.watch.history["landed_state"])
        self.watch.until_is("landed_state", LandedState.IN_AIR)
        self.watch.until_is("flight_mode", FlightMode.HOLD)
        refusal = _refused(ActionError, self.action.disarm)
        height = self.watch.newest["position"].relative_altitude_m
        self.say(f"took off to {height:.1f} m; disarm in the air: {refusal}")

    def go_to(self) -> None:
        """Fly to a point of the map, change the speed, hold."""
        home = self.watch.newest["home"]
        north = home.latitude_deg + 12.0 * METRE
        self.action.goto_location(north, home.longitude_deg, home.absolute_altitude_m + 8.0, math.nan)
        self._arrive(12.0, 0.0, 8.0)
        self.action.set_current_speed(2.0)
        self.action.hold()
        self.watch.until_is("flight_mode", FlightMode.HOLD)
        self.say("went 12 m north at 8 m, 2 m/s taken, held")

    def set_points(self) -> None:
        """Off-board by position, then by velocity, then back to hold."""
        self.offboard.set_position_ned(PositionNedYaw(8.0, 6.0, -10.0, 0.0))
        self.offboard.start()
        self.watch.until_is("flight_mode", FlightMode.OFFBOARD)
        self._arrive(8.0, 6.0, 10.0)
        self.offboard.set_velocity_ned(VelocityNedYaw(0.0, -1.5, 0.0, 0.0))
        self.watch.until("moving west at 1.5 m/s", lambda now: abs(_velocity(now).east_m_s + 1.5) < 0.2)
        self.watch.until("6 m further", lambda now: _position(now).east_m < 0.0)
        self.offboard.stop()
        self.watch.until_is("flight_mode", FlightMode.HOLD)
        self.say("off-board by position and velocity, then hold")

    def failures(self) -> None:
        """The magnetometer fails and is healed once failures are allowed; what is not there is unsupported.

        The plugin reads whether failures are allowed when it is made.
        """
        refusal = _refused(FailureError, Failure(self.system).inject, FailureUnit.SENSOR_MAG, FailureType.OFF, 0)
        self.param.set_param_int("SYS_FAILURE_EN", 1)
        failure = Failure(self.system)
        failure.inject(FailureUnit.SENSOR_MAG, FailureType.OFF, 0)
        self.watch.until("missing its magnetometer", lambda _: not self._has_magnetometer())
        failure.inject(FailureUnit.SENSOR_MAG, FailureType.OK, 0)
        self.watch.until("healed", lambda _: self._has_magnetometer())
        absent = _refused(FailureError, failure.inject, FailureUnit.SENSOR_OPTICAL_FLOW, FailureType.OFF, 0)
        self.param.set_param_int("SYS_FAILURE_EN", 0)
        self.say(f"failures not allowed: {refusal}; a magnetometer lost and healed; optical flow: {absent}")

    def _has_magnetometer(self) -> bool:
        return bool(self.telemetry.health().is_magnetometer_calibration_ok)

    def lift_off(self) -> None:
        """From the ground by attitude, as MAVSDK's example flies; then back to hold."""
        self.action.arm()
        self.watch.until_is("armed", value=True)
        self.offboard.set_attitude(Attitude(0.0, 0.0, 0.0, 0.0))
        self.offboard.start()
        self.watch.until_is("flight_mode", FlightMode.OFFBOARD)
        self.offboard.set_attitude(Attitude(0.0, 0.0, 0.0, 0.6))
        self.watch.until("5 m high", lambda now: now["position"].relative_altitude_m > 5.0)
        _ensure(self.watch.newest["flight_mode"] == FlightMode.OFFBOARD, "off-board all the time")
        self.offboard.stop()
        self.watch.until_is("flight_mode", FlightMode.HOLD)
        self.say("lifted off by attitude and thrust, then hold")

    def attitudes(self) -> None:
        """Off-board by attitude, level, then ahead and turning, then back to hold."""
        self.offboard.set_attitude(Attitude(0.0, 0.0, 0.0, HOVER_THRUST))
        self.offboard.start()
        self.watch.until_is("flight_mode", FlightMode.OFFBOARD)
        self.watch.until("level and facing north", lambda now: _largest(now["attitude_euler"]) < 2.0, 10.0)
        self.offboard.set_attitude(Attitude(0.0, -10.0, 0.0, 1.02 * HOVER_THRUST))
        self.watch.until("moving north by its tilt", lambda now: _velocity(now).north_m_s > 1.0)
        self.offboard.set_velocity_body(VelocityBodyYawspeed(1.0, 0.0, 0.0, 15.0))
        self.watch.until("moving east, having turned", lambda now: _velocity(now).east_m_s > 0.7)
        _ensure(self.watch.newest["flight_mode"] == FlightMode.OFFBOARD, "off-board all the time")
        self.offboard.stop()
        self.watch.until_is("flight_mode", FlightMode.HOLD)
        self.say("off-board by attitude and by body velocity with a yaw rate, then hold")

    def land(self) -> None:
        """Land here; the motors stop."""
        self.action.land()
        self.watch.until_is("flight_mode", FlightMode.LAND)
        self.watch.until("on the ground", lambda now: now["landed_state"] == LandedState.ON_GROUND)
        self.watch.until_is("armed", value=False)
        self.say("landed, disarmed")

    def fly_mission(self) -> None:
        """Fly the plan with its transitions, with one pause; every item is reported."""
        self.action.arm()
        self.mission.start_mission()
        self.watch.until_is("flight_mode", FlightMode.MISSION)
        self.watch.until("past its first item", lambda now: now["progress"] >= 1)
        self.mission.pause_mission()
        self.watch.until_is("flight_mode", FlightMode.HOLD)
        self.mission.start_mission()
        self.watch.until_is("vtol_state", VtolState.FW)
        self.watch.until_is("vtol_state", VtolState.MC)
        self.watch.until("at the end of the mission", lambda now: now["progress"] == len(self.mission_items()))
        _ensure(self.mission.is_mission_finished(), "MAVSDK calls the mission finished")
        self.say("mission flown: " + " ".join(state.name for state in self.watch.history["vtol_state"]))

    def mission_items(self) -> list[Any]:
        """The plan that is flown."""
        home = self.watch.newest["home"]
        return forward_plan(home.latitude_deg, home.longitude_deg)

    def wings(self) -> None:
        """To forward flight and back by command, then an orbit."""
        self.action.transition_to_fixedwing()
        self.watch.until_is("vtol_state", VtolState.FW)
        self.action.transition_to_multicopter()
        self.watch.until_is("vtol_state", VtolState.MC)
        home = self.watch.newest["home"]
        self.action.do_orbit(
            40.0, 15.0, OrbitYawBehavior.HOLD_FRONT_TANGENT_TO_CIRCLE,
            home.latitude_deg, home.longitude_deg, home.absolute_altitude_m + 12.0,
        )  # fmt: skip
        self.watch.until_is("vtol_state", VtolState.FW)
        self.watch.until("on the circle", lambda now: abs(_range(now) - 40.0) < 6.0)
        self.say("to forward flight, to the hover, an orbit of 40 m about home")

    def move_home(self) -> None:
        """Move home in flight; the other side of the globe is refused."""
        home = self.watch.newest["home"]
        north = home.latitude_deg + 15.0 * METRE
        self.action.set_home(False, north, home.longitude_deg, home.absolute_altitude_m + 1.0)
        self.watch.until("reporting its new home", lambda now: abs(now["home"].latitude_deg - north) < 0.1 * METRE)
        up = self.watch.newest["home"].absolute_altitude_m - home.absolute_altitude_m
        _ensure(abs(up - 1.0) < 0.01, f"home is {up:.2f} m higher")
        time.sleep(LATE_ANSWER)
        refusal = _refused(ActionError, self.action.set_home, False, -north, home.longitude_deg, 0.0)
        self.say(f"home moved 15 m north, 1 m up; to the antipodes: {refusal}")

    def come_home(self) -> None:
        """Return, land and disarm with one command."""
        self.action.return_to_launch()
        self.watch.until_is("flight_mode", FlightMode.RETURN_TO_LAUNCH)
        self.watch.until_is("landed_state", LandedState.ON_GROUND)
        self.watch.until_is("armed", value=False)
        away = distance(self.watch.newest["position"], self.watch.newest["home"])
        _ensure(away < 2.0, f"{away:.1f} m from home")
        self.say(f"returned and landed {away:.2f} m from home, disarmed")

    def log_files(self) -> None:
        """List the vehicle's logs and download the smallest; an empty list is fine."""
        try:
            entries = self.logs.get_entries()
        except LogFilesError as error:
            _ensure(error.result.name == "NO_LOGFILES", f"log list: {error.result.name}")
            entries = []
        if not entries:
            self.say("no logs")
            return
        smallest = min(entries, key=lambda entry: int(entry.size_bytes))
        self.say(f"{len(entries)} logs, one of {self._download(smallest)} bytes downloaded")

    def restart(self) -> None:
        """Reboot on the ground: parameters are kept, and the vehicle is healthy again."""
        self.param.set_param_float("MIS_TAKEOFF_ALT", 3.5)
        self.action.reboot()
        self.watch.until("rebooting", lambda _now: "Rebooting" in self.watch.history["status_text"])
        _ensure(self.param.get_param_float("MIS_TAKEOFF_ALT") == 3.5, "take-off altitude is kept")
        self.watch.until("health_all_ok", lambda now: now["health_all_ok"], 30.0)
        self.say("rebooted, healthy, parameters kept")

    def _download(self, entry: Entry) -> int:
        """Download one whole log; its size."""
        done: queue.Queue[str] = queue.Queue()

        def heard(result: LogFilesResult, progress: object, data: object) -> None:  # noqa: ARG001 - MAVSDK's signature
            if result.name != "NEXT":
                done.put(result.name)

        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "flight.tlog"
            self.logs.download_log_file_async(entry, str(path), heard)
            result = done.get(timeout=LOG_TIMEOUT)
            _ensure(result == "SUCCESS", f"log {entry.id}: {result}")
            size = path.stat().st_size
        _ensure(size == entry.size_bytes, f"log {entry.id}: {size} bytes of {entry.size_bytes}")
        return size

    def _arrive(self, north: float, east: float, up: float) -> None:
        def near(now: dict[str, Any]) -> bool:
            p = _position(now)
            return math.dist((p.north_m, p.east_m, -p.down_m), (north, east, up)) < 1.0

        self.watch.until(f"at {north:g} m north, {east:g} m east, {up:g} m up", near)


STEPS = (
    Session.health, Session.parameters, Session.missions, Session.telemetry_topics, Session.fence, Session.failures,
    Session.lift_off, Session.land, Session.take_off, Session.go_to, Session.set_points, Session.attitudes,
    Session.land, Session.fly_mission, Session.wings, Session.move_home, Session.come_home, Session.log_files,
    flight_plan, Session.restart,
)  # fmt: skip


def main(argv: list[str] | None = None) -> int:
    """Fly the session; exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--url", default="udpin://127.0.0.1:14540", help="address that the vehicle sends to [%(default)s]"
    )
    arguments = parser.parse_args(argv)
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    try:
        mavsdk.add_any_connection(arguments.url)
        system = mavsdk.first_autopilot(FLIGHT_TIMEOUT)
        if system is None:
            print(f"FAILED connect: no vehicle at {arguments.url}", flush=True)
            return NO_VEHICLE
        return _fly(system)
    finally:
        mavsdk.destroy()


def _fly(system: Any) -> int:  # noqa: ANN401
    began = time.monotonic()
    session = Session(system, lambda text: print(f"  {text}", flush=True))
    for step in STEPS:
        name = step.__name__
        try:
            step(session)
        except (SessionError, MavsdkError) as error:
            print(f"FAILED {name}: {error}", flush=True)
            return 1
        print(f"ok {name} at {time.monotonic() - began:.1f} s", flush=True)
    return 0


def _position(now: dict[str, Any]) -> Any:  # noqa: ANN401
    return now["position_velocity_ned"].position


def _velocity(now: dict[str, Any]) -> Any:  # noqa: ANN401
    return now["position_velocity_ned"].velocity


def _largest(euler: Any) -> float:  # noqa: ANN401
    return float(max(abs(euler.roll_deg), abs(euler.pitch_deg), abs(euler.yaw_deg)))


def _range(now: dict[str, Any]) -> float:
    return math.hypot(_position(now).north_m, _position(now).east_m)


def _ensure(holds: bool, what: str) -> None:
    if not holds:
        raise SessionError(f"expected: {what}")


def _refused(kind: type[Exception], call: Callable[..., Any], *arguments: Any) -> str:  # noqa: ANN401
    try:
        call(*arguments)
    except kind as error:
        return str(error.result.name)  # type: ignore[attr-defined]
    raise SessionError(f"{call.__name__}{arguments} was not refused")


if __name__ == "__main__":
    sys.exit(main())
