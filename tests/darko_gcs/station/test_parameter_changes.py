"""Changes of several parameters: what became of each, and that a refused value is never told as set."""

import pytest

from darko_gcs.state.parameters import ChangeState, refused_changes
from darko_gcs.station.parameter_requests import MAX_OPEN_CHANGES
from darko_gcs.station.station import Station
from protocol.dialect import mavlink
from protocol.wire.codec import Codec
from tests.support.gcs.messages import heartbeat

REAL = mavlink.MAV_PARAM_TYPE_REAL32


class Vehicle:
    """A vehicle that takes values up to a limit, and "LOW" only below "HIGH"; its texts say why not."""

    def __init__(self, station, **values):
        self.station, self.codec, self.values, self.now = station, Codec(1, 1), values, 0.0
        self.told, self.sent, self.most_at_once = [], [], 0
        self._send(heartbeat())
        station.fetch_parameters(0.0)

    def run(self, seconds):
        end = self.now + seconds
        while self.now < end:
            self.now += 0.05
            requests = [m for data in self.station.outgoing(self.now, 0) for m in self.codec.decode(data)]
            sets = [m for m in requests if m.get_type() == "PARAM_SET"]
            self.most_at_once = max(self.most_at_once, len(sets))
            for message in requests:
                if message.get_type() in {"PARAM_REQUEST_LIST", "PARAM_REQUEST_READ"}:
                    for name in self.values:
                        self._tell(name)
            for message in sets:
                self._set(message.param_id, message.param_value)
            self._send(heartbeat())
            self.station.tick(self.now)

    def _set(self, name, value):
        self.sent.append((name, value))
        before, self.values[name] = self.values[name], value
        self._tell(name)  # some vehicles echo first and refuse then
        if value > 100 or (name in {"LOW", "HIGH"} and self.values["LOW"] >= self.values["HIGH"]):
            self.values[name] = before
            self._tell(name)
            if name not in self.told:  # nobody repeats the same text all the time
                self._send(mavlink.MAVLink_statustext_message(4, f"{name} = {value:g} does not fit".encode()))
            self.told.append(name)

    def _tell(self, name):
        index = list(self.values).index(name)
        self._send(mavlink.MAVLink_param_value_message(name.encode(), self.values[name], REAL, len(self.values), index))

    def _send(self, message):
        self.station.receive(self.codec.encode(message), self.now, 0)


@pytest.fixture
def station():
    return Station()


def states(station):
    return {name: change.state for name, change in station.snapshot.parameter_changes.items()}


def test_each_of_several_changes_is_told_by_itself(station):
    vehicle = Vehicle(station, A=1.0, B=2.0)
    vehicle.run(0.3)
    station.set_parameters({"A": 5.0, "B": 500.0}, vehicle.now)
    assert states(station) == {"A": ChangeState.WAITING, "B": ChangeState.WAITING}
    vehicle.run(0.3)
    assert ChangeState.SET not in states(station).values()  # it may still be refused
    vehicle.run(3.0)
    assert states(station) == {"A": ChangeState.SET, "B": ChangeState.REFUSED}
    assert station.snapshot.parameters == {"A": 5.0, "B": 2.0}
    refused = refused_changes(station.snapshot.parameter_changes)
    assert {name: change.words for name, change in refused.items()} == {"B": "refused: B = 500 does not fit"}
    lines = [line.text for line in station.snapshot.messages]
    assert "Parameter A is 5" in lines
    assert "Parameter B is 500" not in lines
    assert lines.count("Parameter B stays 2: the vehicle refused 500") == 1


def test_a_value_that_fits_only_with_the_others_is_tried_again_after_them(station):
    vehicle = Vehicle(station, HIGH=20.0, LOW=10.0)
    vehicle.run(0.3)
    station.set_parameters({"LOW": 30.0, "HIGH": 40.0}, vehicle.now)
    vehicle.run(3.0)
    assert states(station) == {"HIGH": ChangeState.SET, "LOW": ChangeState.SET}
    assert vehicle.values == {"HIGH": 40.0, "LOW": 30.0}
    assert vehicle.sent.count(("LOW", 30.0)) == 2


def test_the_reason_of_the_first_refusal_is_told_after_the_second(station):
    vehicle = Vehicle(station, A=1.0, B=2.0)
    vehicle.run(0.3)
    station.set_parameters({"B": 500.0, "A": 5.0}, vehicle.now)
    vehicle.run(3.0)
    assert vehicle.told == ["B", "B"]
    assert station.snapshot.parameter_changes["B"].words == "refused: B = 500 does not fit"


def test_a_single_refused_value_is_not_tried_again(station):
    vehicle = Vehicle(station, A=1.0)
    vehicle.run(0.3)
    station.set_parameter("A", 500.0, vehicle.now)
    vehicle.run(3.0)
    assert states(station) == {"A": ChangeState.REFUSED}
    assert vehicle.sent.count(("A", 500.0)) == 1


def test_a_long_file_is_sent_a_few_at_a_time(station):
    vehicle = Vehicle(station, **{f"P{number}": 0.0 for number in range(40)})
    vehicle.run(0.3)
    station.set_parameters(dict.fromkeys(vehicle.values, 1.0), vehicle.now)
    vehicle.run(3.0)
    assert set(states(station).values()) == {ChangeState.SET}
    assert 1 < vehicle.most_at_once <= MAX_OPEN_CHANGES


def test_without_a_vehicle_a_change_is_refused_at_once(station):
    station.set_parameter("A", 1.0, 0.0)
    assert states(station) == {"A": ChangeState.REFUSED}
    assert station.snapshot.parameter_changes["A"].reason
