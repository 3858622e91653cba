"""Expected errors of the vehicle: each is one clear line for the user."""


class SitlError(Exception):
    """Base of every expected error of this package."""


class UnknownLawError(SitlError):
    """A law is in force that the core does not know."""


class ZenoError(SitlError):
    """Jumps without end at one instant: the hysteresis of the table is broken."""
