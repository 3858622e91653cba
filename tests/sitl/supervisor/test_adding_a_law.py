"""Adding a law: a module of its own and at most four existing files, counted by adding one to a copy of the source."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]

MODULE = '''"""A toy: full ahead."""

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
# file -> (before which text, what is put there)
EDITS = {
    "protocol/dialect/darko.xml": [
        (
            '      <entry value="9" name="DARKO_LAW_HOVER_ATTITUDE">',
            '      <entry value="15" name="DARKO_LAW_TOY"><?darko regime="UPRIGHT"?>'
            "<description>A toy.</description></entry>\n",
        )
    ],
    "sitl/control/laws.py": [
        (
            "from sitl.control import align,",
            "from sitl.control import toy\nfrom sitl.control.toy import ToyGains, ToyState\n",
        ),
        ("    course: float  #", "    toy: ToyState\n"),
        ("    wind: WindGains", "    toy: ToyGains\n"),
        ('    LawRow(Law.LANDED, landed.step, "zero_moment"),', '    LawRow(Law.TOY, toy.step, "toy"),\n'),
    ],
    "sitl/simulation/tuning.py": [
        ("        wind=wind_gains(),", "        toy=ToyGains(0.7),\n"),
        ("class Tuning(NamedTuple):", "from sitl.control.toy import ToyGains\n\n\n"),
    ],
    "sitl/supervisor/table.py": [
        (
            "    Law.HOVER_ATTITUDE: (\n",
            '    Law.TOY: (*_LAND, Jump("enough", Law.HOVER_ZERO_MOMENT, Reason.SPEED, when=(g.dwell_elapsed,), '
            "resets=(r.point_from_here,))),\n",
        )
    ],
}
FLIGHT = """
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
"""
GENERATE = """
import sys, types
for name in ("hatchling", "hatchling.builders", "hatchling.builders.hooks", "hatchling.builders.hooks.plugin"):
    sys.modules[name] = types.ModuleType(name)
interface = types.ModuleType("hatchling.builders.hooks.plugin.interface")
interface.BuildHookInterface = object
sys.modules[interface.__name__] = interface
sys.path.insert(0, "scripts")
import build_dialect
build_dialect.generate_vocabulary(build_dialect.DIALECT / "darko.xml", build_dialect.DIALECT / "vocabulary.py")
"""


def test_a_law_is_added_by_its_module_and_at_most_four_existing_files(tmp_path: Path) -> None:
    for name in ("sitl", "protocol", "scripts"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "sitl" / "control" / "toy.py").write_text(MODULE, encoding="utf-8")
    for file, edits in EDITS.items():
        path = tmp_path / file
        text = path.read_text(encoding="utf-8")
        for before, added in edits:
            assert text.count(before) == 1, (file, before)
            text = text.replace(before, added + before)
        path.write_text(text, encoding="utf-8")
    # In plain Python: what is tested is the wiring, and the compiler would take a quarter of a minute for it.
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(tmp_path)}
    for code in (GENERATE, FLIGHT):
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120
        )
        assert done.returncode == 0, done.stderr
    assert len(EDITS) <= 4
