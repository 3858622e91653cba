"""The filter sees what the instruments read: no module of it can reach the plant but the two whose task that is."""

import ast
import math
from pathlib import Path

import pytest

from protocol.dialect.vocabulary import Law
from sitl.control.estimate import Estimate
from sitl.estimation.filter import Filter
from sitl.sensors.instruments import Instruments
from sitl.simulation.dispatch import COMPILED, REGISTER
from sitl.simulation.flight import Flight
from tests.support.digests.flight_digest import flights
from tests.support.flat import paths_of

ROOT = Path(__file__).parents[3]
SEE_THE_PLANT = {"sensing.py", "__init__.py"}
FILTER = sorted(path for path in (ROOT / "sitl" / "estimation").rglob("*.py") if path.name not in SEE_THE_PLANT)
NAMES = {
    "Plant", "Body", "Feet", "Foot", "Flight", "Environment", "Simulation", "HiddenErrors", "get_errors",
    "put_gnss_drift", "observe", "read_inertial", "read_tube", "read_outdoors", "read_pose",
}  # fmt: skip
MODULES = ("sitl.simulation", "sitl.model.plant", "sitl.model.ground", "sitl.model.gusts", "sitl.sensors.hidden_errors",
           "sitl.sensors.aiding", "sitl.sensors.inertial")  # fmt: skip
PARAMETERS = {"plant", "truth", "flight", "simulation", "vehicle", "environment", "air", "body", "errors_of"}
KEYS = {"errors", "plant"}  # of the instruments' record: what is wrong with them is told to nobody
FLIGHTS = flights()
by_file = pytest.mark.parametrize("path", FILTER, ids=lambda path: path.name)


def tree(path):
    return ast.parse(path.read_text(encoding="utf-8"))


@by_file
def test_a_module_of_the_filter_names_nothing_that_knows_the_truth(path):
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.ImportFrom):
            assert {alias.name for alias in node.names} & NAMES == set()
            assert not node.module.startswith(MODULES)
            assert not {f"{node.module}.{alias.name}" for alias in node.names} & set(MODULES)
        elif isinstance(node, ast.Import):
            assert not any(alias.name.startswith(MODULES) for alias in node.names)
        elif isinstance(node, ast.FunctionDef):
            assert {argument.arg for argument in (*node.args.args, *node.args.kwonlyargs)} & PARAMETERS == set()


@by_file
def test_of_the_instruments_record_no_hidden_error_is_taken(path):
    """The filter's own record has estimated errors, by the same key: ``f["errors"]``."""
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and node.value.id != "f":
            key = node.slice.value if isinstance(node.slice, ast.Constant) else None
            assert key not in KEYS, f"{path.name}:{node.lineno}"


def test_the_inspection_finds_what_it_looks_for():
    names = {alias.name for node in ast.walk(tree(ROOT / "sitl" / "estimation" / "sensing.py"))
             if isinstance(node, ast.ImportFrom) for alias in node.names}  # fmt: skip
    assert "Plant" in names & NAMES
    assert len(FILTER) >= 9


def test_neither_the_filter_s_record_nor_the_estimate_has_room_for_a_plant():
    places = [path for kind in (Filter, Estimate) for path in paths_of(kind)]
    assert not [path for path in places if "plant" in path or "truth" in path or "feet" in path]
    assert any(".errors.gyro_bias" in path for path in paths_of(Instruments))  # where they are, for comparison


def poisoned(flight):
    """A copy of a flight's record in which no number of plant, gust or energy is one."""
    bad = flight.copy()
    for path in paths_of(Flight):
        *folders, name = path.split(".")[1:]
        if folders[:1] == ["plant"] or (folders or [name])[0] in ("gust", "energy"):
            part = bad
            for folder in folders:
                part = part[folder]
            part[name] = NONSENSE[part.dtype[name].kind]
    return bad


NONSENSE = {"f": math.nan, "b": True, "i": -1}


@pytest.mark.parametrize("name", FLIGHTS)
def test_a_poisoned_plant_changes_nothing_that_laws_guards_and_resets_do(name):
    """The generated functions as plain Python, on flights of every law."""
    made = FLIGHTS[name]
    reference, design = made._arrays.references[0], made._arrays.designs[0]

    def done(flight):
        law = int(flight["controller"]["law"])
        told = [COMPILED.values(flight, reference, design), COMPILED.seek(law, flight, reference, design)]
        COMPILED.tick(law, flight, reference, design)
        told.append(flight["controller"].tobytes())
        if len(REGISTER.table[made.law]) > 0:
            COMPILED.jump(law, 0, flight, reference, design)
        return [*told, flight["controller"].tobytes()]

    clean, bad = made._arrays.flights[0].copy(), poisoned(made._arrays.flights[0])
    assert math.isnan(bad["plant"]["body"]["position"]["x"])
    assert done(bad) == done(clean)


def test_they_are_flights_of_every_law():
    assert {made.law for made in FLIGHTS.values()} == set(Law)
