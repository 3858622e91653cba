"""Campaigns for tests: small ones, the laws alone by the truth for fractions of a second; cases of shipped ones."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sitl.lab.campaigns.case_flights import ShippedFlight, fly_shipped
from sitl.lab.campaigns.specification import Specification, specification_of
from sitl.lab.studies.seeded_flights import Craft
from sitl.lab.studies.spec_studies import PHASES, craft_changes

SMALL = """
[run]
cases = 12
chunk = 3

[vary]
push = { grid = [0.0, 2.0] }
turn = { uniform = [0.0, "2 * pi"] }
airframe = { relative = 0.1 }

[vehicle]
navigation = "truth"
autopilot = false

[start]
up = 50.0
law = "HOVER_ZERO_MOMENT"

[[order]]
do = "throw"
velocity = ["push * cos(turn)", "push * sin(turn)", 0.0]

[flight]
seconds = 0.2

[measures]
reached = { of = "max(hypot(DARKO_TRUTH.position[0], DARKO_TRUTH.position[1]))", unit = "m" }
stayed = "reached < 0.1"
"""


def small_file(folder: Path, text: str = SMALL) -> Path:
    """A file of it."""
    path = folder / "small.toml"
    path.write_text(text, encoding="utf-8")
    return path


def small(text: str = SMALL, **run: object) -> Specification:
    """A small campaign, its run changed."""
    return specification_of(
        Path("small.toml"), tomllib.loads(text), {f"run.{key}": value for key, value in run.items()}
    )


def shipped(
    name: str, changes: Mapping[str, Any] | None = None, *, seed: int = 1, craft: Craft | None = None
) -> ShippedFlight:
    """The first case of a shipped campaign from a seed on, its file changed; by a craft, if one is given."""
    made = craft_changes(craft) if craft is not None else {}
    return fly_shipped(name, {**made, **(changes or {}), "run.seed": seed})


def failing(unit: str, failure: str, phase: str) -> dict[str, list[Any]]:
    """Changes that leave one failure of one unit in one phase of the campaign of failures."""
    return {
        "vary.unit.grid": [unit],
        "vary.failure.grid": [failure],
        "vary.phase.grid": [phase],
        "vary.phase_number.grid": [PHASES.index(phase)],
    }
