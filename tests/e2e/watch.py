"""A ground station without a screen, for tests to kill: prints its state as JSON lines, reads requests as lines.

Usage: python watch.py PORT FOLDER [KEY]. Requests on stdin: ``plans.upload FILE``, ``arm``, ``plans.start_mission``.
"""

import asyncio
import json
import sys
from operator import attrgetter
from pathlib import Path
from zlib import crc32

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from darko_gcs.feed.live_feed import LiveFeed
from darko_gcs.station.keyring_setup import open_keyring
from darko_gcs.station.recording import start_recording
from darko_gcs.station.station import Station
from protocol.plans import load

LOOK = 0.01  # [s]


def fingerprint(items):
    """A short text that identifies a mission."""
    return f"{len(items)} items {crc32(repr([(item.command, item.x, item.y, item.z) for item in items]).encode()):08x}"


def digest(s, log, mission):
    """The part of the state that the tests look at."""
    link, status, table = s.link, s.status, s.parameters
    return {
        "log": log, "boot": link.boot and int(link.boot), "source": s.identity.source, "lost": link.lost,
        "restarts": link.restarts, "mode": status.mode, "armed": status.armed, "ready": status.prearm_ok,
        "mission": mission, "current": s.mission.current, "reached": sorted(s.mission.reached),
        "home": s.position.home is not None, "transfer": s.plans.transfer, "signing": link.signing.name,
        "has_parameters": table.total is not None and len(table.values) == table.total,
        "texts": [line.text for line in s.log.lines[-20:]],
    }  # fmt: skip


async def main(port, folder, key=None):
    """Serve until killed."""
    folder = Path(folder)
    recorder, log = start_recording(folder)
    feed = LiveFeed(
        Station(recorder, open_keyring(key, time_file=folder / "signing-time")), "127.0.0.1", int(port), None
    )
    await feed.open()

    def obey():
        request, *rest = sys.stdin.readline().split()
        arguments = [load(name).items for name in rest]
        attrgetter(request)(feed.station)(*arguments, feed.now)

    asyncio.get_running_loop().add_reader(sys.stdin, obey)
    printed, has_asked = None, False
    items = mission = None
    while True:
        feed.advance(LOOK)
        if not has_asked and feed.snapshot.position.home is not None:
            has_asked = True  # as when the user opens the screen of parameters
            feed.station.fetch_parameters(feed.now)
        if feed.snapshot.plans.mission is not items:
            items = feed.snapshot.plans.mission
            mission = fingerprint(items)
        if (state := digest(feed.snapshot, str(log), mission)) != printed:
            printed = state
            print(json.dumps(state), flush=True)
        await asyncio.sleep(LOOK)


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:]))
