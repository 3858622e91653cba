"""Figures as SVG that takes its ink from the page it stands in, so that it reads on light and dark."""

from __future__ import annotations

import io
import re
from types import TracebackType
from typing import TYPE_CHECKING, Any

from cycler import cycler

from sitl.model.airframe import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.typing import RcKeyType

INK = "#010203"  # stands for the page's text colour
COLOURS = ("#3b82c4", "#e07b39", "#3fa66b", "#c0508f", "#8f7ad1", "#a08a2c")  # legible on white and on near-black
POINTS = 700  # per line: more than the pixels it is shown on
STYLE: dict[RcKeyType, Any] = {
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.prop_cycle": cycler(color=COLOURS),
    "axes.spines.right": False,
    "axes.spines.top": False,
    "font.family": "sans-serif",
    "font.size": 9.0,
    "grid.color": INK,
    "legend.frameon": False,
    "path.simplify_threshold": 0.4,
    "svg.fonttype": "none",
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
}


class Sheet:
    """A figure of a few plots above one another, drawn in the style of the page.

    Use as a context: inside, ``axes`` are matplotlib's; ``svg`` holds the result afterwards.
    """

    def __init__(self, name: str, rows: int = 1, *, columns: int = 1, height: float = 2.2, share: bool = True) -> None:
        import matplotlib as mpl  # noqa: PLC0415 - two seconds that only figures need

        self._style = mpl.rc_context(STYLE | {"svg.hashsalt": name})
        self._size = (7.4, height * rows + 0.3)
        self._grid = (rows, columns, share)
        self.name, self.svg = name, ""

    def __enter__(self) -> list[Axes]:
        from matplotlib.figure import Figure  # noqa: PLC0415

        self._style.__enter__()
        rows, columns, share = self._grid
        self.page = Figure(figsize=self._size, layout="constrained")
        made = self.page.subplots(rows, columns, sharex=share, squeeze=False)
        return [axis for row in made for axis in row]

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        if kind is None:
            self.svg = _inline(self.page)
        self._style.__exit__(kind, error, where)


def _inline(page: Figure) -> str:
    """The figure as an <svg> element alone: no prologue, no metadata, no colour of its own for ink."""
    out = io.StringIO()
    page.savefig(out, format="svg", transparent=True, metadata={"Date": None})
    text = out.getvalue()
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text[text.index("<svg") :], flags=re.DOTALL)
    text = re.sub(r'(<svg [^>]*?) width="[^"]*"', r"\1", re.sub(r'(<svg [^>]*?) height="[^"]*"', r"\1", text, count=1))
    text = re.sub(r'<g id="[^"]*"', "<g", text)  # matplotlib counts from one in every figure
    return text.replace(INK, "currentColor")


def thin(*arrays: Array) -> tuple[Array, ...]:
    """Every n-th row of each, so that no more than ``POINTS`` remain."""
    step = max(1, arrays[0].shape[0] // POINTS)
    return tuple(array[::step] for array in arrays)
