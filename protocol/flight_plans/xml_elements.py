"""XML as elements with their places. Plans come from strangers: no entity is expanded, nothing else is opened.

Depth, size and number of elements are bounded. As in Paparazzi's own reader the first of repeated attributes counts,
and the names of a plan's elements and attributes may be in capitals.
"""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from collections.abc import Mapping
from dataclasses import dataclass, field
from xml.etree.ElementTree import ParseError

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import DefusedXMLParser

from protocol.errors import FileError
from protocol.ranges import MAX_PLAN_FILE
from protocol.tools.files import decode_text, wide_encoding

_CHARACTER = re.compile(r"&[^;\s]*;|.", re.DOTALL)  # a reference stands for one character


@dataclass(frozen=True, slots=True)
class Place:
    """A character of a file; lines and columns count from 1."""

    file: str
    line: int
    column: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"

    def after(self, text: str) -> Place:
        """The place behind a text that begins here."""
        lines = text.split("\n")
        if len(lines) == 1:
            return Place(self.file, self.line, self.column + len(text))
        return Place(self.file, self.line + len(lines) - 1, len(lines[-1]) + 1)


NOWHERE = Place("", 0, 0)  # of what no file holds


@dataclass(frozen=True, slots=True)
class SourceText:
    """The value of an attribute, and how it was written."""

    text: str  # as XML means it
    place: Place  # of its first character
    raw: str  # as it stands in the file, with references

    def at(self, index: int) -> Place:
        """The place of a character of ``text``."""
        written = "".join(match.group() for match, _ in zip(_CHARACTER.finditer(self.raw), range(index), strict=False))
        return self.place.after(written)


class FlightPlanError(FileError):
    """A flight plan cannot be read or flown: file, line, column and reason in one line.

    Attributes:
        place: Where the fault is.
        reason: What it is.
    """

    def __init__(self, place: Place, reason: str) -> None:
        super().__init__(f"{place}: {reason}" if place.line else f"{place.file}: {reason}")
        self.place, self.reason = place, reason


MAX_ELEMENTS = 10_000  # of a file
MAX_DEPTH = 32  # of elements in each other
_ENCODINGS = {"utf-8": "utf-8", "us-ascii": "utf-8", "ascii": "utf-8", "iso-8859-1": "iso-8859-1"}
_DECLARED = re.compile(rb"\A<\?xml[^>]*?\sencoding\s*=\s*[\"']([A-Za-z0-9._-]+)[\"']")
_ATTRIBUTE = re.compile(r"([^\s=<>\"'/]+)\s*=\s*(?:\"([^\"]*)\"|'([^']*)')")
_REFERENCE = re.compile(r"&(?!(?:amp|lt|gt|quot|apos|#[0-9]+|#x[0-9A-Fa-f]+);)([^;\s]*);?")
_TAG_STOP = re.compile(rb"[>\"']")
_NO_TAGS = ((b"<!--", b"-->"), (b"<![CDATA[", b"]]>"), (b"<?", b"?>"), (b"<!", b">"), (b"</", b">"))  # begin, end
_POSITION = re.compile(r": line \d+, column \d+$")


@dataclass(frozen=True, slots=True)
class RepeatedAttribute:
    """An attribute that its tag gave before."""

    name: str
    place: Place


@dataclass(frozen=True, slots=True)
class XmlElement:
    """One element.

    Attributes:
        tag: Its name.
        attributes: By name, in the order of the file.
        children: Elements in it.
        text: Characters in it, without those of its children.
        comments: In front of it.
        last_comments: In it, behind the last child.
        place: Of its first character.
        repeated: Attributes that were given before in the same tag; the first ones count.
    """

    tag: str
    attributes: Mapping[str, SourceText]
    children: tuple[XmlElement, ...]
    text: str
    comments: tuple[str, ...]
    last_comments: tuple[str, ...]
    place: Place
    repeated: tuple[RepeatedAttribute, ...] = ()


def parse_xml(data: bytes, name: str, *, folds_case: bool = False) -> XmlElement:
    """The root element of a file called ``name``.

    Args:
        data: Content of the file.
        name: Of the file.
        folds_case: Whether names of elements and attributes are given in small letters, however they are written.

    Raises:
        FlightPlanError: It is not well-formed, declares an entity, or exceeds a limit.
    """
    text, repeated = without_repetitions(_decoded(data, name).encode("utf-8"), folds_case=folds_case)
    builder = _Builder(name, text, repeated, folds_case=folds_case)
    parser = DefusedXMLParser(target=builder, encoding="utf-8")
    builder.parser = parser.parser
    try:
        parser.feed(builder.bytes)
        parser.close()
    except ParseError as error:
        line, column = error.position
        raise FlightPlanError(Place(name, line, column + 1), f"not XML: {_POSITION.sub('', str(error))}") from None
    except DefusedXmlException:
        raise FlightPlanError(builder.here(), "entities and references to other files are not allowed") from None
    except (ValueError, LookupError) as error:
        raise FlightPlanError(builder.here(), f"not XML: {error}") from None
    return builder.root()


def _decoded(data: bytes, name: str) -> str:
    start = Place(name, 1, 1)
    if len(data) > MAX_PLAN_FILE:
        raise FlightPlanError(start, f"longer than {MAX_PLAN_FILE} bytes")
    data = data.removeprefix(BOM_UTF8)
    if wide_encoding(data):
        return _wide(data, start)
    declared = _DECLARED.match(data)
    encoding = declared.group(1).decode("ascii").lower() if declared else "utf-8"
    if encoding not in _ENCODINGS or b"\0" in data:
        raise FlightPlanError(start, "not a text in UTF-8 or ISO-8859-1")
    try:
        return _with_unix_lines(data.decode(_ENCODINGS[encoding]))
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise FlightPlanError(Place(name, line, 1), f"not {encoding}: {error.reason}") from None


def _wide(data: bytes, start: Place) -> str:
    """A text in UTF-16 or UTF-32, as its byte order mark says; that decides, whatever the declaration says."""
    try:
        return _with_unix_lines(decode_text(data))
    except UnicodeError as error:
        raise FlightPlanError(start, str(error)) from None


def _with_unix_lines(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n")


@dataclass(slots=True)
class _Open:
    """An element that is not closed yet."""

    tag: str
    attributes: dict[str, SourceText]
    comments: tuple[str, ...]
    place: Place
    children: list[XmlElement] = field(default_factory=list)
    text: list[str] = field(default_factory=list)
    waiting: list[str] = field(default_factory=list)  # comments in front of the next child
    repeated: tuple[RepeatedAttribute, ...] = ()

    def closed(self) -> XmlElement:
        text = "".join(self.text)
        children, last = tuple(self.children), tuple(self.waiting)
        return XmlElement(self.tag, self.attributes, children, text, self.comments, last, self.place, self.repeated)


class _Builder:
    """Target of the parser: collects elements, and knows where each one stands."""

    def __init__(
        self, name: str, text: bytes, repeated: Mapping[int, list[tuple[int, str]]], *, folds_case: bool
    ) -> None:
        self.bytes, self._repeated, self._folds_case = text, repeated, folds_case
        self.parser: object = None
        self._name = name
        self._bottom = _Open("", {}, (), Place(name, 1, 1))
        self._open = [self._bottom]
        self._count = 0

    def here(self) -> Place:
        """Present place of the parser."""
        line = getattr(self.parser, "CurrentLineNumber", 1)
        return Place(self._name, line, self._column(self._index()) + 1)

    def root(self) -> XmlElement:
        """The complete tree."""
        return self._bottom.children[0]

    def _index(self) -> int:
        return max(getattr(self.parser, "CurrentByteIndex", 0), 0)

    def _column(self, index: int) -> int:
        begins = self.bytes.rfind(b"\n", 0, index) + 1
        return len(self.bytes[begins:index].decode("utf-8", errors="replace"))

    # What the parser calls

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        place = self.here()
        self._count += 1
        if self._count > MAX_ELEMENTS:
            raise FlightPlanError(place, f"more than {MAX_ELEMENTS} elements")
        if len(self._open) > MAX_DEPTH:
            raise FlightPlanError(place, f"elements nested more than {MAX_DEPTH} deep")
        above = self._open[-1]
        sources = self._sources(attributes, place)
        if self._folds_case:
            tag, sources = tag.lower(), {name.lower(): source for name, source in sources.items()}
        opened = _Open(tag, sources, tuple(above.waiting), place, repeated=self._repetitions(place))
        self._open.append(opened)
        above.waiting.clear()

    def end(self, _tag: str) -> None:
        element = self._open.pop().closed()
        self._open[-1].children.append(element)

    def data(self, text: str) -> None:
        self._open[-1].text.append(text)

    def comment(self, text: str) -> None:
        self._open[-1].waiting.append(text)

    def close(self) -> None:
        """Nothing is left to do."""

    def _repetitions(self, place: Place) -> tuple[RepeatedAttribute, ...]:
        """The repeated attributes of the tag that begins here."""
        begins = self._index()
        found = self._repeated.get(begins, ())
        return tuple(
            RepeatedAttribute(name, place.after(self.bytes[begins:index].decode("utf-8"))) for index, name in found
        )

    def _sources(self, attributes: dict[str, str], place: Place) -> dict[str, SourceText]:
        """The attributes of the tag that begins here, each with its place."""
        if not attributes:
            return {}
        tag = self._tag_text(self._index())
        found = {match.group(1): match for match in _ATTRIBUTE.finditer(tag)}
        sources = {}
        for name, value in attributes.items():
            match = found.get(name)
            if match is None:
                raise FlightPlanError(place, "namespaces are not allowed")
            group = 2 if match.group(2) is not None else 3
            source = SourceText(value, place.after(tag[: match.start(group)]), match.group(group))
            if unknown := _REFERENCE.search(source.raw):
                raise FlightPlanError(source.place, f"not XML: undefined entity &{unknown.group(1)[:40]};")
            sources[name] = source
        return sources

    def _tag_text(self, begins: int) -> str:
        """The text of a start tag: up to the first > that no quotes enclose."""
        end, _ = _scanned_tag(self.bytes, begins)
        return self.bytes[begins:end].decode("utf-8")


def without_repetitions(text: bytes, *, folds_case: bool) -> tuple[bytes, Mapping[int, list[tuple[int, str]]]]:
    """A file with blanks in place of attributes that their tag gave before, and where those stood.

    XML does not allow an attribute to be repeated, so a parser would refuse the file.

    Args:
        text: In UTF-8.
        folds_case: Whether a name in capitals is the same name.

    Returns:
        The text, as long as it was, and by the first byte of a tag the first byte and name of each repetition.
    """
    kept, found, index = bytearray(text), dict[int, list[tuple[int, str]]](), text.find(b"<")
    while index >= 0:
        ending = next((end for begin, end in _NO_TAGS if text.startswith(begin, index)), None)
        if ending is not None:
            end = text.find(ending, index)
        else:
            end, values = _scanned_tag(text, index)
            seen: set[bytes] = set()
            for name, begins, ends in values:
                key = name.lower() if folds_case else name
                if key in seen:
                    kept[begins:ends] = re.sub(rb"[^\n]", b" ", text[begins:ends])
                    found.setdefault(index, []).append((begins, name.decode("utf-8", errors="replace")))
                seen.add(key)
        index = text.find(b"<", end) if end >= 0 else -1
    return bytes(kept), found


def _scanned_tag(text: bytes, begins: int) -> tuple[int, list[tuple[bytes, int, int]]]:
    """End of a start tag, -1 if it does not end, and its attributes: name, first byte, byte behind the value."""
    attributes: list[tuple[bytes, int, int]] = []
    index = begins + 1
    while stop := _TAG_STOP.search(text, index):
        if stop.group() == b">":
            return stop.start(), attributes
        end = text.find(stop.group(), stop.end())
        if end < 0:
            break
        head = text[index : stop.start()].rstrip().removesuffix(b"=").rstrip()
        name = head[max(map(head.rfind, (b" ", b"\t", b"\n"))) + 1 :]
        attributes.append((name, index + len(head) - len(name), end + 1))
        index = end + 1
    return -1, attributes
