"""The numbers of nested named tuples in a row."""


def numbers_of(value):
    """All numbers of a value, in order."""
    return [number for part in value for number in (numbers_of(part) if isinstance(part, tuple) else (float(part),))]
