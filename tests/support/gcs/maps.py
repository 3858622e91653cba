"""Maps drawn of a few things."""

from darko_gcs.tui.render.map_drawing import MapContent, MapWindow, draw_map


def drawn_map(width, height, *, scale=None, centre=None, background=None, **content):
    """The rows of a map, and what part of the world it shows."""
    return draw_map(MapWindow(width, height, scale, centre), MapContent(**content), background)
