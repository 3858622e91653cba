"""Expected errors of the ground station: one line for the user, and an exit code for each kind."""


class GroundError(Exception):
    """Base of every expected error of this package.

    Args:
        message: One line for the user.
        details: What a program may want to know of it, by name: part of a command's JSON.
    """

    exit_code = 2

    def __init__(self, message: str = "", **details: object) -> None:
        super().__init__(message)
        self.details = details


class LinkError(GroundError):
    """The link cannot be opened, the vehicle process cannot be started, or the vehicle does not answer."""

    exit_code = 3


class FlightError(GroundError):
    """A scripted flight ended early; the message says where."""

    exit_code = 4
