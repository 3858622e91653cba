"""The operator's message log: one line per text, and STATUSTEXT chunks joined to one line."""

from __future__ import annotations

from darko_gcs.state.snapshot import Snapshot, updated
from darko_gcs.state.text import printable
from darko_gcs.state.values import LogLine, OpenText
from protocol.wire.message import Message, source_of

MAX_LINES = 300  # of the log; the oldest go first


def add_line(s: Snapshot, now: float, severity: int, text: str) -> Snapshot:
    """The snapshot with one more line in its log, without characters that could control a terminal.

    Args:
        s: The snapshot before.
        now: Time of the line, on the caller's clock [s].
        severity: MAV_SEVERITY.
        text: The line.
    """
    return updated(s, messages=(*s.messages[-MAX_LINES + 1 :], LogLine(now, severity, printable(text))))


def add_status_text(s: Snapshot, message: Message, now: float) -> Snapshot:
    """The snapshot after a STATUSTEXT: a new line, or the next chunk of the last line."""
    key, last = (source_of(message)[1], message.id, message.chunk_seq), s.open_text
    if message.id and last is not None and key == last[:3] and s.messages and s.messages[-1] is last.line:
        line = last.line._replace(text=last.line.text + printable(message.text))
        s = updated(s, messages=(*s.messages[:-1], line))
    else:
        s = add_line(s, now, message.severity, message.text)
    return updated(s, open_text=OpenText(key[0], message.id, message.chunk_seq + 1, s.messages[-1]))
