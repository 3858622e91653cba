"""Included procedures: their parts are put into the plan, their blocks under the names ``INCLUDE.block``.

Waypoints and sectors keep their names, because expressions name them (``WP_TD``); where plan and procedure both have
one, that of the plan is meant, so that a plan can move what a procedure lands at.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace

from protocol.flight_plans.place import FlightPlanError, SourceText
from protocol.flight_plans.plan_reader import sections_of
from protocol.flight_plans.xml_elements import MAX_ELEMENTS, XmlElement

__all__ = ["MAX_INCLUDES", "with_procedures"]

MAX_INCLUDES = 32  # of a plan
_PARAMETER = re.compile(r"\$([A-Za-z_][A-Za-z0-9_]*)")
_QUOTED = re.compile(r"'([^']*)'")
_ADDED = ("waypoints", "sectors", "variables", "modules", "exceptions", "blocks")
_NAMES = {"waypoints": "name", "sectors": "name", "variables": "var"}  # section: attribute
Fetch = Callable[[SourceText], XmlElement]


def with_procedures(root: XmlElement, fetch: Fetch) -> XmlElement:
    """The plan with its procedures in place, without ``includes``.

    Args:
        root: Of the plan.
        fetch: Gives the root of a procedure's file.

    Raises:
        FlightPlanError: An include, or the procedure it names, is not valid.
    """
    includes = next((child for child in root.children if child.tag == "includes"), None)
    if root.tag != "flight_plan" or includes is None:
        return root
    if len(includes.children) > MAX_INCLUDES:
        raise FlightPlanError(includes.children[MAX_INCLUDES].place, f"more than {MAX_INCLUDES} includes")
    for include in includes.children:
        root = _merged(root, _procedure(include, fetch))
        if _size(root) > MAX_ELEMENTS:
            raise FlightPlanError(include.place, f"the plan with this file has more than {MAX_ELEMENTS} elements")
    return replace(root, children=tuple(child for child in root.children if child.tag != "includes"))


def _procedure(include: XmlElement, fetch: Fetch) -> XmlElement:
    """The procedure that an include names, with its arguments and under its names."""
    if include.tag != "include":
        raise FlightPlanError(include.place, f"<{include.tag}> where <include> was expected")
    name, file = _attributes(include, "name", "procedure")
    given, reroutes = {}, {}
    for child in include.children:
        if child.tag == "arg":
            key, value = _attributes(child, "name", "value")
            given[key.text] = value
        elif child.tag == "with":
            old, new = _attributes(child, "from", "to")
            reroutes[old.text] = new.text
        else:
            raise FlightPlanError(child.place, f"<include> holds no <{child.tag}>")
    procedure = fetch(file)
    if procedure.tag != "procedure":
        raise FlightPlanError(procedure.place, f"<{procedure.tag}> where <procedure> was expected")
    values = _parameters(procedure, given, include)
    sections = sections_of(procedure)
    for tag, section in sections.items():
        if tag not in {*_ADDED, "header"}:
            raise FlightPlanError(section.place, f"<procedure> holds no <{tag}>")
    return _Renaming(f"{name.text}.", reroutes, values, _block_names(sections.get("blocks"))).applied(procedure)


def _attributes(element: XmlElement, *names: str) -> tuple[SourceText, ...]:
    for name, source in element.attributes.items():
        if name not in names:
            raise FlightPlanError(source.place, f"<{element.tag}> has no attribute {name!r}: {', '.join(names)}")
    for name in names:
        if name not in element.attributes:
            raise FlightPlanError(element.place, f"<{element.tag}> needs the attribute {name!r}")
    return tuple(element.attributes[name] for name in names)


def _parameters(procedure: XmlElement, given: Mapping[str, SourceText], include: XmlElement) -> dict[str, str]:
    values: dict[str, str] = {}
    for child in procedure.children:
        if child.tag != "param":
            continue
        default = child.attributes.get("default_value")
        (name, *_) = _attributes(child, *(("name",) if default is None else ("name", "default_value")))
        value = given.get(name.text, default)
        if value is None:
            raise FlightPlanError(include.place, f"the procedure needs <arg name={name.text!r}>")
        values[name.text] = value.text
    for key, source in given.items():
        if key not in values:
            raise FlightPlanError(source.place, f"the procedure has no parameter {key!r}")
    return values


def _block_names(blocks: XmlElement | None) -> frozenset[str]:
    children = blocks.children if blocks is not None else ()
    return frozenset(child.attributes["name"].text for child in children if "name" in child.attributes)


class _Renaming:
    """Puts arguments and the names of blocks into a procedure."""

    def __init__(
        self, prefix: str, reroutes: Mapping[str, str], values: Mapping[str, str], own_blocks: frozenset[str]
    ) -> None:
        self._prefix, self._reroutes, self._values, self._own_blocks = prefix, reroutes, values, own_blocks

    def applied(self, element: XmlElement) -> XmlElement:
        """The element, and all in it, as it stands in the plan."""
        attributes = {name: self._attribute(element.tag, name, value) for name, value in element.attributes.items()}
        return replace(element, attributes=attributes, children=tuple(map(self.applied, element.children)))

    def _attribute(self, tag: str, name: str, source: SourceText) -> SourceText:
        text = self._with_values(source.text)
        if (tag, name) == ("block", "name"):
            text = self._prefix + text
        elif (tag, name) in {("exception", "deroute"), ("deroute", "block")}:
            text = self._block(text)
        else:
            text = _QUOTED.sub(lambda match: f"'{self._block(match.group(1))}'", text)
        return source if text == source.text else SourceText(text, source.place, text)

    def _block(self, name: str) -> str:
        """A block that the procedure jumps to: rerouted, its own, or one of the plan."""
        return self._reroutes.get(name, self._prefix + name if name in self._own_blocks else name)

    def _with_values(self, text: str) -> str:
        whole = _PARAMETER.fullmatch(text.strip())
        if whole and whole.group(1) in self._values:
            return self._values[whole.group(1)]
        return _PARAMETER.sub(self._value, text)

    def _value(self, match: re.Match[str]) -> str:
        value = self._values.get(match.group(1))
        if value is None:
            return match.group()  # the counter of a loop
        return value if re.fullmatch(r"[\w.]+", value) else f"({value})"


def _merged(root: XmlElement, procedure: XmlElement) -> XmlElement:
    """The plan with the sections of a procedure behind its own."""
    sections = sections_of(root)
    for tag, added in sections_of(procedure).items():
        if tag == "header":
            before = sections.get(tag, replace(added, text=""))
            sections[tag] = replace(before, text=f"{before.text}\n{added.text}")
        if tag not in _ADDED:
            continue
        old = sections.get(tag, replace(added, children=(), comments=(), last_comments=()))
        key = _NAMES.get(tag)
        taken = {_name(child, key) for child in old.children} - {""} if key is not None else set()
        new = tuple(child for child in added.children if key is None or _name(child, key) not in taken)
        sections[tag] = replace(old, children=(*old.children, *new))
    return replace(root, children=tuple(sections.values()))


def _name(element: XmlElement, key: str) -> str:
    return element.attributes[key].text if key in element.attributes else ""


def _size(element: XmlElement) -> int:
    return 1 + sum(map(_size, element.children))
