"""Paths of the test data."""

from pathlib import Path

DATA = Path(__file__).parent.parent / "data"
