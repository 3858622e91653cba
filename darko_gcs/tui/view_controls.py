"""Every view's controls: inks of the theme, scale and middle of maps and charts, and pictures of the screen."""

from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path

from platformdirs import user_pictures_path

from darko_gcs.tui.containment import ContainingApp
from darko_gcs.tui.kept_look import with_inks
from darko_gcs.tui.map_panel import MapPanel, MovableMap
from darko_gcs.tui.widgets.charts_panel import ChartsPanel
from darko_gcs.tui.widgets.flight_panel import FlightPanel

ZOOMED: tuple[type[ChartsPanel | MapPanel | MovableMap], ...] = (ChartsPanel, MapPanel, MovableMap)
FETCHED_FONT = re.compile(r"\s*@font-face\s*\{[^}]*\}")


def save_screenshot(picture: str, filename: str | None, folder: str | None) -> tuple[str, bool]:
    """Save a picture; returns where it is, or why it could not be saved, and True in that case.

    Args:
        picture: SVG.
        filename: None: by the time of day.
        folder: None: the user's folder of pictures; made if it is missing.
    """
    name = filename or f"darko-{datetime.now().astimezone():%Y%m%d-%H%M%S}.svg"
    picture = without_fetched_fonts(picture)
    path = (user_pictures_path() if folder is None else Path(folder)) / name
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(picture, encoding="utf-8")
    except OSError as error:
        return f"{path}: cannot be written: {error.strerror}", True
    return f"Saved {path}", False


def without_fetched_fonts(picture: str) -> str:
    """The picture (SVG) with fonts of the reader's machine: a log's pictures are looked at without a network, too."""
    return FETCHED_FONT.sub("", picture)


class ViewControls(ContainingApp):
    """Inks of the theme, scale and middle of the maps, and the page of the flight panel."""

    def get_css_variables(self) -> dict[str, str]:
        """The theme's colours, and the inks made of them."""
        return with_inks(super().get_css_variables())

    def zoom(self, step: int) -> None:
        """Zoom the map or the charts in, out, or to fit."""
        for kind in ZOOMED:
            for panel in self.screen.query(kind):
                panel.zoom(step)

    def follow_vehicle(self) -> None:
        """Centre the map on the vehicle, and keep it there."""
        for panel in self.screen.query(MapPanel):
            panel.follow()

    def show_next_page(self) -> None:
        """Turn the page of the flight panel."""
        turned = [panel.next_page() for panel in self.screen.query(FlightPanel)]
        if turned and not any(turned):
            self.notify("The flight panel has one page: all of it is shown")

    def action_screenshot(self, filename: str | None = None, path: str | None = None) -> None:
        """Save the screen as a picture, and say where or why not."""
        text, failed = save_screenshot(self.export_screenshot(), filename, path)
        self.notify(text, severity="error" if failed else "information")
