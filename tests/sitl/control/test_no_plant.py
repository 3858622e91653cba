"""Laws, guards, observers and resets see an estimate, never the plant: by what they import and what they ask for."""

import ast
import inspect
from pathlib import Path
from typing import get_type_hints

import pytest

from sitl.control.laws import LAWS, VALUES
from sitl.simulation.dispatch import REGISTER
from sitl.supervisor.guards import GUARDS
from sitl.supervisor.resets import begin_anew
from sitl.supervisor.table import TABLE

ROOT = Path(__file__).parents[3]
BLIND = sorted([*(ROOT / "sitl" / "control").rglob("*.py"), *(ROOT / "sitl" / "supervisor").rglob("*.py")])
OUT_OF_SIGHT = ("sitl.simulation", "sitl.estimation", "sitl.model.plant", "sitl.model.ground", "sitl.model.gusts")
NAMES = {"Plant", "Feet", "Foot", "Flight", "Environment", "observe", "Simulation"}
PARAMETERS = {"plant", "truth", "flight", "simulation", "vehicle", "environment", "air"}
by_file = pytest.mark.parametrize("path", BLIND, ids=lambda path: f"{path.parent.name}/{path.name}")


def imported(path):
    """Modules that a file imports, and the names it takes from them."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            for alias in node.names:
                yield node.module, alias.name
                yield f"{node.module}.{alias.name}", ""  # a module, perhaps


def module_file(module):
    path = ROOT.joinpath(*module.split("."))
    return next((file for file in (path.with_suffix(".py"), path / "__init__.py") if file.is_file()), None)


def reached(path):
    """Every module of the package that a file imports, and what those import in turn."""
    seen, left = set(), {module for module, _ in imported(path)}
    while left:
        module = left.pop()
        file = module_file(module) if module.startswith("sitl") else None
        if module not in seen and file is not None:
            seen.add(module)
            left |= {inner for inner, _ in imported(file)}
    return seen


def is_out_of_sight(module):
    return any(module == hidden or module.startswith(f"{hidden}.") for hidden in OUT_OF_SIGHT)


@pytest.mark.long(after=1)
@by_file
def test_a_law_or_guard_reaches_nothing_that_knows_the_plant_not_even_by_way_of_others(path):
    # The package itself names its public API, and loads what is asked for alone.
    reachable = reached(path) - {"sitl"}
    assert [module for module in reachable if is_out_of_sight(module)] == []
    assert all(name not in NAMES for _, name in imported(path))


@by_file
def test_no_function_there_takes_or_gives_a_plant(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef):
            arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
            assert {argument.arg for argument in arguments} & PARAMETERS == set(), node.name
            annotations = [argument.annotation for argument in arguments] + [node.returns]
            parts = [part for annotation in annotations if annotation for part in ast.walk(annotation)]
            named = {getattr(part, "id", getattr(part, "attr", "")) for part in parts}
            assert named & NAMES == set(), node.name


def test_what_the_loop_hands_out_is_an_estimate_and_what_the_controller_keeps():
    """Every registered function: laws, Lyapunov values, guards and resets."""
    resets = {reset for jumps in TABLE.values() for jump in jumps for reset in jump.resets} | {begin_anew}
    functions = [row.step for row in LAWS] + [row.value for row in VALUES]
    functions += [guard.test for guard in GUARDS] + [reset.map for reset in resets]
    assert len(functions) > 40
    known = {
        "estimate", "reference", "gains", "a", "dt", "thresholds", "guidance", "law_time", "at_rest", "inhibited",
        "is_armed", "is_flying", "is_landing", "has_crashed", "zero_moment_gains", "hover_attitude_gains",
        "robust_pi_gains",
        *REGISTER.slots, *(row.name for row in VALUES),
    }  # fmt: skip
    asked = {name for function in functions for name in inspect.signature(function).parameters}
    states = [get_type_hints(row.step)["state"] for row in LAWS if "state" in row.step.__annotations__]
    asked |= {slot for state in states for slot in state._fields}
    assert len(states) > 5
    assert asked - {"state"} <= known


def test_the_inspection_would_see_a_plant():
    """The inspection finds that the flight simulation uses the plant."""
    flies = ROOT / "sitl" / "simulation" / "flight.py"
    assert any(is_out_of_sight(module) for module in reached(flies))
    assert any(name in NAMES for _, name in imported(flies))
