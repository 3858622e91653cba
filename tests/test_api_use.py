"""The laboratory takes whatever the public API exports from there, not from below it."""

import ast
from pathlib import Path

import pytest

import sitl

ROOT = Path(__file__).parent.parent
USERS = sorted((ROOT / "sitl" / "lab").rglob("*.py"))
EXPORTED = {(module, "load" if name == "load_airframe" else name) for name, module in sitl._NAMES.items()}


@pytest.mark.parametrize("path", USERS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_public_names_are_imported_from_the_public_api(path):
    imports = [node for node in ast.parse(path.read_text(encoding="utf-8")).body if isinstance(node, ast.ImportFrom)]
    below = [(node.module, alias.name) for node in imports for alias in node.names]
    assert not EXPORTED & set(below)
