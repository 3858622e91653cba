"""Plots and diagrams."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from sitl.errors import SitlError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# Pages of plots: the one place that loads matplotlib, which is an optional dependency.

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


# A table of jumps drawn as a Mermaid state diagram, for the documentation.


Mode = TypeVar("Mode", bound=Hashable)
FEW_MODES = 2  # that each draw a jump they share, be they most of the table


def mermaid(table: Mapping[Mode, tuple[Any, ...]], label: Callable[[Mode], str] = str) -> str:
    """The table, from each mode to its ordered jumps, as a Mermaid state diagram.

    Jumps between the same two modes share an arrow, in the order of the table. A jump that most modes have is drawn
    once, from a state that names the others.
    """
    sources: dict[tuple[str, str], list[str]] = {}
    for mode, jumps in table.items():
        for jump in jumps:
            sources.setdefault((jump.name, label(jump.target)), []).append(label(mode))
    groups: dict[str, str] = {}  # names of states that stand for most modes, by what they say
    arrows: dict[tuple[str, str], list[str]] = {}
    for (name, target), modes in sources.items():
        begins = modes
        if len(modes) > max(FEW_MODES, len(table) / 2):
            others = ", ".join(label(mode) for mode in table if label(mode) not in modes)
            begins = [groups.setdefault(f"all but {others}" if others else "all", f"most{len(groups) + 1}")]
        for begin in begins:
            arrows.setdefault((begin, target), []).append(name)
    lines = [f'    state "{text}" as {group}' for text, group in groups.items()]
    lines += [f"    {begin} --> {target}: {', '.join(names)}" for (begin, target), names in arrows.items()]
    return "\n".join(["stateDiagram-v2", *lines])
