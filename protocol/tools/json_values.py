"""Values as JSON has them."""

from __future__ import annotations

import math
from typing import Any

__all__ = ["json_values"]


def json_values(value: Any) -> Any:  # noqa: ANN401 - whatever JSON can hold
    """The value with null for NaN and infinity, which JSON does not have, at any depth; tuples become lists."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: json_values(inner) for key, inner in value.items()}
    return [json_values(inner) for inner in value] if isinstance(value, list | tuple) else value
