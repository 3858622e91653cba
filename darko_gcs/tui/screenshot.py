"""Saves pictures of the screen."""

from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path

from platformdirs import user_pictures_path

__all__ = ["save_screenshot", "without_fetched_fonts"]

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
