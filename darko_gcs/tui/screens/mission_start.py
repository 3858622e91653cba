"""Start of a mission from the mission screen: from its current item, from the one chosen, or on at the one chosen."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from textual.app import App

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.station.station import Station
from darko_gcs.tui.actions import start_question
from darko_gcs.tui.screens.dialogs import Named, confirm
from protocol.dialect import mavlink

__all__ = ["ask_continue_at", "ask_fly_from", "ask_start"]

Clock = Callable[[], float]


def ask_start(app: App[Any], named: Named, s: Snapshot, station: Station, clock: Clock) -> None:
    """Begin the mission, or go on with it: the same as on the flight screen."""
    confirm(app, named(start_question(s)), lambda: station.plans.start_mission(clock()))


def ask_fly_from(app: App[Any], named: Named, s: Snapshot, station: Station, clock: Clock, row: int) -> None:
    """Fly the mission from an item, also if it is not flown now."""
    left = f" This interrupts item {s.mission_current}." if s.mission_state == mavlink.MISSION_STATE_ACTIVE else ""
    which = {1: "Item 0 is", 2: "Items 0 and 1 are"}.get(row, f"Items 0 to {row - 1} are")
    skipped = f" {which} skipped." if row else ""
    question = named(f"Fly the mission from item {row}?{skipped}{left}")
    confirm(app, question, lambda: station.plans.start_mission(clock(), first=row))


def ask_continue_at(app: App[Any], named: Named, station: Station, clock: Clock, row: int) -> None:
    """Continue the mission at an item."""
    question = named(f"Continue the mission at item {row}?")
    confirm(app, question, lambda: station.plans.set_current(row, clock()))
