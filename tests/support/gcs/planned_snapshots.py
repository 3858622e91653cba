"""Snapshots of a vehicle that flies a flight plan, made of the messages that it would send."""

from darko_gcs.state.reduce import reduce
from protocol.dialect import mavlink
from protocol.engines.server.flight_plan_server import FlightPlanServer
from protocol.frames import LocalFrame
from protocol.wire.codec import Codec
from sitl.defaults import HOME
from tests.support.gcs.snapshots import HOVERING, snapshot_with
from tests.support.links.flight_plan_table import block, event, sector, status, variable, waypoint

CORNERS = {"_R1": (4.0, 4.0), "_R2": (4.0, -4.0), "_R3": (-4.0, -4.0), "_R4": (-4.0, 4.0)}
POINTS = {"HOME": (0.0, 0.0), "STDBY": (0.5, 0.0), "p1": (1.5, 1.5), "p2": (1.5, -1.5), "TD": (0.0, -0.5), **CORNERS}
BLOCKS = (
    block(0, "Engine off", shortcut=b"k"),
    block(1, "Takeoff", strip_button=b"Take off", shortcut=b"t", group=b"flight"),
    block(2, "Standby", strip_button=b"Stand by", shortcut=b"s", group=b"flight"),
    block(3, "Route", strip_button=b"Route", group=b"figures"),
    block(
        4, "Camera", strip_button=b"Camera", shortcut=b"F5", group=b"figures", locked=b"call CameraOn() is not flown"
    ),
    block(5, "Land", strip_button=b"Land", shortcut=b"Ctrl+l", group=b"flight"),
    block(6, "HOME"),
)
STDBY, P1, TD, LAPS = 2, 3, 5, 1


def placed(number, name, east, north, up=2.0):
    """A waypoint where its metres say that it is, seen from home."""
    point, place = waypoint(number, east, north, up, name), LocalFrame(HOME).to_geodetic((north, east, -up))
    point.lat, point.lon, point.shown = round(place.lat_deg * 1e7), round(place.lon_deg * 1e7), int(name[0] != "_")
    return point


class PlannedVehicle:
    """The vehicle's side: each call gives the messages of a change, as they arrive."""

    def __init__(self):
        self.server, self._codec, self._ground = FlightPlanServer(1, 1), Codec(1, 1), Codec(255, 190)
        points = [placed(number, name, *place) for number, (name, place) in enumerate(POINTS.items(), 1)]
        corners = [list(POINTS).index(name) + 1 for name in CORNERS]
        self.server.load([*BLOCKS, *points, variable(LAPS, 2.0, "laps"), sector(1, corners)])

    def status(self, number=2, ms=60_000):
        told = status(ms, number, b"Flying room")
        self.server.mark(told)
        return self._arrived(told)

    def table(self):
        return [self._arrived(entry) for entry in self.server._entries.values()]

    def moved(self, number, name, east, north):
        return [self._arrived(entry) for entry in self.server.update([placed(number, name, east, north)])]

    def event(self, text, kind=mavlink.DARKO_PLAN_EVENT_KIND_EXCEPTION, at=50.0):
        return self._arrived(self.server.tell(event(text, kind, at)))

    def _arrived(self, message):
        (decoded,) = self._ground.decode(self._codec.encode(message))
        return decoded


def after(s, *messages):
    for message in messages:
        s = reduce(s, message, 100.0)
    return s


def planned(mode="FLIGHT_PLAN"):
    """The vehicle, and a snapshot with all of its plan."""
    vehicle = PlannedVehicle()
    s = after(snapshot_with(HOVERING, status={"mode": mode}), vehicle.status(), *vehicle.table())
    return vehicle, after(s, vehicle.event("datalink_time > 10"))
