"""Keys that change what a screen shows of the flight, and nothing of the flight."""

from __future__ import annotations

from darko_gcs.tui.containment import ContainingApp
from darko_gcs.tui.inks import with_inks
from darko_gcs.tui.maps.map_panel import MapPanel
from darko_gcs.tui.maps.movable_map import MovableMap
from darko_gcs.tui.widgets.flight_panel import FlightPanel

__all__ = ["ViewControls"]


class ViewControls(ContainingApp):
    """Inks of the theme, scale and middle of the maps, and the page of the flight panel."""

    def get_css_variables(self) -> dict[str, str]:
        """The theme's colours, and the inks made of them."""
        return with_inks(super().get_css_variables())

    def zoom(self, step: int) -> None:
        """Zoom the map in, out, or to fit."""
        for panel in self.screen.query(MapPanel):
            panel.zoom(step)
        for movable in self.screen.query(MovableMap):
            movable.zoom(step)

    def follow_vehicle(self) -> None:
        """Centre the map on the vehicle, and keep it there."""
        for panel in self.screen.query(MapPanel):
            panel.follow()

    def show_next_page(self) -> None:
        """Turn the page of the flight panel."""
        for panel in self.screen.query(FlightPanel):
            panel.next_page()
