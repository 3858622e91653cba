"""Residuals over the flight, before and after the identification."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sitl.lab.identification.regression import RESIDUAL_AXES
from sitl.lab.identification.result import Identification
from sitl.tools.plotting import blank_page, save_page

MAX_CURVE_POINTS = 4000  # of a curve


def save_residual_plot(found: Identification, name: str, path: Path) -> None:
    """Draw one panel per axis.

    Raises:
        SitlError: Matplotlib is missing, or the file cannot be written.
    """
    page = blank_page(12.0, 9.0)
    every = max(1, len(found.time) // MAX_CURVE_POINTS)
    for number, axis in enumerate(RESIDUAL_AXES):
        panel = page.add_subplot(3, 2, 2 * (number % 3) + number // 3 + 1)
        for values, label, colour in zip(found.residuals, (name, "estimated"), ("tab:orange", "tab:blue"), strict=True):
            panel.plot(found.time[::every], values[::every, number], linewidth=0.6, label=label, color=colour)
        panel.set_title(axis)
        panel.set_ylabel("m/s²" if number < 3 else "rad/s")
        largest = float(np.abs(found.residuals[0][:, number]).max())
        panel.set_ylim(-largest, largest)
    page.axes[0].legend(loc="upper right")
    for panel in page.axes[2::3]:
        panel.set_xlabel("time [s]")
    save_page(page, path, 120)
