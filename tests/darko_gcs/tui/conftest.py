"""Every error of a screen fails the test that has it."""

import pytest

from darko_gcs.tui.containment import ContainingApp


@pytest.fixture(autouse=True)
def nothing_is_contained(monkeypatch):
    """The station goes on after an error, and would hide it."""
    monkeypatch.setattr(ContainingApp, "contain", lambda *_args, **_options: False)
