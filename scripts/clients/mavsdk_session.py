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
import struct
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from mavsdk import ComponentType, Configuration, Mavsdk, MavsdkError
from mavsdk.plugins.action import Action, ActionError, OrbitYawBehavior
from mavsdk.plugins.geofence import Circle, FenceType, Geofence, GeofenceData, Point, Polygon
from mavsdk.plugins.info import Info
from mavsdk.plugins.log_files import Entry, LogFiles, LogFilesError, LogFilesResult
from mavsdk.plugins.mission import Mission, MissionItem, MissionPlan
from mavsdk.plugins.mission_raw import MissionItem as RawItem
from mavsdk.plugins.mission_raw import MissionRaw
from mavsdk.plugins.offboard import Attitude, Offboard, PositionNedYaw, VelocityBodyYawspeed, VelocityNedYaw
from mavsdk.plugins.param import Param, ParamError
from mavsdk.plugins.telemetry import FlightMode, LandedState, Telemetry, VtolState

PATIENCE = 90.0  # [s] for anything that is flown
LOG_PATIENCE = 60.0  # [s]
NOBODY = 5  # exit code
HOVER_THRUST = 0.473  # of the nominal airframe
TOPICS = (
    "altitude", "armed", "flight_mode", "ground_truth", "health_all_ok", "home", "in_air", "landed_state", "odometry",
    "position", "position_velocity_ned", "status_text", "vtol_state",
)  # fmt: skip
METRE = math.degrees(1.0 / 6371008.8)  # of latitude


class SessionError(Exception):
    """The vehicle did not do what was asked."""


class Watch:
    """The newest value of each telemetry topic and, of those that are states, all that were taken."""

    def __init__(self, telemetry: Any) -> None:  # noqa: ANN401 - MAVSDK is untyped
        self.newest: dict[str, Any] = {}
        self.taken: dict[str, list[Any]] = defaultdict(list)
        self._news = threading.Condition()
        for topic in TOPICS:
            getattr(telemetry, f"subscribe_{topic}")(partial(self._take, topic))

    def hear(self, topic: str, value: Any) -> None:  # noqa: ANN401
        """Take one value; also for plugins other than telemetry."""
        with self._news:
            self.newest[topic] = value
            if topic == "status_text":
                self.taken[topic].append(value.text)
            elif not self.taken[topic] or self.taken[topic][-1] != value:
                self.taken[topic] = [*self.taken[topic][-99:], value]
            self._news.notify_all()

    def until(self, what: str, holds: Callable[[dict[str, Any]], bool], timeout: float = PATIENCE) -> None:
        """Wait for the telemetry to say something.

        Raises:
            SessionError: If it does not in time.
        """
        with self._news:
            if not self._news.wait_for(lambda: self._check(holds), timeout):
                texts = "; ".join(self.taken["status_text"][-5:])
                raise SessionError(f"not {what} within {timeout:g} s; the vehicle said last: {texts}")

    def until_is(self, topic: str, value: Any) -> None:  # noqa: ANN401
        """Wait for a topic to have a value."""
        self.until(f"{topic} {getattr(value, 'name', value)}", lambda now: now.get(topic) == value)

    def _take(self, topic: str, value: Any, _data: Any) -> None:  # noqa: ANN401
        self.hear(topic, value)

    def _check(self, holds: Callable[[dict[str, Any]], bool]) -> bool:
        try:
            return holds(self.newest)
        except KeyError:  # not heard of yet
            return False


class Session:
    """One client, one vehicle; each method is a step."""

    def __init__(self, system: Any, say: Callable[[str], None]) -> None:  # noqa: ANN401
        self.say = say
        self.action, self.info, self.param = Action(system), Info(system), Param(system)
        self.mission, self.raw, self.offboard = Mission(system), MissionRaw(system), Offboard(system)
        self.logs, self.telemetry, self.geofence = LogFiles(system), Telemetry(system), Geofence(system)
        self.watch = Watch(self.telemetry)
        self.info.subscribe_flight_information(lambda flight, _data: self.watch.hear("flight", flight.flight_uid))
        self.mission.subscribe_mission_progress(lambda progress, _data: self.watch.hear("progress", progress.current))

    def health(self) -> None:
        """All green, and the vehicle says who it is."""
        self.watch.until("health_all_ok", lambda now: now["health_all_ok"] and "home" in now, 30.0)
        _ensure(self.telemetry.health().is_armable, "armable")
        version = self.info.get_version()
        self.say(f"health all ok, armable; version {version.flight_sw_major}.{version.flight_sw_minor}")

    def parameters(self) -> None:
        """All of them, one set and read back of each type, and none by a name that is not there."""
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
        self.action.set_return_to_launch_altitude(20.0)
        _ensure(self.param.get_param_float("RTL_RETURN_ALT") == 20.0, "return altitude follows")
        # Set-points come at 20 Hz of the client's clock and time out on the vehicle's, which may run faster.
        self.param.set_param_float("COM_OF_LOSS_T", 8.0)
        refusal = _refused(ParamError, self.param.get_param_float, "NO_SUCH_PARAM")
        self.say(f"{len(floats)} floats, {len(integers)} integers; set and read back; NO_SUCH_PARAM: {refusal}")

    def missions(self) -> None:
        """Up and down, in both of MAVSDK's forms; every bit comes back."""
        home = self.watch.newest["home"]
        plan = _raw_plan(home.latitude_deg, home.longitude_deg)
        self.raw.upload_mission(plan)
        back = self.raw.download_mission()
        _ensure([_bits(item) for item in back] == [_bits(item) for item in plan], "the plan came back bit for bit")
        _ensure(not self.raw.download_geofence() and not self.raw.download_rallypoints(), "no fence, no rally points")
        self.mission.clear_mission()
        _ensure(not self.raw.download_mission(), "cleared")
        plan = _plan(home.latitude_deg, home.longitude_deg)
        self.mission.set_return_to_launch_after_mission(False)
        self.mission.upload_mission(MissionPlan(plan))
        got = self.mission.download_mission().mission_items
        _ensure([i.vehicle_action for i in got] == [i.vehicle_action for i in plan], "the actions came back")
        _ensure(all(math.isclose(a.latitude_deg, b.latitude_deg, abs_tol=1e-7) for a, b in zip(got, plan, strict=True)),
                "the places came back")  # fmt: skip
        self.say(f"{len(back)} raw items and {len(got)} items up and down")

    def telemetry_topics(self) -> None:
        """The less common topics, and a rate for one."""
        self.telemetry.set_rate_odometry(10.0)
        wanted = {"altitude", "flight", "ground_truth", "odometry"}
        self.watch.until("telling all topics", lambda now: wanted <= now.keys(), 10.0)
        here, truth = self.watch.newest["position"], self.watch.newest["ground_truth"]
        _ensure(abs(here.latitude_deg - truth.latitude_deg) < METRE, "position and ground truth agree")
        self.say(", ".join(sorted(wanted)))

    def fence(self) -> None:
        """Both kinds of fence up, down again, and cleared."""
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
        self.watch.until("taking off", lambda _: LandedState.TAKING_OFF in self.watch.taken["landed_state"])
        self.watch.until_is("landed_state", LandedState.IN_AIR)
        self.watch.until_is("flight_mode", FlightMode.HOLD)
        refusal = _refused(ActionError, self.action.disarm)
        height = self.watch.newest["position"].relative_altitude_m
        self.say(f"took off to {height:.1f} m; disarm in the air: {refusal}")

    def go_to(self) -> None:
        """A point of the map, then a speed for the way back."""
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

    def attitudes(self) -> None:
        """Off-board by attitude, whose pitch is 90 deg in the hover, then ahead and turning, then back to hold."""
        self.offboard.set_attitude(Attitude(0.0, 90.0, 0.0, HOVER_THRUST))
        self.offboard.start()
        self.watch.until_is("flight_mode", FlightMode.OFFBOARD)
        self.offboard.set_attitude(Attitude(0.0, 80.0, 0.0, 1.02 * HOVER_THRUST))
        self.watch.until("moving north by its tilt", lambda now: _velocity(now).north_m_s > 1.0)
        self.offboard.set_velocity_body(VelocityBodyYawspeed(1.0, 0.0, 0.0, 15.0))
        self.watch.until("moving east, having turned", lambda now: _velocity(now).east_m_s > 0.7)
        _ensure(self.watch.newest["flight_mode"] == FlightMode.OFFBOARD, "off-board all the time")
        self.offboard.stop()
        self.watch.until_is("flight_mode", FlightMode.HOLD)
        self.say("off-board by attitude and by body velocity with a yaw rate, then hold")

    def land(self) -> None:
        """Down where it is; the motors stop."""
        self.action.land()
        self.watch.until_is("flight_mode", FlightMode.LAND)
        self.watch.until("on the ground", lambda now: now["landed_state"] == LandedState.ON_GROUND)
        self.watch.until_is("armed", value=False)
        self.say("landed, disarmed")

    def fly_mission(self) -> None:
        """The plan with its transitions, paused once; its every item is told."""
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
        self.say("mission flown: " + " ".join(state.name for state in self.watch.taken["vtol_state"]))

    def mission_items(self) -> list[Any]:
        """The plan that is flown."""
        home = self.watch.newest["home"]
        return _plan(home.latitude_deg, home.longitude_deg)

    def wings(self) -> None:
        """To the wing and back by command, then round a point."""
        self.action.transition_to_fixedwing()
        self.watch.until_is("vtol_state", VtolState.FW)
        self.action.transition_to_multicopter()
        self.watch.until_is("vtol_state", VtolState.MC)
        home = self.watch.newest["home"]
        self.action.do_orbit(
            40.0, 15.0, OrbitYawBehavior.HOLD_FRONT_TANGENT_TO_CIRCLE,
            home.latitude_deg, home.longitude_deg, home.absolute_altitude_m + 25.0,
        )  # fmt: skip
        self.watch.until_is("vtol_state", VtolState.FW)
        self.watch.until("on the circle", lambda now: abs(_range(now) - 40.0) < 6.0)
        self.say("to the wing, to the hover, round home at 40 m")

    def move_home(self) -> None:
        """Home elsewhere, in flight; not on the other side of the globe."""
        home = self.watch.newest["home"]
        north = home.latitude_deg + 15.0 * METRE
        self.action.set_home(False, north, home.longitude_deg, home.absolute_altitude_m + 1.0)
        self.watch.until("told of its new home", lambda now: abs(now["home"].latitude_deg - north) < 0.1 * METRE)
        up = self.watch.newest["home"].absolute_altitude_m - home.absolute_altitude_m
        _ensure(abs(up - 1.0) < 0.01, f"home is {up:.2f} m higher")
        refusal = _refused(ActionError, self.action.set_home, False, -north, home.longitude_deg, 0.0)
        self.say(f"home moved 15 m north, 1 m up; to the antipodes: {refusal}")

    def come_home(self) -> None:
        """Return, land, disarm, all in one command."""
        self.action.return_to_launch()
        self.watch.until_is("flight_mode", FlightMode.RETURN_TO_LAUNCH)
        self.watch.until_is("landed_state", LandedState.ON_GROUND)
        self.watch.until_is("armed", value=False)
        away = _from_home(self.watch.newest)
        _ensure(away < 2.0, f"{away:.1f} m from home")
        self.say(f"returned and landed {away:.2f} m from home, disarmed")

    def log_files(self) -> None:
        """What the vehicle logged, the smallest of it downloaded; none is an answer."""
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
        """Reboot it on the ground: what it keeps is there again, and it is well."""
        self.param.set_param_float("MIS_TAKEOFF_ALT", 3.5)
        self.action.reboot()
        self.watch.until("rebooting", lambda _now: "Rebooting" in self.watch.taken["status_text"])
        _ensure(self.param.get_param_float("MIS_TAKEOFF_ALT") == 3.5, "take-off altitude is kept")
        self.watch.until("health_all_ok", lambda now: now["health_all_ok"], 30.0)
        self.say("rebooted, well, parameters kept")

    def _download(self, entry: Entry) -> int:
        """Fetch one log whole; its size."""
        done: queue.Queue[str] = queue.Queue()

        def heard(result: LogFilesResult, progress: object, data: object) -> None:  # noqa: ARG001 - MAVSDK's signature
            if result.name != "NEXT":
                done.put(result.name)

        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "flight.tlog"
            self.logs.download_log_file_async(entry, str(path), heard)
            result = done.get(timeout=LOG_PATIENCE)
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
    Session.health, Session.parameters, Session.missions, Session.telemetry_topics, Session.fence, Session.take_off,
    Session.go_to, Session.set_points, Session.attitudes, Session.land, Session.fly_mission, Session.wings,
    Session.move_home, Session.come_home, Session.log_files, Session.restart,
)  # fmt: skip


def main(argv: list[str] | None = None) -> int:
    """Fly the session; exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--url", default="udpin://127.0.0.1:14540", help="where the vehicle is heard [%(default)s]")
    arguments = parser.parse_args(argv)
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    try:
        mavsdk.add_any_connection(arguments.url)
        system = mavsdk.first_autopilot(PATIENCE)
        if system is None:
            print(f"FAILED connect: no vehicle at {arguments.url}", flush=True)
            return NOBODY
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


def _plan(lat: float, lon: float) -> list[Any]:
    """Up, away on the wing, back to the hover over a corner; MAVSDK's own items."""
    east = METRE / math.cos(math.radians(lat))

    def at(north: float, right: float, up: float, action: Any, *, through: bool = False) -> Any:  # noqa: ANN401
        return MissionItem(
            lat + north * METRE, lon + right * east, up, 3.0, through, acceptance_radius_m=1.0, vehicle_action=action
        )

    act = MissionItem.VehicleAction
    return [
        at(0.0, 0.0, 25.0, act.TAKEOFF),
        at(10.0, 0.0, 25.0, act.TRANSITION_TO_FW),
        at(160.0, 0.0, 25.0, act.NONE),
        at(160.0, 90.0, 25.0, act.TRANSITION_TO_MC),
        at(160.0, 100.0, 25.0, act.NONE),
    ]


def _raw_plan(lat: float, lon: float) -> list[Any]:
    """Items whose every bit is to come back: NaN, negative zero, numbers no decimal can write."""
    spots = [(22, math.nan, math.nan), (16, 1.0 / 3.0, math.pi), (16, 0.1, math.nan), (21, -0.0, math.nan)]
    return [
        RawItem(
            seq, 6, command, int(seq == 0), 1, hold, 0.7, -0.0 if command == 16 else math.nan, yaw,
            round(lat * 1e7) + seq, round(lon * 1e7) - 3 * seq, 0.0 if command == 21 else 10.0 / 3.0 + seq, 0,
        )
        for seq, (command, hold, yaw) in enumerate(spots)
    ]  # fmt: skip


def _bits(item: Any) -> tuple[Any, ...]:  # noqa: ANN401
    floats = struct.pack("<5f", item.param1, item.param2, item.param3, item.param4, item.z)
    return (item.seq, item.frame, item.command, item.autocontinue, floats, item.x, item.y)


def _position(now: dict[str, Any]) -> Any:  # noqa: ANN401
    return now["position_velocity_ned"].position


def _velocity(now: dict[str, Any]) -> Any:  # noqa: ANN401
    return now["position_velocity_ned"].velocity


def _range(now: dict[str, Any]) -> float:
    return math.hypot(_position(now).north_m, _position(now).east_m)


def _from_home(now: dict[str, Any]) -> float:
    here, home = now["position"], now["home"]
    east = math.cos(math.radians(home.latitude_deg)) * (here.longitude_deg - home.longitude_deg)
    return math.hypot(here.latitude_deg - home.latitude_deg, east) / METRE


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
