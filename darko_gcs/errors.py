"""Expected errors of the ground station: one line for the user, and an exit code of its own."""


class GroundError(Exception):
    """Base of every expected error of this package."""

    exit_code = 2


class LinkError(GroundError):
    """The link cannot be opened, or the vehicle process cannot be started."""

    exit_code = 3


class FlightError(GroundError):
    """A scripted flight did not come to its end; the message says where it stopped."""

    exit_code = 4
