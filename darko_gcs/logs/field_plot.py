"""Plots of quantities of a log: as text for the terminal, or as a picture."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from darko_gcs.errors import GroundError
from darko_gcs.logs.log_selection import Selection

__all__ = ["PICTURES", "save_picture", "text_plot"]

PICTURES = (".png", ".svg", ".pdf")


def text_plot(selection: Selection, width: int, height: int) -> str:
    """A plot made of characters.

    Args:
        selection: What to draw.
        width: [columns].
        height: [lines].

    Raises:
        GroundError: Plotext is not installed.
    """
    if find_spec("plotext") is None:
        raise GroundError("plots in the terminal need plotext: pip install 'darko[plots]'")
    import plotext  # noqa: PLC0415 - only plots need it

    plotext.clear_figure()
    plotext.theme("clear")
    plotext.plot_size(width, height)
    for times, values, name in zip(selection.times, selection.values, selection.names, strict=True):
        plotext.plot(times.tolist(), values.tolist(), label=name)
    plotext.xlabel("time [s]")
    return str(plotext.uncolorize(plotext.build()))


def save_picture(selection: Selection, path: Path, title: str) -> None:
    """Write a picture; the suffix of the path chooses the format.

    Raises:
        GroundError: Matplotlib is not installed, the suffix names no format, or the file cannot be written.
    """
    if path.suffix not in PICTURES:
        raise GroundError(f"{path}: the name must end in {', '.join(PICTURES)}")
    if find_spec("matplotlib") is None:
        raise GroundError("pictures need matplotlib: pip install 'darko[plots]'")
    from matplotlib.figure import Figure  # noqa: PLC0415 - two seconds that only pictures need

    page = Figure(figsize=(9.0, 4.5), layout="constrained")
    axis = page.add_subplot()
    for times, values, name in zip(selection.times, selection.values, selection.names, strict=True):
        axis.plot(times, values, label=name, linewidth=1.0)
    axis.set(xlabel="time [s]", title=title)
    axis.grid(alpha=0.3)
    axis.legend()
    try:
        page.savefig(path, dpi=150)
    except OSError as error:
        raise GroundError(f"{path}: cannot be written: {error.strerror}") from error
