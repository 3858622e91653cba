"""Every transfer between both ends over a hostile link, and the plain protocol for comparison."""

import random
from collections.abc import Callable
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.engines.file_transfer import BytesFile, Entry, Log
from protocol.engines.table_values import Parameter
from protocol.events import (
    Event,
    FileReceived,
    LogReceived,
    LogsListed,
    MissionCleared,
    MissionDownloaded,
    MissionUploaded,
    ParameterConfirmed,
    ParametersComplete,
    RemoteLog,
    VehicleFound,
)
from tests.support.links.link import Link, plan
from tests.support.links.lossy_pipe import LossyPipe

HOSTILE = {"drop": 0.3, "delay": 0.5, "duplicate": 0.2, "reorder": 0.3}
ITEMS, PARAMETERS = 25, 45  # in every plan and in the table: as many parameters as the vehicle has
FILE = random.Random(1).randbytes(20_000)
LOG = random.Random(2).randbytes(20_000)
LIMIT = 600.0  # [s] of virtual time
PLAN, FENCE, RALLY = 0, 1, 2
_HEARTBEAT = bytes(3)  # message id of HEARTBEAT in a frame


class CountingPipe(LossyPipe):
    """Counts the frames sent, without HEARTBEATs."""

    frames = 0

    def send(self, data: bytes, now: float) -> None:
        self.frames += data[7:10] != _HEARTBEAT
        super().send(data, now)


class Store:
    """One file and one log."""

    def entries(self, _path: str) -> list[Entry]:
        return [Entry("file", len(FILE))]

    def logs(self) -> list[Log]:
        return [Log("log", 1_700_000_000, len(LOG))]

    def open(self, name: str) -> BytesFile:
        return BytesFile({"file": FILE, "log": LOG}[name.strip("/")])


class Rig(Link):
    """A vehicle with plans, parameters, a file and a log, and a ground station that has found it."""

    def __init__(self, seed: int, **losses: float) -> None:
        super().__init__(seed)
        store, real = Store(), mavlink.MAV_PARAM_TYPE_REAL32
        self.vehicle.endpoint = VehicleEndpoint(
            parameters=[
                Parameter(name=f"K_{n}", type=real, value=n / 4, minimum=-100.0, maximum=100.0)
                for n in range(PARAMETERS)
            ],
            mission=plan(ITEMS, 1000),
            validate=lambda _items: None,
            plans={kind: (plan(ITEMS, 1000 + kind), lambda _items: None) for kind in (FENCE, RALLY)},
            peers=["ground"],
            files=store,
            logs=store,
        )
        self.up: CountingPipe = CountingPipe(2 * seed, **losses)
        self.down: CountingPipe = CountingPipe(2 * seed + 1, **losses)
        self.wait_for(VehicleFound)
        self.up.frames = self.down.frames = 0

    @property
    def frames(self) -> int:
        return self.up.frames + self.down.frames


class Transfer(NamedTuple):
    """A request, the event of its success, and the waits of the plain protocol for it."""

    begin: Callable[[GroundEndpoint, float], None]
    expected: Callable[[Event], bool]
    waits: tuple[float, ...]  # [s] of the plain protocol's requests


ANY, ITEM = 1.5, 0.25  # [s] the mission protocol's recommended waits


def _upload(kind: int) -> Transfer:
    items = plan(ITEMS)
    return Transfer(
        lambda ground, now: ground.upload_mission(items, now=now, kind=kind),
        MissionUploaded(ITEMS, kind).__eq__,
        (ANY, *(ITEM,) * ITEMS, ANY),
    )


def _download(kind: int) -> Transfer:
    return Transfer(
        lambda ground, now: ground.download_mission(now, kind),
        MissionDownloaded(plan(ITEMS, 1000 + kind), kind).__eq__,
        (ANY, *(ITEM,) * ITEMS),
    )


TRANSFERS = {
    "mission upload": _upload(PLAN),
    "mission download": _download(PLAN),
    "fence upload": _upload(FENCE),
    "fence download": _download(FENCE),
    "rally upload": _upload(RALLY),
    "rally download": _download(RALLY),
    "clear": Transfer(lambda ground, now: ground.clear_mission(now), MissionCleared(PLAN).__eq__, (ANY,)),
    "parameter table": Transfer(
        lambda ground, now: ground.request_parameters(now),
        ParametersComplete(PARAMETERS).__eq__,
        (ANY,) * PARAMETERS,
    ),
    "parameter set": Transfer(
        lambda ground, now: ground.set_parameter("K_3", 42.0, now),
        ParameterConfirmed("K_3", 42.0).__eq__,
        (ANY, ANY),
    ),
    "FTP read, 20 kB": Transfer(
        lambda ground, now: ground.read_file("file", now),
        FileReceived("file", FILE).__eq__,
        (ANY,) * (2 + -(-len(FILE) // 239)),
    ),
    "log list": Transfer(
        lambda ground, now: ground.list_logs(now), lambda event: isinstance(event, LogsListed), (ANY,)
    ),
    "log download, 20 kB": Transfer(
        lambda ground, now: ground.fetch_log(RemoteLog(0, 0, len(LOG)), now),
        lambda event: isinstance(event, LogReceived) and event.data == LOG,
        (ANY,) * -(-len(LOG) // 90),
    ),
}


def seeds(name: str, count: int) -> range:
    """The seeds of a transfer; each transfer has its own."""
    first = 1000 * list(TRANSFERS).index(name)
    return range(first, first + count)


class Outcome(NamedTuple):
    """Result of one transfer: success, duration and number of frames."""

    is_success: bool
    time: float  # [s]
    frames: int  # both ways, without HEARTBEATs


def fly(transfer: Transfer, seed: int, **losses: float) -> Outcome:
    """One transfer from its beginning to its end."""
    rig = Rig(seed, **losses)
    start, known = rig.now, len(rig.events)
    transfer.begin(rig.ground, start)
    succeeded = False

    def is_over() -> bool:
        nonlocal known, succeeded
        fresh, known = rig.events[known:], len(rig.events)
        succeeded = any(transfer.expected(event) is True for event in fresh)
        return succeeded or not rig.ground.is_busy

    rig.run(is_over, limit=LIMIT)
    return Outcome(succeeded, rig.now - start, rig.frames)


RETRIES = 5  # of the plain protocol


def plain(waits: tuple[float, ...], seed: int, **losses: float) -> Outcome:
    """Requests and answers one after the other, each request repeated after a fixed wait, at most five times."""
    up, down = LossyPipe(2 * seed, **losses), LossyPipe(2 * seed + 1, **losses)
    now, frames = 0.0, 0
    for step, wait in enumerate(waits):
        question, answered = step.to_bytes(2, "big"), False
        for _ in range(RETRIES + 1):
            up.send(question, now)
            frames += 1
            end = now + wait
            while not answered and (instant := min(up.next_arrival(), down.next_arrival())) <= end:
                now = instant
                for data in up.receive(now):
                    down.send(data, now)
                    frames += 1
                answered = question in down.receive(now)
            if answered:
                break
            now = end
        if not answered:
            return Outcome(False, now, frames)
    return Outcome(True, now, frames)
