"""The panel with the artificial horizon."""

from __future__ import annotations

import math

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.render.horizon import heading_tape, horizon
from darko_gcs.tui.widgets.panel import Panel, styled_line
from protocol.frames import (
    SHOW_AS_TOLD,
    SHOW_PITCHED_DOWN,
    Quaternion,
    displayed,
    euler_from_quaternion,
    rotate,
)

__all__ = ["AttitudePanel", "display_offset"]

NOSE = (1.0, 0.0, 0.0)  # in the body frame
HALF_PITCHED = math.sin(math.pi / 4.0)  # how far down the nose of a display points that is pitched by half of 90 deg
MAX_BANK_ELEVATION = 75.0  # nose elevation above which a bank angle means nothing [deg]


def display_offset(s: Snapshot) -> Quaternion:
    """Rotation of the attitude for display: the vehicle's offset in hover, none in forward flight.

    It changes once per transition, at its end, when the nose is where the new view has its level. A tail-sitter that
    sends no offset is shown pitched down in hover, any other vehicle as it flies.
    """
    if s.is_forward:
        return SHOW_AS_TOLD
    if s.repr_offset is not None:
        return s.repr_offset
    return SHOW_PITCHED_DOWN if s.tells_hover_frame else SHOW_AS_TOLD


class AttitudePanel(Panel):
    """Horizon, heading tape and nose elevation; the title says if the view is that of the hover (level is nose-up)."""

    def watch_snapshot(self) -> None:
        """Show a new snapshot, with the view named in the title."""
        title = "Attitude: nose-up is level" if _is_hover_view(self.snapshot) else "Attitude"
        if self.border_title != title:
            self.border_title = title
        super().watch_snapshot()

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """Heading tape, horizon, one line of angles."""
        if s.q is None:
            return [styled_line(("no attitude", "dim"))]
        return [
            heading_tape(s.heading or 0.0, width),
            *horizon(displayed(s.q, display_offset(s)), width=width, height=max(1, height - 2)),
            _angles(s.q, hover=_is_hover_view(s)),
        ]


def _is_hover_view(s: Snapshot) -> bool:
    return rotate(display_offset(s), NOSE)[2] > HALF_PITCHED


def _angles(q: Quaternion, *, hover: bool) -> StyledLine:
    elevation = math.degrees(math.asin(max(-1.0, min(1.0, -rotate(q, NOSE)[2]))))
    nose = styled_line(("nose ", "label"), f"{elevation:+.0f}°")
    if hover:
        return [*nose, ("  tilt ", "label"), (f"{90.0 - elevation:.0f}°", "")]
    bank = f"{math.degrees(euler_from_quaternion(q)[0]):+.0f}°" if abs(elevation) < MAX_BANK_ELEVATION else "--"
    return [*nose, ("  bank ", "label"), (bank, "")]
