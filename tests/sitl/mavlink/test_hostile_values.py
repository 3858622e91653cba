"""Numbers from the edges of float32 in items, commands, set-points and parameters: refused by name, or flown and kept.

Errors of the vehicle's own code are raised here (``tests/conftest.py``), so that none goes unseen.
"""

import math
import re
import tempfile
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.plans import load
from protocol.plans.plan import MissionItem
from protocol.ranges import MESSAGE_RANGES
from sitl.autopilot.mission.items import SUPPORTED_COMMANDS
from sitl.mavlink import commands
from sitl.tools.persistence import StateFolder
from tests.support.paths import DATA
from tests.support.vehicle.fake_station import NAN, FakeStation

SQUARE = load(DATA / "square.plan").items
LAT, LON = 435646000, 14815000
ACCEPTED = mavlink.MAV_MISSION_ACCEPTED
RELATIVE, LOCAL = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_LOCAL_NED
FENCE, RALLY = mavlink.MAV_MISSION_TYPE_FENCE, mavlink.MAV_MISSION_TYPE_RALLY
SKIPPED = {mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN}  # it would end the vehicle, as it is meant to

edges = st.sampled_from(
    [math.inf, -math.inf, NAN, 1e-45, -1e-45, 1.17549435e-38, 1e38, -1e38, 3.4028234e38, -0.0, 1e9, 1e20, 2.0**31]
)
usual = st.sampled_from([NAN, 0.0, 1.0, -1.0, 2.0, 3.0, 0.5, 0.05, 10.0, 22.0, 40.0, -20.0, 360.0, 65535.0])
numbers = st.one_of(usual, usual, usual, edges, st.floats(width=32))
whole_numbers = st.one_of(st.sampled_from([0, 1, -1, 2**31 - 1, -(2**31), LAT, LON]), st.integers(-(2**31), 2**31 - 1))
latitudes = st.one_of(st.sampled_from([LAT, LAT + 500, LAT - 2000, 0]), whole_numbers)
longitudes = st.one_of(st.sampled_from([LON, LON + 900, LON - 1500, 0]), whole_numbers)
frames = st.one_of(st.sampled_from([RELATIVE, 2, LOCAL]), st.integers(0, 255))
altitudes = st.one_of(st.sampled_from([3.0, 10.0, 30.0]), numbers)


def items_of(known):
    return st.builds(
        MissionItem,
        command=st.sampled_from(sorted(known)),
        frame=frames,
        params=st.tuples(numbers, numbers, numbers, numbers),
        x=latitudes,
        y=longitudes,
        z=altitudes,
    )


def jump(repeats, target=0.0):
    params = (target, repeats, 0.0, 0.0)
    return MissionItem(command=mavlink.MAV_CMD_DO_JUMP, frame=2, params=params, x=0, y=0, z=0.0)


@pytest.fixture(scope="module")
def station(tmp_path_factory):
    """A station of a vehicle that hovers, and goes on from one example to the next."""
    return FakeStation.with_vehicle(tmp_path_factory.mktemp("state"), up=20.0)


def texts_of(station, count):
    return "".join(m.text for m in station.all("STATUSTEXT")[count:])


@given(st.lists(items_of(SUPPORTED_COMMANDS), min_size=1, max_size=4))
@example([SQUARE[0], SQUARE[1], jump(math.inf)])
@example([SQUARE[0], SQUARE[1], jump(-1.0)])
@example([SQUARE[0], SQUARE[1], jump(1.0, target=-0.0)])
def test_a_mission_is_refused_by_item_or_flown_and_kept(station, items):
    station.wait(30.0)  # so that texts are not withheld
    before, said = station.node.endpoint.plan(0), len(station.all("STATUSTEXT"))
    result = station.upload(items)
    kept = StateFolder(station.node.state_folder.folder).mission()
    assert kept == station.node.endpoint.plan(0)
    if result != ACCEPTED:
        assert kept == before
        assert re.search(r"Mission refused: item \d+: ", texts_of(station, said))
        return
    assert [item.wire_image() for item in kept] == [item.wire_image() for item in items]
    assert tuple(station.autopilot.mission.items) == kept
    station.command(mavlink.MAV_CMD_MISSION_START)
    station.advance(1.0)
    assert all(map(math.isfinite, station.vehicle.truth.body.position))
    assert "not saved" not in texts_of(station, said)


@pytest.mark.parametrize(("kind", "first", "last"), [(FENCE, 5000, 5004), (RALLY, 5100, 5100)])
@given(st.data())
def test_a_fence_and_rally_points_are_refused_by_item_or_kept(station, kind, first, last, data):
    station.wait(30.0)
    items = data.draw(st.lists(items_of(range(first, last + 1)), min_size=1, max_size=3))
    said = len(station.all("STATUSTEXT"))
    if station.upload(items, kind) != ACCEPTED:
        assert re.search(r"refused: (fence|rally) item \d+: ", texts_of(station, said))
    assert "not saved" not in texts_of(station, said)
    folder = StateFolder(station.node.state_folder.folder)
    kept = folder.fence() if kind == FENCE else folder.rally()
    assert [item.wire_image() for item in kept] == [i.wire_image() for i in station.node.endpoint.plan(kind)]


@given(st.sampled_from(sorted(set(commands.HANDLERS) - SKIPPED)), st.lists(numbers, min_size=7, max_size=7))
def test_a_command_is_answered_once_whatever_its_numbers(station, command, params):
    station.wait(30.0)
    acks, said = len(station.all("COMMAND_ACK")), len(station.all("STATUSTEXT"))
    station.send(mavlink.MAVLink_command_long_message(1, 1, command, 0, *params))
    (ack,) = station.all("COMMAND_ACK")[acks:]
    infinite = [number for number, value in enumerate(params, start=1) if math.isinf(value)]
    if infinite:
        assert ack.result in {mavlink.MAV_RESULT_DENIED, mavlink.MAV_RESULT_UNSUPPORTED}
        assert re.search(r"denied: param\d is |not supported|refused", texts_of(station, said))
    station.advance(0.1)
    assert all(map(math.isfinite, station.autopilot.reference.position))


@given(st.sampled_from(sorted(MESSAGE_RANGES)), st.integers(0, 2**16 - 1), frames, st.data())
def test_a_set_point_or_a_stick_is_flown_or_refused_whatever_its_numbers(station, name, mask, frame, data):
    kind = next(known for known in mavlink.mavlink_map.values() if known.msgname == name)
    fields = {}
    for field, field_type in zip(kind.fieldnames, kind.fieldtypes, strict=True):
        length = kind.array_lengths[kind.ordered_fieldnames.index(field)]
        bounds = {"uint8_t": (0, 255), "uint16_t": (0, 65535), "int16_t": (-32768, 32767)}.get(field_type)
        draw = numbers if field_type == "float" else st.integers(*(bounds or (0, 2**31 - 1)))
        fields[field] = [data.draw(draw) for _ in range(length)] if length else data.draw(draw)
    fields |= {"target_system": 1, "target_component": 1, "target": 1, "coordinate_frame": frame}
    fields["type_mask"] = mask if "POSITION" in name else mask & 0xFF
    station.send(kind(**{field: value for field, value in fields.items() if field in kind.fieldnames}))
    station.advance(0.1)
    assert all(map(math.isfinite, (*station.autopilot.reference.position, station.autopilot.reference.heading)))


@given(st.data(), numbers)
def test_a_parameter_keeps_a_value_that_it_can_have(station, data, value):
    configuration = station.node.aircraft.configuration
    name = data.draw(st.sampled_from([parameter.name for parameter in configuration.wire_table()]))
    told = len(station.all("PARAM_VALUE"))
    station.set_parameter(name, value)
    (answer,) = station.all("PARAM_VALUE")[told:]
    assert answer.param_id == name
    parameter = next(p for p in station.node.aircraft.configuration.wire_table() if p.name == name)
    assert parameter.minimum <= parameter.value <= parameter.maximum


def test_a_jump_without_end_that_is_refused_leaves_the_mission_of_before_also_after_a_restart():
    with tempfile.TemporaryDirectory() as folder:
        station = FakeStation.with_vehicle(Path(folder))
        assert station.upload(SQUARE) == ACCEPTED
        assert station.upload([SQUARE[0], SQUARE[1], jump(math.inf)]) == mavlink.MAV_MISSION_INVALID_PARAM2
        told = "Mission refused: item 2: param2 is inf, not -1 or a whole number from 0 to 65535 (repeat count)"
        assert told in station.texts()
        assert FakeStation.with_vehicle(Path(folder)).node.endpoint.plan(0) == SQUARE


@pytest.mark.parametrize(
    ("place", "result", "number"),
    [
        ((math.inf, 1.48), mavlink.MAV_MISSION_INVALID_PARAM5_X, 5),
        ((43.5, -math.inf), mavlink.MAV_MISSION_INVALID_PARAM6_Y, 6),
        ((43.5, 1e38), mavlink.MAV_MISSION_INVALID_PARAM6_Y, 6),
    ],
)
def test_an_item_whose_position_is_in_floats_is_refused_by_its_parameter(station, place, result, number):
    station.wait(30.0)
    said = len(station.all("STATUSTEXT"))
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 1, 0))
    numbers = (0.0, 0.0, 0.0, NAN, *place, 3.0)
    station.send(mavlink.MAVLink_mission_item_message(1, 1, 0, RELATIVE, mavlink.MAV_CMD_NAV_WAYPOINT, 0, 1, *numbers))
    assert station.last("MISSION_ACK").type == result
    assert f"Mission refused: item 0: param{number} is {place[number - 5]:g}" in texts_of(station, said)
