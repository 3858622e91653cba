"""Every error of a screen fails the test that has it."""

import pytest

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
