"""Three real vehicles on one port: armed and taken off over UDP, each by its own answers."""

import asyncio
import json
import signal

import pytest

from darko_gcs.__main__ import main
from darko_gcs.scripting import connect_all
from tests.e2e.support import free_ports, running

HEIGHT = 2.0  # [m]


async def take_off_all(port):
    async with connect_all(port=port) as vehicles:
        await asyncio.gather(*(vehicle.ready() for vehicle in vehicles.values()))
        await asyncio.gather(*(vehicle.arm() for vehicle in vehicles.values()))
        await asyncio.gather(*(vehicle.take_off(HEIGHT) for vehicle in vehicles.values()))
        await asyncio.gather(
            *(
                vehicle.wait_until(lambda s: s.position.relative_altitude > HEIGHT - 0.5, 30.0)
                for vehicle in vehicles.values()
            )
        )
        flown = {system: vehicle.now for system, vehicle in vehicles.items()}
        await vehicles[8].land()
        await vehicles[8].wait_until(lambda s: s.status.mode == "LAND", 10.0)
        return flown, [vehicle.now.status.mode for vehicle in vehicles.values()]


@pytest.mark.long
def test_three_vehicles_take_off_from_their_own_places_and_one_lands(tmp_path, capsys):
    (port,) = free_ports(1)
    fleet = ("--vehicles", "3", "--sysid", "7", "--spacing", "4", "--speed", "2", "--nav", "truth")
    with running(port, tmp_path, *fleet) as (process, _):
        flown, modes = asyncio.run(take_off_all(port))
        code = main(["cmd", "speed", "500", "--all", "--port", str(port), "--json"])
        refused = json.loads(capsys.readouterr().out)
        process.send_signal(signal.SIGTERM)
        ending = process.stderr.read()
        assert process.wait() == 130

    places = {system: tuple(round(x) for x in s.position.p[:2]) for system, s in flown.items()}
    assert places == {7: (0, 0), 8: (0, 4), 9: (4, 0)}
    assert all(abs(s.position.from_home[0]) < 1.0 and abs(s.position.from_home[1]) < 1.0 for s in flown.values())
    assert modes[1] == "LAND"
    assert "LAND" not in {modes[0], modes[2]}
    assert code == 4
    assert {system: told["ok"] for system, told in refused["vehicles"].items()} == dict.fromkeys("789", False)
    assert "ticks missed" in ending
    assert sorted(folder.name for folder in tmp_path.iterdir()) == ["vehicle-7", "vehicle-8", "vehicle-9"]
