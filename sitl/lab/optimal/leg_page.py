"""A page about a bound and flights beside it: the path with attitudes along it, speeds, nose, actuators, power."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from protocol.errors import FileError
from protocol.tools.files import write_atomically
from sitl import Array, SitlError, load_airframe
from sitl.lab.optimal.bound import Bound, as_lines
from sitl.lab.optimal.flown_leg import LegFlight
from sitl.lab.reproduction.flight_panels import SvgSheet
from sitl.lab.reproduction.html_page import PAGE_STYLE
from sitl.tools.plotting import PLOT_FORMATS, blank_page, check_plot_path, require_matplotlib, save_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PAGE_SUFFIX = ".html"
ATTITUDES = 24  # drawn along a path
LINES = 7  # of plots under one another


class DrawnCourse(NamedTuple):
    """A course to be drawn; from the start of the leg."""

    name: str
    times: Array  # (k,) [s]
    plant: Array  # states, (k, 17)
    power: Array  # (k,) [W]


def check_page(path: Path) -> None:
    """Refuse a page that could not be written, before anything is solved.

    Raises:
        SitlError: The suffix, the folder, or matplotlib that is missing.
    """
    if path.suffix != PAGE_SUFFIX:
        if path.suffix not in PLOT_FORMATS:
            raise SitlError(f"plot {path}: the name must end in {', '.join((PAGE_SUFFIX, *PLOT_FORMATS))}")
        check_plot_path(path)
    require_matplotlib()
    if not path.parent.is_dir():
        raise SitlError(f"plot {path}: there is no folder {path.parent}")


def write_page(bounds: Sequence[Bound], flights: Sequence[LegFlight], path: Path) -> None:
    """Write a page (.html) or the plots alone.

    Args:
        bounds: Of one leg.
        flights: Of the same leg.
        path: The suffix chooses.

    Raises:
        SitlError: Matplotlib is missing or the file cannot be written.
    """
    courses = [DrawnCourse(one.question.goal(), one.times, one.plant, one.power) for one in bounds]
    courses += [
        DrawnCourse(f"{f.controller}, {f.way.words}", f.times, f.plant, np.gradient(f.drawn, f.times)) for f in flights
    ]
    size = load_airframe(bounds[0].question.airframe).parameters.b
    if path.suffix != PAGE_SUFFIX:
        page = blank_page(9.0, 2.0 * LINES)
        _draw(list(page.subplots(LINES, 1)), courses, size)
        save_page(page, path, dpi=90)
        return
    sheet = SvgSheet("optimal", LINES, share=False)
    with sheet as axes:
        _draw(axes, courses, size)
    title = f"{bounds[0].question.title()}: flown beside the bound"
    told = escape("\n".join(line for bound in bounds for line in as_lines(bound)))
    text = (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>{escape(title)}</title><style>{PAGE_STYLE}</style></head>\n<body>\n<h1>{escape(title)}</h1>\n"
        f"<figure>{sheet.svg}</figure>\n<pre>{told}</pre>\n{_table(courses)}\n</body></html>\n"
    )
    try:
        write_atomically(path, text.encode())
    except FileError as error:
        raise SitlError(str(error)) from error


def _table(courses: Sequence[DrawnCourse]) -> str:
    rows = [
        f"<tr><td>{escape(course.name)}</td><td>{course.times[-1]:.2f} s</td>"
        f"<td>{np.trapezoid(course.power, course.times):.0f} J</td></tr>"
        for course in courses
    ]
    return "<table><thead><tr><th></th><th>time</th><th>energy</th></tr></thead>" + "".join(rows) + "</table>"


def nose_elevations(plant: Array) -> Array:
    """Elevation of the nose of states (k, 17), above 90 deg on its back, (k,) [rad]."""
    w, x, y, z = plant[:, 6:10].T
    return np.asarray(np.arctan2(2.0 * (x * z - w * y), 1.0 - 2.0 * (x * x + y * y)))


def _draw(axes: Sequence[Axes], courses: Sequence[DrawnCourse], size: float) -> None:
    path, *plots = axes
    for number, course in enumerate(courses):
        colour = f"C{number}"
        _draw_path(path, course, colour, size)
        p, v, nose = course.plant[:, :3], course.plant[:, 3:6], nose_elevations(course.plant)
        values = (
            np.linalg.norm(v, axis=1),
            p[:, 2],
            np.degrees(np.where(nose < -0.5 * math.pi, nose + 2.0 * math.pi, nose)),
            course.plant[:, 13:15].mean(axis=1),
            np.degrees(course.plant[:, 15:17].mean(axis=1)),
            course.power,
        )
        for axis, value in zip(plots, values, strict=True):
            axis.plot(course.times, value, color=colour, linewidth=1.2)
    labels = ("speed [m/s]", "height [m]", "nose [deg]", "motors [rad/s]", "elevons [deg]", "power [W]")
    for axis, label in zip(plots, labels, strict=True):
        axis.set_ylabel(label)
        axis.grid(alpha=0.2)
    plots[-1].set_xlabel("time [s]")
    path.set_xlabel("along the leg [m]")
    path.set_ylabel("height [m]")
    path.legend(fontsize=8)


def _draw_path(axis: Axes, course: DrawnCourse, colour: str, size: float) -> None:
    """The path from the side, and the vehicle along it at even times, a stroke from tail to nose."""
    p = course.plant[:, :3]
    axis.plot(p[:, 0], p[:, 2], color=colour, linewidth=0.8, label=course.name)
    w, x, y, z = course.plant[:, 6:10].T
    nose = np.column_stack([1.0 - 2.0 * (y * y + z * z), 2.0 * (x * z - w * y)])
    reach = max(size, 0.02 * float(np.ptp(p[:, 0])))
    for i in np.searchsorted(course.times, np.linspace(0.0, course.times[-1], ATTITUDES)):
        tip, tail = p[i, [0, 2]] + 0.5 * reach * nose[i], p[i, [0, 2]] - 0.5 * reach * nose[i]
        axis.plot([tail[0], tip[0]], [tail[1], tip[1]], color=colour, linewidth=2.0, alpha=0.6)
        axis.plot(*tip, ".", color=colour, markersize=3.0)
