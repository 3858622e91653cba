"""Expected errors of the ground station: one line for the user, and an exit code for each kind."""


class GroundError(Exception):
    """Base of every expected error of this package."""

    exit_code = 2


class LinkError(GroundError):
    """The link cannot be opened, the vehicle process cannot be started, or the vehicle does not answer."""

    exit_code = 3


class FlightError(GroundError):
    """A scripted flight ended early; the message says where."""

    exit_code = 4
