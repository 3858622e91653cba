"""The vehicle's parameters: metadata, changes that were asked for, and the table, filtered and compared."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from enum import Enum
from typing import TYPE_CHECKING, NamedTuple

from darko_gcs.state.text import printable
from protocol.ranges import MAX_FLOAT32

if TYPE_CHECKING:
    from darko_gcs.state.snapshot import Snapshot


class ChangeState(Enum):
    """State of one change."""

    WAITING = "waiting"
    SET = "set"
    REFUSED = "refused"


class ParameterChange(NamedTuple):
    """One change; a later one of the same parameter replaces it."""

    value: float  # that was asked for
    state: ChangeState = ChangeState.WAITING
    reason: str = ""  # of a refusal, also of one that is tried again

    @property
    def words(self) -> str:
        """Its state for people: "set", "refused: is outside 0..3"."""
        is_explained = self.state is ChangeState.REFUSED and self.reason
        return f"{self.state.value}: {self.reason}" if is_explained else self.state.value


def refused_changes(changes: Mapping[str, ParameterChange]) -> dict[str, ParameterChange]:
    """Those that the vehicle refused, by name."""
    return {name: change for name, change in changes.items() if change.state is ChangeState.REFUSED}


MAX_PARAMETERS = 5000  # of one vehicle; more are ignored
RELATIVE_TOLERANCE = 1e-6  # values are float32 on the wire, defaults are decimals in a file
ABSOLUTE_TOLERANCE = 1e-12
WORD_MASK = 0xFFFFFFFF  # of an integer on the wire, whatever its sign
NO_BIT = "none"  # a mask without a bit


class ParameterMetadata(NamedTuple):
    """Description of one parameter; NaN or an empty text where the vehicle gives none."""

    text: str = ""
    unit: str = ""
    minimum: float = math.nan
    maximum: float = math.nan
    default: float = math.nan
    is_integer: bool = False
    needs_reboot: bool = False
    long_text: str = ""
    values: tuple[tuple[float, str], ...] = ()  # of an enumeration, or special ones: each with its name
    bits: tuple[tuple[int, str], ...] = ()  # of a mask: each bit's number, 0 the lowest, and its name

    @property
    def bounds(self) -> str:
        """The range as text, "0.1..3"; empty without one."""
        if math.isnan(self.minimum) and math.isnan(self.maximum):
            return ""
        low, high = ("" if math.isnan(end) else f"{end:g}" for end in (self.minimum, self.maximum))
        return f"{low}..{high}"

    @property
    def is_listed(self) -> bool:
        """True if no value beside those with a name is possible, as far as the vehicle tells."""
        numbers = [number for number, _ in self.values]
        return self.is_integer and bool(numbers) and (self.minimum, self.maximum) == (min(numbers), max(numbers))

    def problem_with(self, value: float) -> str | None:
        """Reason why the parameter cannot have this value, or None."""
        if abs(value) > (WORD_MASK if self.is_integer else MAX_FLOAT32):
            return f"{value:g} is larger than any value that can be sent"
        if self.is_integer and value != int(value):
            return f"{value:g} is not a whole number"
        if value < self.minimum or value > self.maximum:  # false for NaN: no bound is known
            return f"{value:g} is outside {self.bounds} {self.unit}".rstrip()
        return None

    def name_of(self, value: float) -> str:
        """A value in words: the name of an enumeration's value, those of a mask's bits; empty if there are none."""
        if self.bits:
            word = int(value) & WORD_MASK
            known = dict(self.bits)
            return " + ".join(known.get(bit, f"bit {bit}") for bit in range(32) if word >> bit & 1) or NO_BIT
        return next((name for number, name in self.values if same_value(number, value)), "")

    def shown(self, value: float) -> str:
        """A value for people: "return (2)", "gps + vision (5)", "1.5"."""
        name = self.name_of(value)
        return f"{name} ({number_text(value)})" if name else number_text(value)

    def value_of(self, text: str) -> float:
        """The value that a text means: a number, the name of a value, or names of bits with commas between.

        Raises:
            ValueError: It means none; the message says which names there are.
        """
        try:
            number = float(text)
        except ValueError:
            return self._named(text)
        if not math.isfinite(number):
            raise ValueError(f"{text} is not a number")
        return number

    def _named(self, text: str) -> float:
        numbers = {_plain(name): float(number) for number, name in self.values}
        if _plain(text) in numbers:
            return numbers[_plain(text)]
        masks = {_plain(name): 1 << bit for bit, name in self.bits} | ({NO_BIT: 0} if self.bits else {})
        words = [_plain(word) for word in text.replace("+", ",").split(",")]
        if masks and all(word in masks for word in words):
            return float(sum({masks[word] for word in words}))
        names = ", ".join(name for _, name in (*self.values, *self.bits))
        raise ValueError(f"{text!r} is not a number" + (f", nor one of: {names}" if names else ""))


NO_METADATA = ParameterMetadata()


def same_value(a: float, b: float) -> bool:
    """Whether two values are one on the wire."""
    return math.isclose(a, b, rel_tol=RELATIVE_TOLERANCE, abs_tol=ABSOLUTE_TOLERANCE)


def number_text(value: float) -> str:
    """A value as it is edited, in the digits of a float32."""
    return str(value) if isinstance(value, int) else f"{value:.7g}"


def _plain(name: str) -> str:
    return " ".join(name.lower().replace("_", " ").replace("-", " ").split())


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
    return s.parameters.metadata.get(name, NO_METADATA)


def is_changed(s: Snapshot, name: str) -> bool:
    """True if a parameter differs from its default; false if the default is not known."""
    default = metadata_of(s, name).default
    return not math.isnan(default) and not same_value(s.parameters.values[name], default)


def matching_names(s: Snapshot, wanted: ParameterFilter) -> tuple[str, ...]:
    """Names of the parameters that a filter lets through, in alphabetical order.

    Those with the text in their name come first, before those with it in their description; of each, favourites.
    """
    words = wanted.text.lower().split()
    names = (
        name
        for name in s.parameters.values
        if (name in wanted.favourites or not wanted.only_favourites)
        and (not wanted.only_changed or is_changed(s, name))
        and (not words or _has_words(name, metadata_of(s, name), words))
    )

    def rank(name: str) -> tuple[bool, bool, str]:
        return not all(word in name.lower() for word in words), name not in wanted.favourites, name

    return tuple(sorted(names, key=rank))


def _has_words(name: str, metadata: ParameterMetadata, words: list[str]) -> bool:
    named = " ".join(label for _, label in (*metadata.values, *metadata.bits))
    text = f"{name} {metadata.text} {named}".lower()
    return all(word in text for word in words)


def differences(s: Snapshot, other: Mapping[str, float]) -> tuple[Difference, ...]:
    """Parameters in which the vehicle differs from other values, in alphabetical order."""
    found = (Difference(name, s.parameters.values.get(name), value) for name, value in sorted(other.items()))
    return tuple(each for each in found if each.vehicle is None or not same_value(each.vehicle, each.other))


def default_differences(s: Snapshot) -> tuple[Difference, ...]:
    """Parameters in which the vehicle differs from its own defaults, as far as it tells them."""
    defaults = {name: metadata_of(s, name).default for name in s.parameters.values}
    return differences(s, {name: value for name, value in defaults.items() if not math.isnan(value)})


def parameter_details(s: Snapshot, name: str) -> list[str]:
    """Description of a parameter, in lines: meaning, value, default and range, names of values or bits."""
    metadata, value = metadata_of(s, name), s.parameters.values[name]
    unknown = "not described in a recording" if s.session.is_replay else "the vehicle has no description of it"
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
    change = s.parameters.changes.get(name)
    if change is not None and change.state is not ChangeState.SET:
        lines.append(f"{number_text(change.value)}: {change.words}")
    named = [f"{number_text(number)} {label}" for number, label in metadata.values]
    named += [f"bit {bit} {label}" for bit, label in metadata.bits]
    return lines + ([", ".join(named)] if named else []) + ([metadata.long_text] if metadata.long_text else [])


def parameter_counts(s: Snapshot, shown: int) -> str:
    """Numbers of parameters received, shown, and changed from their defaults, in words."""
    if not s.parameters.values:
        if s.session.is_replay:
            return "no parameters in the recording so far: a session records them when they are shown"
        return "no parameters received yet" if s.identity.source is not None else "no vehicle has been heard yet"
    received, count = len(s.parameters.values), s.parameters.total or 0
    if received < count:
        return f"{received} of {count} parameters received"
    changed = sum(is_changed(s, name) for name in s.parameters.values)
    return f"{shown} of {received} parameters shown, {changed} changed from default (*)"
