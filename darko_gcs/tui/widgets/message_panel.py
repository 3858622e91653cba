"""The panel with the newest messages."""

from __future__ import annotations

from textwrap import wrap

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.widgets.panel import Panel, styled_line

SEVERITY_STYLES = ("bad", "bad", "bad", "bad", "warn", "accent", "", "dim")  # by MAV_SEVERITY
MIN_WRAP_WIDTH = 8  # [cells]


def severity_style(severity: int) -> str:
    """Style of a MAV_SEVERITY; a number above debug (7) has that of debug."""
    return SEVERITY_STYLES[min(severity, len(SEVERITY_STYLES) - 1)]


class MessagePanel(Panel):
    """The newest lines of the message log, newest last."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """As many lines as fit; long ones take several rows."""
        rows: list[StyledLine] = []
        for line in s.messages[-height:]:
            room = max(width, MIN_WRAP_WIDTH)
            parts = wrap(line.text, room, subsequent_indent="  ", break_on_hyphens=False) or [""]
            rows += [styled_line((part, severity_style(line.severity))) for part in parts]
        return rows[-height:]
