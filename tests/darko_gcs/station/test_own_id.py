"""The station's own system id: on the wire, in what it asks of the vehicle, and heard from somebody else."""

from contextlib import asynccontextmanager

import pytest

from darko_gcs.__main__ import main
from darko_gcs.errors import GroundError
from darko_gcs.scripting import vehicle as scripted_vehicle
from darko_gcs.station.fleet import Fleet
from darko_gcs.station.station import Station
from darko_gcs.tasks import headless_flight, key_change, log_download
from darko_gcs.tui.actions import control_question
from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GROUND_HEARTBEAT
from protocol.wire.codec import Codec
from tests.support.paths import DATA

COMMANDS = [
    "cmd hold", "cmd hold --all", "watch", "param list", "mission download x.plan", "fail gps off", "plan status",
    "log fetch --list", f"signing --signing-key {'cd' * 32} --new-key {'ab' * 32}",
    f"fly --headless --mission {DATA / 'square.plan'}",
]  # fmt: skip
VEHICLE_HEARTBEAT = mavlink.MAVLink_heartbeat_message(
    mavlink.MAV_TYPE_VTOL_DUOROTOR, mavlink.MAV_AUTOPILOT_GENERIC, 0, 0, mavlink.MAV_STATE_ACTIVE, 3
)


def heard(station, system, message, component=190):
    station.receive(Codec(system, component).encode(message), 1.0, 0)


def test_it_stands_in_every_frame_in_the_request_for_control_and_in_its_question():
    station = Station(system=201)
    heard(station, 1, VEHICLE_HEARTBEAT, component=1)
    station.take_control(1.0)
    station.tick(1.1)
    sent = [m for data in station.outgoing(1.1, 0) for m in Codec(1, 1).decode(data)]
    assert {m.get_srcSystem() for m in sent} == {201}
    (asked,) = [m for m in sent if m.get_type() == "COMMAND_LONG" and m.command == 32100]
    assert asked.param4 == 201.0
    assert "as ground station 201?" in control_question(station.snapshot)[0]


def test_another_station_with_the_same_id_is_told_once_and_one_with_another_id_is_not():
    station = Station()
    heard(station, 1, VEHICLE_HEARTBEAT, component=1)
    heard(station, 254, GROUND_HEARTBEAT)
    assert station.snapshot.session.alerts == ()
    for _ in range(3):
        heard(station, 255, GROUND_HEARTBEAT)
    (alert,) = station.snapshot.session.alerts
    assert "another ground station has our id 255" in alert.text


def test_stations_of_a_fleet_have_the_leads_id():
    lead = Station(system=201)
    fleet = Fleet(lead)
    for vehicle in (1, 2):
        heard(lead, vehicle, VEHICLE_HEARTBEAT, component=1)
    assert {station.snapshot.session.own_system for station in fleet.stations.values()} == {201}


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_that_speaks_to_a_vehicle_has_an_id_of_its_own(command, monkeypatch, capsys, tmp_path):
    @asynccontextmanager
    async def opened(station, *_):
        raise GroundError(f"opened as {station.endpoint.codec.system}")
        yield

    for module in (scripted_vehicle, log_download, key_change, headless_flight):
        monkeypatch.setattr(module, "open_link", opened)
    record = ["--record", str(tmp_path)] if command.startswith("fly") else []
    assert main([*command.split(), *record, "--id", "201"]) != 0
    assert "opened as 201" in capsys.readouterr().err
    assert main([*command.split(), *record]) != 0
    assert "opened as 255" in capsys.readouterr().err
