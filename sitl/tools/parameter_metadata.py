"""Metadata of a parameter, written as an annotation of the field that the parameter sets.

A field of type float is a REAL32 on the wire, one of type int an INT32; the fields' order is the order on the wire.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, get_args, get_type_hints

__all__ = ["ParameterMetadata", "annotated_fields"]


class ParameterMetadata(NamedTuple):
    """A parameter's name and what a ground station shows about it: ``Annotated[float, ParameterMetadata(...)]``."""

    name: str  # at most 16 characters: PARAM_VALUE.param_id
    bounds: tuple[float, float]  # smallest and largest value, both allowed
    unit: str
    text: str
    values: tuple[tuple[int, str], ...] = ()  # of an enumeration: each allowed number and its name

    @property
    def meaning(self) -> str:
        """The text, with the names of the values if there are any: "Legs: 0 hover, 1 forward flight"."""
        return ": ".join(filter(None, (self.text, ", ".join(f"{number} {name}" for number, name in self.values))))


class AnnotatedField(NamedTuple):
    """A field that a parameter sets."""

    name: str
    type: type  # int or float
    metadata: ParameterMetadata


def annotated_fields(group: type) -> Iterator[AnnotatedField]:
    """The fields of a class that parameters set, in order.

    Args:
        group: A class with annotated fields.
    """
    for name, hint in get_type_hints(group, include_extras=True).items():
        kind, *extras = get_args(hint) or (hint,)
        for metadata in extras:
            if isinstance(metadata, ParameterMetadata):
                yield AnnotatedField(name, kind, metadata)
