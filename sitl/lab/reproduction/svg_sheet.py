"""Figures as SVG whose text and axes take the colour of the page around them, for light and dark themes."""

from __future__ import annotations

import io
import re
from types import TracebackType
from typing import TYPE_CHECKING, Any

from sitl import Array
from sitl.tools.plotting import blank_page, require_matplotlib

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.typing import RcKeyType

INK = "#010203"  # stands for the page's text colour
COLOURS = ("#3b82c4", "#e07b39", "#3fa66b", "#c0508f", "#8f7ad1", "#a08a2c")  # legible on white and on near-black
MAX_POINTS = 700  # per line: more than the pixels it is shown on
PLOT_STYLE: dict[RcKeyType, Any] = {
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
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


class SvgSheet:
    """A figure of a few plots above one another, drawn in the style of the page.

    A context manager that gives matplotlib's axes; afterwards ``svg`` holds the drawing.

    Raises:
        MissingMatplotlibError: If matplotlib is not installed.
    """

    def __init__(self, name: str, rows: int = 1, *, columns: int = 1, height: float = 2.2, share: bool = True) -> None:
        require_matplotlib()
        import matplotlib as mpl  # noqa: PLC0415 - two seconds that only figures need
        from cycler import cycler  # noqa: PLC0415 - installed with matplotlib

        self._style = mpl.rc_context(PLOT_STYLE | {"axes.prop_cycle": cycler(color=COLOURS), "svg.hashsalt": name})
        self._size = (7.4, height * rows + 0.3)
        self._grid = (rows, columns, share)
        self.name, self.svg = name, ""

    def __enter__(self) -> list[Axes]:
        self._style.__enter__()
        rows, columns, share = self._grid
        self.page = blank_page(*self._size)
        grid = self.page.subplots(rows, columns, sharex=share, squeeze=False)
        return [axis for row in grid for axis in row]

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        if kind is None:
            self.svg = _inline(self.page)
        self._style.__exit__(kind, error, where)


def _inline(page: Figure) -> str:
    """The figure as a bare <svg> element: no prologue, no metadata, text and axes in the page's colour."""
    out = io.StringIO()
    page.savefig(out, format="svg", transparent=True, metadata={"Date": None})
    text = out.getvalue()
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text[text.index("<svg") :], flags=re.DOTALL)
    text = re.sub(r'(<svg [^>]*?) width="[^"]*"', r"\1", re.sub(r'(<svg [^>]*?) height="[^"]*"', r"\1", text, count=1))
    text = re.sub(r'<g id="[^"]*"', "<g", text)  # matplotlib counts from one in every figure
    return text.replace(INK, "currentColor")


def thin(*arrays: Array) -> tuple[Array, ...]:
    """Every n-th row of each array, so that about ``MAX_POINTS`` remain."""
    step = max(1, arrays[0].shape[0] // MAX_POINTS)
    return tuple(array[::step] for array in arrays)
