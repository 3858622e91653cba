"""Expected errors of the vehicle: each is one clear line for the user."""


class SitlError(Exception):
    """Base of every expected error of this package."""
