"""The panel of the hybrid controller: law in force, Lyapunov values, jumps."""

from __future__ import annotations

import math
from textwrap import wrap

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import label_of
from darko_gcs.state.values import HybridState, Thresholds
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.render.chart import chart_edge, log_chart
from darko_gcs.tui.widgets.panel import Panel, styled_line
from protocol.dialect.vocabulary import Law, Reason
from protocol.names import as_member, law_label

CHART_WINDOW = 60.0  # [s]
MIN_V_SHOWN = 1e-4  # smaller values of V are shown as "<0.0001"
MIN_GOVERNOR_SHOWN = 0.01
MIN_JUMP_WIDTH = 8  # [cells]
LAW_STYLES = dict.fromkeys(Law, "accent") | {
    Law.HOVER_LINEAR: "good",
    Law.FORWARD_LINEAR: "good",
    Law.FAILSAFE: "bad",
    Law.CRASHED: "bad",
}


class HybridPanel(Panel):
    """Law in force, V of both linear laws with their thresholds, and a chart of V with the jumps."""

    SOURCES = ("DARKO_HYBRID_STATE",)
    _chart_key: tuple[object, ...] = ()  # what the chart was drawn for
    _chart: list[StyledLine]

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """Three lines of text, the rest chart."""
        h = s.hybrid
        if h is None:
            return [styled_line(("no vehicle yet" if s.source is None else "no hybrid state from this vehicle", "dim"))]
        jump = _last_jump(h, width)
        height = max(1, height - 2 - len(jump))
        key = (chart_edge(h.time, width, CHART_WINDOW), width, height, h.law, h.hover, h.forward, s.jumps)
        if key != self._chart_key:  # the chart is much work, and moves by a dot twice a second
            self._chart_key, self._chart = key, _chart(s, h, width, height)
        values = styled_line(
            *_v_with_thresholds("hover", h.v_hover, h.hover, "hover"),
            "  ",
            *_v_with_thresholds("fwd", h.v_forward, h.forward, "forward"),
        )
        return [_law(h, s.law_since, width), values, *jump, *self._chart]


def _chart(s: Snapshot, h: HybridState, width: int, height: int) -> list[StyledLine]:
    return log_chart(
        [t for t, _, _ in s.v_history],
        ([v for _, v, _ in s.v_history], "hover", "h"),
        ([v for _, _, v in s.v_history], "forward", "f"),
        width=width,
        height=height,
        window=CHART_WINDOW,
        thresholds=_labelled("forward", h.forward) if h.is_forward else _labelled("hover", h.hover),
        jumps=tuple((jump.time, jump.name.replace("_", " ")) for jump in s.jumps),
        now=h.time,
    )


def _law(h: HybridState, law_since: float | None, width: int) -> StyledLine:
    """The law in force, for how long, its V, and what the governor does; V is also in the next line."""
    since = f" {max(h.time - law_since, 0.0):.0f} s" if law_since is not None else ""
    law = as_member(Law, h.law)
    style = "warn" if law is None else LAW_STYLES[law]
    governor = (f"  governor {100 * h.governor:.0f} %", "accent") if h.governor > MIN_GOVERNOR_SHOWN else ("", "")
    name = law_label(h.law).upper()
    v = [("  V ", "label"), (_v_text(h.v), "")]
    if len(name) + len(since) + len(governor[0]) + sum(len(text) for text, _ in v) > width:
        v = []
    return styled_line((name, style), (since, "dim"), *v, governor)


def _last_jump(h: HybridState, width: int) -> list[StyledLine]:
    """The number of jumps and the last one with its cause, in two lines if one has no room."""
    if h.jumps == 0:
        return [styled_line(("no jump yet", "dim"))]
    text = f"jump {h.jumps} from {law_label(h.last_law)}: {label_of(Reason, h.last_reason)}"
    return [styled_line((line, "dim")) for line in wrap(text, max(width, MIN_JUMP_WIDTH))[:2]]


def _v_text(v: float) -> str:
    """V in at most four digits."""
    if not math.isfinite(v):
        return "--"
    if v < MIN_V_SHOWN:
        return f"<{MIN_V_SHOWN:g}"
    return f"{v:.2g}" if v < 10 else f"{v:.0f}"


def _labelled(law: str, thresholds: Thresholds) -> tuple[tuple[float, str, str], ...]:
    """Both thresholds of a linear law, with its name and style."""
    return (
        (thresholds.leave, f"{law} leave {thresholds.leave:g}", law),
        (thresholds.enter, f"{law} enter {thresholds.enter:g}", law),
    )


def _v_with_thresholds(name: str, v: float, thresholds: Thresholds, style: str) -> StyledLine:
    text = f" ({thresholds.enter:g}/{thresholds.leave:g})"
    return styled_line((f"{name} ", style), _v_text(v), (text, "dim"))
