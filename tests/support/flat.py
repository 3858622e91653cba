"""Nested named tuples laid flat: their numbers, and where those stand."""

from sitl.storage import fields, is_compound


def numbers_of(value):
    """All numbers of a value, in order."""
    return [number for part in value for number in (numbers_of(part) if isinstance(part, tuple) else (float(part),))]


def paths_of(kind, path=""):
    """Places of the numbers and arrays of a named tuple, such as ".body.position.x", in order."""
    if not is_compound(kind):
        return [path]
    return [inner for name, part in fields(kind).items() for inner in paths_of(part, f"{path}.{name}")]
