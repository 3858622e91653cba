"""The panel with the artificial horizon."""

from __future__ import annotations

import math

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.render.horizon import heading_tape, horizon
from darko_gcs.tui.render.tape import tape
from darko_gcs.tui.widgets.panel import Panel, styled_line
from protocol.frames import SHOW_AS_TOLD, SHOW_PITCHED_DOWN, Quaternion, displayed, euler_from_quaternion, rotate

NOSE = (1.0, 0.0, 0.0)  # in the body frame
TAPE_WIDTH = 9  # [cells]
TAPES_WIDTH, TAPE_ROWS = 34, 7  # of a panel that has room for both tapes [cells]
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
    """Horizon, heading tape and nose elevation; the title says if the view is that of the hover (level is nose-up).

    Where there is room, tapes of airspeed and height stand beside the horizon.
    """

    SOURCES = ("ATTITUDE_QUATERNION", "ATTITUDE")

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
        rows = max(1, height - 2)
        tapes = width >= TAPES_WIDTH and rows >= TAPE_ROWS
        view = horizon(displayed(s.q, display_offset(s)), width=width - 2 * TAPE_WIDTH * tapes, height=rows)
        if tapes:
            left, right = self._speed(s, rows), self._height(s, rows)
            view = [[*a, *b, *c] for a, b, c in zip(left, view, right, strict=True)]
        return [heading_tape(s.heading or 0.0, width), *view, _angles(s.q, hover=_is_hover_view(s))]

    def _speed(self, s: Snapshot, rows: int) -> list[StyledLine]:
        title = self.age_text(s, "VFR_HUD") or "air m/s"
        return tape(s.airspeed, title=title, per_row=0.5, width=TAPE_WIDTH, height=rows, least=0.0)

    def _height(self, s: Snapshot, rows: int) -> list[StyledLine]:
        height = s.relative_altitude if s.from_home is None else -s.from_home[2]
        title = self.age_text(s, "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT") or "height m"
        return tape(height, title=title, per_row=0.5, width=TAPE_WIDTH, height=rows)


def _is_hover_view(s: Snapshot) -> bool:
    return rotate(display_offset(s), NOSE)[2] > HALF_PITCHED


def _angles(q: Quaternion, *, hover: bool) -> StyledLine:
    elevation = math.degrees(math.asin(max(-1.0, min(1.0, -rotate(q, NOSE)[2]))))
    nose = styled_line(("nose ", "label"), f"{elevation:+.0f}°")
    if hover:
        return [*nose, ("  tilt ", "label"), (f"{90.0 - elevation:.0f}°", "")]
    bank = f"{math.degrees(euler_from_quaternion(q)[0]):+.0f}°" if abs(elevation) < MAX_BANK_ELEVATION else "--"
    return [*nose, ("  bank ", "label"), (bank, "")]
