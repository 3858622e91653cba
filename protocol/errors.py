"""Expected errors of this package. Wire input never raises one: bad input is counted and dropped."""


class ProtocolError(Exception):
    """Base of every expected error of this package."""


class LocalProtocolError(ProtocolError):
    """This side used an engine out of turn, or a value does not fit the wire."""


class WireRangeError(LocalProtocolError):
    """A value does not fit its field of the wire; the message is for programmers."""


class FileError(ProtocolError):
    """A plan, a key or a log cannot be read or written; the message names the file, the place and the fault."""
