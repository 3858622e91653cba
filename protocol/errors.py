"""Expected errors of this package. Wire input raises none of them: it is counted and dropped."""

__all__ = ["FileError", "LocalProtocolError", "ProtocolError"]


class ProtocolError(Exception):
    """Base of every expected error of this package."""


class LocalProtocolError(ProtocolError):
    """This side misused an engine, or asked for a value the wire cannot carry."""


class FileError(ProtocolError):
    """A plan or a log cannot be read; the message names the file, the place and what was wrong."""
