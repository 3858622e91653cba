"""A law, a guard, a sensor, a message and a screen are added by four files each at most, tried on a copy."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
MOST_FILES = 4
GENERATED = ("protocol/dialect/mavlink.py", "protocol/dialect/vocabulary.py")
GENERATE = """
import sys, types
for name in ("hatchling", "hatchling.builders", "hatchling.builders.hooks", "hatchling.builders.hooks.plugin"):
    sys.modules[name] = types.ModuleType(name)
interface = types.ModuleType("hatchling.builders.hooks.plugin.interface")
interface.BuildHookInterface = object
sys.modules[interface.__name__] = interface
sys.path.insert(0, "scripts")
import build_dialect
build_dialect.generate_all()
"""

LAW = '''"""A toy: full ahead."""

from typing import NamedTuple

from sitl.compiled import kernel
from sitl.control.estimate import Estimate
from sitl.model.airframe import Airframe
from sitl.model.state import Actuators


class ToyGains(NamedTuple):
    """How hard."""

    share: float


class ToyState(NamedTuple):
    """What it keeps."""

    flown: float  # [s]


@kernel
def step(estimate: Estimate, gains: ToyGains, a: Airframe, toy: ToyState, dt: float) -> tuple[Actuators, int, ToyState]:
    """A share of all there is."""
    return Actuators(gains.share * a.omega_max, gains.share * a.omega_max, 0.0, 0.0), 0, ToyState(toy.flown + dt)
'''
RANGEFINDER = "\n".join(
    f'[rangefinder.{key}]\nvalue = {value}\nunit = "{unit}"\nsource = "a toy"\n'
    for key, value, unit in (
        ("rate", 50.0, "Hz"), ("delay", 0.02, "s"), ("jitter", 0.001, "s"), ("dropout", 0.0, "-"), ("noise", 0.02, "m"),
    )
)  # fmt: skip
SCREEN = '''"""A toy: one word."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Static

from darko_gcs.tui.containment import StationScreen


class ToyScreen(StationScreen[None]):
    """One word."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "back", "Back")]

    def compose(self) -> ComposeResult:
        """The word."""
        yield Static("toys")
'''
# kind -> new files by path, edits of present ones (text, what stands in its place), a program that uses what is added
ADDITIONS = {
    "a law": (
        {"sitl/control/toy.py": LAW},
        {
            "protocol/dialect/darko.xml": [
                (
                    '      <entry value="9" name="DARKO_LAW_HOVER_ATTITUDE">',
                    '      <entry value="15" name="DARKO_LAW_TOY"><?darko regime="UPRIGHT"?><description>A toy.'
                    '</description></entry>\n      <entry value="9" name="DARKO_LAW_HOVER_ATTITUDE">',
                )
            ],
            "sitl/control/laws.py": [
                (
                    "from sitl.control import align,",
                    "from sitl.control import toy\nfrom sitl.control.toy import ToyGains, ToyState\n"
                    "from sitl.control import align,",
                ),
                ("    course: float  #", "    toy: ToyState\n    course: float  #"),
                ("    wind: WindGains\n", "    wind: WindGains\n    toy: ToyGains = ToyGains(0.7)\n"),
                (
                    '    LawRow(Law.LANDED, landed.step, "zero_moment"),',
                    '    LawRow(Law.TOY, toy.step, "toy"),\n    LawRow(Law.LANDED, landed.step, "zero_moment"),',
                ),
            ],
            "sitl/supervisor/table.py": [
                (
                    "    Law.HOVER_ATTITUDE: (\n",
                    '    Law.TOY: (*_LAND, Jump("enough", Law.HOVER_ZERO_MOMENT, Reason.SPEED, when=(g.dwell_elapsed,),'
                    " resets=(r.point_from_here,))),\n    Law.HOVER_ATTITUDE: (\n",
                )
            ],
        },
        """
from sitl import Law, Simulation, Start, load_airframe
made = Simulation(load_airframe("nominal").parameters, start=Start(up=50.0, airborne=True))
made.begin_flight(Law.TOY)
made.step(0.1)
assert made.law is Law.TOY, made.law
assert abs(made.flight.controller.states.toy.flown - 0.1) < 1e-9
assert made.energy_by_law[Law.TOY] > 0.0
made.step(0.5)
first = made.jumps[0]
assert (first.source, first.target, first.name) == (Law.TOY, Law.HOVER_ZERO_MOMENT, "enough")
""",
    ),
    "a guard": (
        {},
        {
            "sitl/supervisor/guards.py": [
                (
                    "@guard\ndef wind_calm(",
                    '@guard\ndef is_high(estimate: Estimate) -> bool:\n    """A toy."""\n'
                    "    return estimate.position.z > 40.0\n\n\n@guard\ndef wind_calm(",
                )
            ],
            "sitl/supervisor/table.py": [
                (
                    "    Law.HOVER_ATTITUDE: (\n",
                    "    Law.HOVER_ATTITUDE: (\n"
                    '        Jump("too_high", Law.HOVER_ZERO_MOMENT, Reason.SPEED, when=(g.is_high,)),\n',
                )
            ],
        },
        """
from sitl import Law, Simulation, Start, load_airframe
for up, jumps in (30.0, []), (50.0, ["too_high"]):
    made = Simulation(load_airframe("nominal").parameters, start=Start(up=up, airborne=True))
    made.begin_flight(Law.HOVER_ATTITUDE)
    made.step(0.01)
    assert [jump.name for jump in made.jumps if jump.name == "too_high"] == jumps, made.jumps
""",
    ),
    "a sensor": (
        {"sitl/sensors/data/rangefinder.toml": RANGEFINDER},
        {
            "sitl/sensors/instruments.py": [
                ("EXTERNAL_POSE = range(8)\nINSTRUMENTS = 8", "EXTERNAL_POSE, RANGEFINDER = range(9)\nINSTRUMENTS = 9"),
                ("AIDS = 4 ", "RANGE_NOISE = 21\nAIDS = 5 "),
                ("JITTER, DROPOUT = 21, 21 + AIDS", "JITTER, DROPOUT = 22, 22 + AIDS"),
                (
                    "class SensorSet(NamedTuple):",
                    'class Rangefinder(NamedTuple):\n    """Height above the ground."""\n\n    timing: Timing\n'
                    "    noise: float  # [m]\n\n\nclass SensorSet(NamedTuple):",
                ),
                ("    battery: BatteryMonitor\n", "    battery: BatteryMonitor\n    rangefinder: Rangefinder\n"),
            ],
            "sitl/sensors/aiding.py": [
                ("    PITOT_NOISE,\n", "    PITOT_NOISE,\n    RANGE_NOISE,\n    RANGEFINDER,\n"),
                (
                    "    timing = spec.gnss.timing\n",
                    "    timing = spec.rangefinder.timing\n"
                    "    if reads(period, timing, failures[RANGEFINDER], draws[DROPOUT + 4], dt):\n"
                    "        height = plant.body.position.z + spec.rangefinder.noise * draws[RANGE_NOISE]\n"
                    "        i.last[RANGEFINDER - FIRST_DELAYED, 0] = height\n"
                    "        _dispatch(i, RANGEFINDER, period, timing, draws[JITTER + 4], dt)\n"
                    "    timing = spec.gnss.timing\n",
                ),
            ],
            "sitl/estimation/observations.py": [
                (
                    "    POSITION_VARIANCE,\n    Instruments,",
                    "    POSITION_VARIANCE,\n    RANGEFINDER,\n    Instruments,",
                ),
                (
                    "    elif instrument == GNSS:\n",
                    "    elif instrument == RANGEFINDER:\n"
                    "        noise = i.specification.rangefinder.noise\n"
                    "        sum_of_errors(f.H, POSITION_ERROR + 2, NO_OTHER)\n"
                    "        ratio = fuse(f, 0, reading[0] - f.nominal.position.z, noise * noise)\n"
                    "        correct_nominal(f)\n"
                    "        note(f, line, period, Agreement(ratio, ratio, 1), True)\n"
                    "    elif instrument == GNSS:\n",
                ),
            ],
        },
        """
from sitl import Law, Navigation, Simulation, Start, load_airframe
from sitl.sensors.instruments import FIRST_DELAYED, RANGEFINDER
start = Start(up=50.0, airborne=True)
made = Simulation(load_airframe("nominal").parameters, start=start, navigation=Navigation.SENSORS)
made.begin_flight(Law.HOVER_ZERO_MOMENT)
made.step(0.25)
assert made.avionics.filter["fused_at"][RANGEFINDER - FIRST_DELAYED] > 0
assert abs(made.estimate.position.z - made.truth.body.position.z) < 0.1
""",
    ),
    "a message": (
        {},
        {
            "protocol/dialect/darko.xml": [
                (
                    '    <message id="53006" name="DARKO_TRUTH">',
                    '    <message id="53090" name="DARKO_TOY">\n      <description>A toy.</description>\n'
                    '      <field type="float" name="lean" units="rad">Off upright.</field>\n    </message>\n'
                    '    <message id="53006" name="DARKO_TRUTH">',
                )
            ],
            "sitl/mavlink/telemetry/hybrid_state.py": [
                (
                    "@HYBRID_STREAMS.sends(mavlink.MAVLINK_MSG_ID_DARKO_AIR, 5.0)\n",
                    "@HYBRID_STREAMS.sends(mavlink.MAVLINK_MSG_ID_DARKO_TOY, 5.0)\n"
                    "def toy(s: VehicleSnapshot) -> Message:\n"
                    '    """A toy."""\n    return mavlink.MAVLink_darko_toy_message(lean=0.25)\n\n\n'
                    "@HYBRID_STREAMS.sends(mavlink.MAVLINK_MSG_ID_DARKO_AIR, 5.0)\n",
                )
            ],
            "darko_gcs/state/parts.py": [
                ("    air: Air | None = None\n", "    air: Air | None = None\n    lean: float | None = None  # [rad]\n")
            ],
            "darko_gcs/state/reduce_telemetry.py": [
                (
                    '@DARKO_HANDLERS.handles("DARKO_AIR")\n',
                    '@DARKO_HANDLERS.handles("DARKO_TOY")\n'
                    "def _toy(s: Snapshot, m: Message, _now: float) -> Snapshot:\n"
                    "    return s._replace(estimates=s.estimates._replace(lean=m.lean))\n\n\n"
                    '@DARKO_HANDLERS.handles("DARKO_AIR")\n',
                )
            ],
        },
        """
from darko_gcs.state.reduce import reduce
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT
from protocol.dialect import mavlink
from sitl.mavlink.telemetry.telemetry_service import BUILDERS, STREAMS
number = mavlink.MAVLINK_MSG_ID_DARKO_TOY
assert [s.rate for s in STREAMS if s.message_id == number] == [5.0]
sent = BUILDERS[number](None)
sent.pack_fields()
assert reduce(EMPTY_SNAPSHOT, sent, 0.0).estimates.lean == 0.25
""",
    ),
    "a screen": (
        {"darko_gcs/tui/screens/toy_screen.py": SCREEN},
        {
            "darko_gcs/tui/actions.py": [
                (
                    '    Action(\n        key="C", name="charts"',
                    '    Action(key="U", name="toys", label="", short="Toys", help="Toys: see them",\n'
                    "           needs_vehicle=False,\n"
                    '           run=lambda app: app.show_toys()),\n    Action(\n        key="C", name="charts"',
                )
            ],
            "darko_gcs/tui/app.py": [
                (
                    "from darko_gcs.tui.screens.messages_screen import MessagesScreen\n",
                    "from darko_gcs.tui.screens.messages_screen import MessagesScreen\n"
                    "from darko_gcs.tui.screens.toy_screen import ToyScreen\n",
                ),
                (
                    "    def show_messages(self) -> None:\n",
                    '    def show_toys(self) -> None:\n        """A toy."""\n        self._open(ToyScreen())\n\n'
                    "    def show_messages(self) -> None:\n",
                ),
            ],
            "darko_gcs/tui/palette.py": [
                (
                    "from darko_gcs.tui.screens.messages_screen import MessagesScreen\n",
                    "from darko_gcs.tui.screens.messages_screen import MessagesScreen\n"
                    "from darko_gcs.tui.screens.toy_screen import ToyScreen\n",
                ),
                (
                    '    "messages": (MessagesScreen',
                    '    "toys": (ToyScreen, "Toys"),\n    "messages": (MessagesScreen',
                ),
            ],
        },
        """
import asyncio
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.screens.toy_screen import ToyScreen
from tests.support.gcs.screens import FakeFeed, screen_text, until
from tests.support.gcs.snapshots import HOVERING

async def main():
    app = GroundStationApp(FakeFeed(HOVERING))
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("U")
        await until(pilot, lambda: isinstance(app.screen, ToyScreen) and "toys" in screen_text(app))

asyncio.run(main())
""",
    ),
}


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    """A copy of what a program needs of the source."""
    root = tmp_path_factory.mktemp("source")
    for name in ("sitl", "protocol", "darko_gcs", "scripts", "tests/support", "tests/data"):
        shutil.copytree(ROOT / name, root / name, ignore=shutil.ignore_patterns("__pycache__", "bench", "mutation"))
    return root


def run(code, root):
    # In plain Python: what is tested is the wiring, and the compiler would take a quarter of a minute for it.
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": str(root)}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=root, env=environment, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.long
@pytest.mark.parametrize("kind", ADDITIONS)
def test_it_is_added_by_at_most_four_files(kind, copied):
    new, edits, program = ADDITIONS[kind]
    assert len(new) + len(edits) <= MOST_FILES
    before = {file: (copied / file).read_text(encoding="utf-8") for file in (*edits, *GENERATED)}
    try:
        for file, text in new.items():
            (copied / file).write_text(text, encoding="utf-8")
        for file, changes in edits.items():
            text = before[file]
            for old, put in changes:
                assert text.count(old) == 1, (file, old)
                text = text.replace(old, put)
            (copied / file).write_text(text, encoding="utf-8")
        if "protocol/dialect/darko.xml" in edits:
            run(GENERATE, copied)
        run(program, copied)
    finally:
        for file, text in before.items():
            (copied / file).write_text(text, encoding="utf-8")
        for file in new:
            (copied / file).unlink()
