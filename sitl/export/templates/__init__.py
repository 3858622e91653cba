"""Text of the exported files that is not translated: words between @ stand for what is."""

from importlib.resources import files


def template(name: str) -> str:
    """A file's text, by its path in this folder."""
    return files("sitl.export.templates").joinpath(name).read_text(encoding="utf-8")
