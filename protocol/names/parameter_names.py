"""Names of parameters (https://mavlink.io/en/services/parameter.html)."""

from __future__ import annotations

__all__ = ["MAX_NAME_LENGTH"]

MAX_NAME_LENGTH = 16
"""Characters of a parameter's name on the wire, which are ASCII."""
