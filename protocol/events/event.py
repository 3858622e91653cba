"""The base of all events."""

__all__ = ["Event"]


class Event:
    """Base of all events, for annotations."""

    __slots__ = ()
