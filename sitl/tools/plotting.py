"""Pages of plots: the one place that loads matplotlib, which is an optional dependency."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from sitl.errors import SitlError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLOT_FORMATS = (".png", ".svg", ".pdf")


class MissingMatplotlibError(SitlError):
    """Matplotlib is not installed."""

    def __init__(self) -> None:
        super().__init__("plotting needs matplotlib: pip install 'darko[plots]'")


def check_plot_path(path: Path) -> None:
    """Refuse a plot that could not be written, before the work for it is done.

    Raises:
        MissingMatplotlibError: If matplotlib is not installed.
        SitlError: If the folder does not exist or the suffix names no format.
    """
    require_matplotlib()
    if not path.parent.is_dir():
        raise SitlError(f"plot {path}: there is no folder {path.parent}")
    if path.suffix not in PLOT_FORMATS:
        raise SitlError(f"plot {path}: the name must end in {', '.join(PLOT_FORMATS)}")


def require_matplotlib() -> None:
    """Check that plots can be drawn, without loading matplotlib.

    Raises:
        MissingMatplotlibError: If it is not installed.
    """
    if find_spec("matplotlib") is None:
        raise MissingMatplotlibError


def blank_page(width: float, height: float) -> Figure:
    """An empty page of a size [inch].

    Raises:
        MissingMatplotlibError: If matplotlib is not installed.
    """
    require_matplotlib()
    from matplotlib.figure import Figure  # noqa: PLC0415 - two seconds that only plots need

    return Figure(figsize=(width, height), layout="constrained")


def save_page(page: Figure, path: Path, dpi: int) -> None:
    """Write a page; the suffix of the path chooses the format.

    Raises:
        SitlError: If the file cannot be written; the message names it.
    """
    try:
        page.savefig(path, dpi=dpi)
    except (OSError, ValueError) as error:
        raise SitlError(f"plot {path}: {error}") from error
