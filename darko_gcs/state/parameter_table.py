"""The vehicle's parameters as they are looked through: filtered, compared with defaults and with a file."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import NamedTuple

from darko_gcs.state.parameter_change import ChangeState
from darko_gcs.state.parameter_metadata import NO_METADATA, ParameterMetadata, number_text, same_value
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import printable


class ParameterFilter(NamedTuple):
    """Filter of the shown parameters: those for which all of it holds."""

    text: str = ""  # every word of it is in the name, the description or the names of values
    only_changed: bool = False  # from the default
    only_favourites: bool = False
    favourites: Collection[str] = frozenset()  # which come first


class Difference(NamedTuple):
    """A parameter that is not the same on the vehicle as elsewhere: in a file, or by default."""

    name: str
    vehicle: float | None  # None: the vehicle has no such parameter
    other: float


def metadata_of(s: Snapshot, name: str) -> ParameterMetadata:
    """The vehicle's description of a parameter."""
    return s.parameter_metadata.get(name, NO_METADATA)


def is_changed(s: Snapshot, name: str) -> bool:
    """True if a parameter differs from its default; false if the default is not known."""
    default = metadata_of(s, name).default
    return not math.isnan(default) and not same_value(s.parameters[name], default)


def matching_names(s: Snapshot, wanted: ParameterFilter) -> tuple[str, ...]:
    """Names of the parameters that a filter lets through: favourites first, then in alphabetical order."""
    words = wanted.text.lower().split()
    names = (
        name
        for name in s.parameters
        if (name in wanted.favourites or not wanted.only_favourites)
        and (not wanted.only_changed or is_changed(s, name))
        and (not words or _has_words(name, metadata_of(s, name), words))
    )
    return tuple(sorted(names, key=lambda name: (name not in wanted.favourites, name)))


def _has_words(name: str, metadata: ParameterMetadata, words: list[str]) -> bool:
    named = " ".join(label for _, label in (*metadata.values, *metadata.bits))
    text = f"{name} {metadata.text} {named}".lower()
    return all(word in text for word in words)


def differences(s: Snapshot, other: Mapping[str, float]) -> tuple[Difference, ...]:
    """Parameters in which the vehicle differs from other values, in alphabetical order."""
    found = (Difference(name, s.parameters.get(name), value) for name, value in sorted(other.items()))
    return tuple(each for each in found if each.vehicle is None or not same_value(each.vehicle, each.other))


def default_differences(s: Snapshot) -> tuple[Difference, ...]:
    """Parameters in which the vehicle differs from its own defaults, as far as it tells them."""
    defaults = {name: metadata_of(s, name).default for name in s.parameters}
    return differences(s, {name: value for name, value in defaults.items() if not math.isnan(value)})


def parameter_details(s: Snapshot, name: str) -> list[str]:
    """Description of a parameter, in lines: meaning, value, default and range, names of values or bits."""
    metadata, value = metadata_of(s, name), s.parameters[name]
    unknown = "not described in a recording" if s.is_replay else "the vehicle has no description of it"
    title = f"{printable(name)}: {metadata.text or unknown}"
    unit = f" {metadata.unit}" if metadata.unit else ""
    facts = [f"value {metadata.shown(value)}{unit}"]
    if not math.isnan(metadata.default):
        facts.append(f"default {metadata.shown(metadata.default)}{unit}")
    if metadata.bounds and not metadata.is_listed:
        facts.append(f"range {metadata.bounds}{unit}")
    if metadata.needs_reboot:
        facts.append("takes effect after a reboot")
    lines = [title, ", ".join(facts)]
    change = s.parameter_changes.get(name)
    if change is not None and change.state is not ChangeState.SET:
        lines.append(f"{number_text(change.value)}: {change.words}")
    named = [f"{number_text(number)} {label}" for number, label in metadata.values]
    named += [f"bit {bit} {label}" for bit, label in metadata.bits]
    return lines + ([", ".join(named)] if named else []) + ([metadata.long_text] if metadata.long_text else [])


def parameter_counts(s: Snapshot, shown: int) -> str:
    """Numbers of parameters received, shown, and changed from their defaults, in words."""
    if not s.parameters:
        if s.is_replay:
            return "no parameters in the recording so far: a session records them when they are shown"
        return "no parameters received yet" if s.source is not None else "no vehicle has been heard yet"
    received, count = len(s.parameters), s.parameter_count or 0
    if received < count:
        return f"{received} of {count} parameters received"
    changed = sum(is_changed(s, name) for name in s.parameters)
    return f"{shown} of {received} parameters shown, {changed} changed from default (*)"
