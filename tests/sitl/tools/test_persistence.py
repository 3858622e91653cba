"""The state folder under SIGKILL, on a full disk and when it disappears, with the real node."""

import io
import os
import random
import shutil
import signal
import time
from collections import Counter
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from protocol.dialect import mavlink
from protocol.plans import load
from protocol.plans.plan import MissionItem
from protocol.wire.codec import Codec
from sitl.errors import SitlError
from sitl.tools.persistence import StateFolder
from tests.support.disk import full_disk
from tests.support.paths import DATA
from tests.support.vehicle.fake_station import PEER, Bench

SEED = 11
FENCE, RALLY = mavlink.MAV_MISSION_TYPE_FENCE, mavlink.MAV_MISSION_TYPE_RALLY
CIRCLE = mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION
POINT = mavlink.MAV_CMD_NAV_RALLY_POINT
TO = (1, 1)
CALLS = ((os, "open"), (io, "open"), (os, "fsync"), (os, "replace"))  # a death may come before and after each


def fence(radius):
    return (MissionItem(command=CIRCLE, frame=0, params=(radius, 0.0, 0.0, 0.0), x=435648000, y=14811000, z=0.0),)


def rally(count):
    return tuple(
        MissionItem(command=POINT, frame=3, params=(0.0,) * 4, x=435648100 + n, y=14811000, z=4.0) for n in range(count)
    )


def put(name, value):
    return [mavlink.MAVLink_param_set_message(*TO, name, value, mavlink.MAV_PARAM_TYPE_REAL32)]


def upload(items, kind=0):
    count = mavlink.MAVLink_mission_count_message(*TO, len(items), kind)
    return [count, *(item.to_message(seq, *TO, kind=kind) for seq, item in enumerate(items))]


def home(alt):
    return [mavlink.MAVLink_command_long_message(*TO, mavlink.MAV_CMD_DO_SET_HOME, 0, 0, 0, 0, 0, 43.565, 1.481, alt)]


SQUARE = load(DATA / "square.plan").items
ORDERS = (  # each is acknowledged, and each changes the stored state
    upload(SQUARE[:4]),
    put(b"SIM_WIND_SPD", 2.0),
    home(155.0),
    upload(fence(900.0), FENCE),
    upload(SQUARE),
    upload(rally(2), RALLY),
    put(b"SIM_WIND_DIR", 30.0),
    home(160.0),
    [mavlink.MAVLink_mission_clear_all_message(*TO, 255)],
)
ANSWERS = {"MISSION_ACK", "PARAM_VALUE", "COMMAND_ACK"}


class Order:
    """Sends one order to a node and waits for its answer."""

    def __init__(self, node):
        self.node, self.codec, self.now = node, Codec(255, 190), 0.0

    def __call__(self, messages):
        heard = []
        for message in messages:
            self.now += 1.0  # no two orders are repetitions of one
            self.node.receive(self.codec.encode(message), PEER, self.now)
            heard += [m for _, data in self.node.datagrams(self.now) for m in self.codec.decode(data)]
        assert any(m.get_type() in ANSWERS for m in heard)
        return heard


def stored_state(folder):
    """Stored state that a vehicle finds if it starts now."""
    state = StateFolder(folder)
    return state.mission(), state.fence(), state.rally(), state.parameters(), state.home_and_origin()


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    ram_disk = Path("/dev/shm")  # noqa: S108 - it spares the disk thousands of flushes
    with TemporaryDirectory(dir=ram_disk if os.access(ram_disk, os.W_OK) else None) as folder:
        yield Bench(Path(folder), up=3.0)


@pytest.fixture(autouse=True)
def folder(bench):
    """The state folder, empty."""
    folder = bench.node.state_folder.folder
    for path in folder.iterdir():
        path.unlink()
    return folder


def die_at(count):
    """Kill this process at the ``count``-th moment before or after a call that touches files."""
    moments = iter(range(1, count + 1))

    def moment():
        if next(moments) == count:
            os.kill(os.getpid(), signal.SIGKILL)

    def dying(call):
        def wrapped(*args, **kwargs):
            moment()
            result = call(*args, **kwargs)
            moment()
            return result

        return wrapped

    for module, name in CALLS:
        setattr(module, name, dying(getattr(module, name)))


class Child:
    """A copy of this process whose node obeys all orders, and reports each answer."""

    def __init__(self, node, die_at_call=0):
        self._heard = b""
        self._pipe, told = os.pipe()
        self.number = os.fork()
        if self.number == 0:
            try:
                if die_at_call:
                    die_at(die_at_call)
                order = Order(node)
                for messages in ORDERS:
                    order(messages)
                    os.write(told, b".")
                os._exit(0)
            finally:
                os._exit(1)
        os.close(told)

    def kill_after(self, answers, delay):
        """Kill it that long [s] after it gave that many answers."""
        while len(self._heard) < answers:
            self._heard += os.read(self._pipe, 1)
        time.sleep(delay)
        os.kill(self.number, signal.SIGKILL)

    def answers(self):
        """Number of orders that were answered before it ended."""
        ended = os.waitstatus_to_exitcode(os.waitpid(self.number, 0)[1])
        assert ended in {0, -signal.SIGKILL}
        with os.fdopen(self._pipe, "rb") as pipe:
            return len(self._heard + pipe.read())


def states_after_each_order(folder):
    """The stored state after none, one, two... of the orders."""
    states, order = [stored_state(folder)], Order(Bench(folder).node)
    for messages in ORDERS:
        order(messages)
        states.append(stored_state(folder))
    return states


@pytest.mark.long
def test_killed_at_any_moment_the_state_is_old_or_new_with_all_that_was_acknowledged(bench, folder, tmp_path):
    draw = random.Random(SEED)
    states = states_after_each_order(tmp_path)
    assert all(a != b for a, b in pairwise(states))
    found = Counter()
    moments = [*range(1, len(ORDERS) * len(CALLS) * 2 + 1)]  # before and after each call
    moments += [0] * len(ORDERS)  # and once after each answer, at any time
    for number, moment in enumerate(moments):
        for path in folder.iterdir():
            path.unlink()
        child = Child(bench.node, die_at_call=moment)
        if not moment:
            child.kill_after(number % len(ORDERS), delay=draw.uniform(0.0, 0.01))
        answered = child.answers()
        after = stored_state(folder)
        assert after in (states[answered], states[min(answered + 1, len(ORDERS))]), number
        assert not [path.name for path in folder.iterdir() if path.name.endswith(".new")]
        found[answered] += 1
    assert min(found[answered] for answered in range(len(ORDERS))) > 0  # the deaths are spread over all orders


def test_a_flight_plan_that_is_stored_is_the_old_or_the_new_one_whenever_it_is_killed(folder):
    """Plans are taken on the ground only, so the flying vehicle of the other orders has none."""
    old, new = b"<old/>", b"<new>" + bytes(100_000) + b"</new>"
    state, found = StateFolder(folder), []
    for moment in range(1, 2 * len(CALLS) + 1):
        state.save_flight_plan(old)
        child = os.fork()
        if child == 0:
            die_at(moment)
            state.save_flight_plan(new)
            os._exit(0)
        os.waitpid(child, 0)
        found.append(StateFolder(folder).flight_plan())
    assert set(found) == {old, new}
    assert found == sorted(found, key=lambda data: data == new)  # new from one moment on


def test_leftovers_of_a_killed_write_are_ignored_and_deleted(folder):
    for name in (
        ".parameters.json.new",
        ".home.json.new",
        ".clearing.new",
        ".mission.plan.new",
        ".fence.plan.new",
        ".rally.plan.new",
    ):
        (folder / name).write_text('{"half": ')
    assert stored_state(folder) == ((), (), (), {}, None)
    assert list(folder.iterdir()) == []


def test_on_a_full_disk_the_old_state_remains_the_flight_goes_on_and_the_pilot_is_told(tmp_path):
    bench = Bench(tmp_path, up=3.0)
    station = bench.station()
    for messages in ORDERS[:4]:
        station.send(*messages)
        bench.advance(0.1)
    before = stored_state(tmp_path)
    with full_disk():
        for messages in ORDERS[4:8]:
            station.send(*messages)
            bench.advance(1.0)
    assert stored_state(tmp_path) == before
    assert [path.name for path in tmp_path.iterdir() if "new" in path.name] == []
    for name in ("mission", "parameters", "rally", "home"):
        assert f"{name} not saved" in station.texts()
    assert bench.autopilot.mission.items == SQUARE  # in force nevertheless
    assert bench.aircraft.vehicle.truth.body.position.z == pytest.approx(3.0, abs=0.1)


def test_when_the_folder_disappears_the_flight_goes_on_and_the_pilot_is_told(tmp_path):
    bench = Bench(tmp_path / "state", up=3.0)
    station = bench.station()
    shutil.rmtree(tmp_path / "state")
    (tmp_path / "state").write_text("a file where the folder was")
    for messages in ORDERS[:4]:
        station.send(*messages)
        bench.advance(1.0)
    for name in ("mission", "parameters", "home", "fence"):
        assert f"{name} not saved" in station.texts()
    assert bench.aircraft.vehicle.truth.body.position.z == pytest.approx(3.0, abs=0.1)


def test_a_state_folder_that_cannot_be_made_is_reported_in_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SitlError, match=r"state folder .*file.state: Not a directory"):
        StateFolder(tmp_path / "file" / "state")
