"""Plots of quantities of a log: as text for the terminal, or as a picture."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from darko_gcs.errors import GroundError
from darko_gcs.logs.log_selection import Selection
from protocol.flight_log.field_expressions import pieces, with_gaps

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
    for times, values, name, unit in zip(
        selection.times, selection.values, selection.names, selection.units, strict=True
    ):
        label: str | None = f"{name} [{unit}]" if unit else name
        for piece in pieces(times):
            plotext.plot(times[piece].tolist(), values[piece].tolist(), label=label)
            label = None  # one entry for all pieces
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

    units = list(dict.fromkeys(selection.units))  # a scale for each: degrees and metres have none in common
    page = Figure(figsize=(9.0, 3.0 + 1.5 * len(units)), layout="constrained")
    axes = page.subplots(len(units), 1, sharex=True, squeeze=False)[:, 0]
    for times, values, name, unit in zip(
        selection.times, selection.values, selection.names, selection.units, strict=True
    ):
        axes[units.index(unit)].plot(*with_gaps(times, values), label=name, linewidth=1.0)
    for axis, unit in zip(axes, units, strict=True):
        axis.set(ylabel=f"[{unit}]" if unit else "as expressed")
        axis.grid(alpha=0.3)
        axis.legend()
    axes[0].set(title=title)
    axes[-1].set(xlabel="time [s]")
    try:
        page.savefig(path, dpi=150)
    except OSError as error:
        raise GroundError(f"{path}: cannot be written: {error.strerror}") from error
