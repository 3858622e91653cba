"""Results of the subcommands of ``darko-gcs log``: texts for people, one JSON object for programs."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING, Any

from protocol.tools.command_line import print_json

if TYPE_CHECKING:
    from protocol.tlog import TlogReader
    from protocol.wire.message import Source


def tell(args: argparse.Namespace, words: str, **result: Any) -> None:  # noqa: ANN401 - anything that JSON has
    """Print a result.

    Args:
        args: Whose ``json`` says for whom.
        words: For a person.
        result: For a program, by name.
    """
    if args.json:
        print_json({"ok": True, **result})
    else:
        print(words)


def tell_vehicle(reader: TlogReader, source: Source, name: str) -> None:
    """Say on stderr which vehicle of several is taken."""
    from protocol.flight_log.flight_summary import others_note

    if note := others_note(reader, source):
        print(f"{name}: {note}", file=sys.stderr)


def vehicle_table(reader: TlogReader, source: Source) -> dict[str, Any]:
    """The vehicle that is taken, and the others of the log, for a program."""
    from protocol.flight_log.flight_summary import vehicles

    others = [other for other in vehicles(reader) if other != source]
    return {"vehicle": _ids(source), "other_vehicles": [_ids(other) for other in others]}


def _ids(source: Source) -> dict[str, int]:
    return {"system": source[0], "component": source[1]}
