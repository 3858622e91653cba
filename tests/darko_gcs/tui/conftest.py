"""Every error of a screen fails the test that has it; pictures of screens do not depend on the moment."""

import pytest
from textual.app import App
from textual.widgets import Input

from darko_gcs.tui.containment import ContainingApp

END_BY = ContainingApp.end_by


@pytest.fixture(autouse=True)
def nothing_is_contained(monkeypatch):
    """The station goes on after an error, or ends by an exit code, and would hide it."""
    errors = []

    def end_by(app, error, where):
        errors.append(error)
        END_BY(app, error, where)

    monkeypatch.setattr(ContainingApp, "contain", lambda *_args, **_options: False)
    monkeypatch.setattr(ContainingApp, "end_by", end_by)
    yield
    for error in errors:
        raise error


@pytest.fixture
def snap_compare(snap_compare, monkeypatch):
    """No cursor blinks, on no screen of the stack, and no notice goes by itself, however long the machine takes."""
    monkeypatch.setattr(Input, "cursor_blink", False)
    monkeypatch.setattr(App, "NOTIFICATION_TIMEOUT", 3600.0)
    return snap_compare
