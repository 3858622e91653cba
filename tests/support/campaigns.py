"""Small campaigns for tests: the laws alone, by the truth, for fractions of a second."""

from __future__ import annotations

import tomllib
from pathlib import Path

from sitl.lab.campaigns.specification import Specification, specification_of

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
