"""A feed of several vehicles that stand still, and what each was asked."""

from protocol.dialect import mavlink
from tests.support.gcs.screens import FakeFeed, RequestRecorder
from tests.support.gcs.snapshots import HOVERING, snapshot_with


def numbered(system, **parts):
    """A hovering vehicle with a system id."""
    s = snapshot_with(HOVERING, identity={"source": (system, 1)}, position={"ground_speed": 0.5})
    return snapshot_with(s, **parts)


def landed(system, **parts):
    """A disarmed vehicle on the ground."""
    on_ground = mavlink.MAV_LANDED_STATE_ON_GROUND
    return numbered(system, status={"armed": False, "landed_state": on_ground}, **parts)


class StillFleet:
    """In place of ``Fleet``: vehicles that stand still."""

    def __init__(self, snapshots):
        self.stations = {s.identity.source[0]: RequestRecorder(s) for s in snapshots}
        self.active = next(iter(self.stations.values()))

    def choose(self, system):
        self.active = self.stations[system]

    def choose_next(self, step):
        stations = list(self.stations.values())
        self.active = stations[(stations.index(self.active) + step) % len(stations)]


class FleetFeed(FakeFeed):
    """A feed of several vehicles.

    Args:
        snapshots: Of the vehicles, by ascending system id.
    """

    def __init__(self, *snapshots):
        still = StillFleet(snapshots)
        super().__init__(snapshots[0])
        self.fleet = still

    @property
    def snapshot(self):
        return self.station.snapshot

    @snapshot.setter
    def snapshot(self, s):
        pass  # each vehicle has its own

    @property
    def station(self):
        return self.fleet.active

    @station.setter
    def station(self, station):
        pass

    @property
    def asked(self):
        """The requests to each vehicle."""
        return {system: station.requests for system, station in self.fleet.stations.items()}
