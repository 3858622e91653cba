"""Runs an app of the screens in the terminal, and says on stderr how it ended if it did so by an error."""

from __future__ import annotations

import sys

from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.flight_dialogs import armed_words

EXIT_CRASHED = 1  # as Python's after an error that nobody expected


def run_screens(app: GroundStationApp) -> int:
    """Run an app until the operator quits; returns the exit code.

    Raises:
        GroundError: It could not begin.
    """
    code = app.run()
    if app.failure is not None:
        raise app.failure
    if not app.crash:
        return code or app.return_code or 0
    print(f"darko-gcs: ended by an error of its own: {app.crash}; {app.errors.words}", file=sys.stderr)
    if app.feed.station is not None and (armed := armed_words(app.feed)):
        print(f"darko-gcs: {armed} {_fate(app)}", file=sys.stderr)
    return EXIT_CRASHED


def _fate(app: GroundStationApp) -> str:
    """Words for the fate of an armed vehicle without its ground station."""
    if app.feed.restart is not None:
        return "Its simulator, started by --sitl, was stopped with the ground station."
    return "It flies on and acts on the lost link (NAV_DLL_ACT); start darko-gcs again to take it back."
