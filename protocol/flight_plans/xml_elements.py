"""XML as elements with their places. Plans come from strangers: no entity is expanded, nothing else is opened.

Depth, size and number of elements are bounded. A plan is read as Paparazzi's own reader takes it, which is no strict
XML: the first of repeated attributes counts, names may be in capitals, values hold & and <, attributes follow each
other without a blank, and comments hold two dashes. Such a text is mended before it is parsed; places are of the file.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from codecs import BOM_UTF8
from collections.abc import Mapping
from dataclasses import dataclass, field
from xml.etree.ElementTree import ParseError

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import DefusedXMLParser

from protocol.errors import FileError
from protocol.ranges import MAX_PLAN_FILE
from protocol.tools.files import decode_text, wide_encoding

_CHARACTER = re.compile(r"&#?\w+;|.", re.DOTALL)  # a reference stands for one character


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
_REFERENCE = re.compile(r"&(?!(?:amp|lt|gt|quot|apos|#[0-9]+|#x[0-9A-Fa-f]+);)(#?\w+);")
_TAG_STOP = re.compile(rb"[>\"']")
_COMMENT = (b"<!--", b"-->")
_NO_TAGS = (_COMMENT, (b"<![CDATA[", b"]]>"), (b"<?", b"?>"), (b"<!", b">"), (b"</", b">"))  # begin, end
_IN_VALUE = re.compile(rb"<|&(?!#?\w+;)")  # what a value may not hold in XML
_ESCAPES = {b"<": b"&lt;", b"&": b"&amp;"}
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


def parse_xml(data: bytes, name: str, *, lenient: bool = False) -> XmlElement:
    """The root element of a file called ``name``.

    Args:
        data: Content of the file.
        name: Of the file.
        lenient: Whether it may be written as Paparazzi's reader takes it; names are then given in small letters.

    Raises:
        FlightPlanError: It is not well-formed, declares an entity, or exceeds a limit.
    """
    text = mended(_decoded(data, name).encode("utf-8"), lenient=lenient)
    builder = _Builder(name, text, folds_case=lenient)
    parser = DefusedXMLParser(target=builder, encoding="utf-8")
    builder.parser = parser.parser
    try:
        parser.feed(text.well_formed)
        parser.close()
    except ParseError as error:
        raise FlightPlanError(builder.here(), f"not XML: {_POSITION.sub('', str(error))}") from None
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

    def __init__(self, name: str, text: MendedText, *, folds_case: bool) -> None:
        self._text, self._bytes, self._folds_case = text, text.blanked, folds_case
        self.parser: object = None
        self._name = name
        self._bottom = _Open("", {}, (), Place(name, 1, 1))
        self._open = [self._bottom]
        self._count = 0

    def here(self) -> Place:
        """Present place of the parser."""
        index = self._index()
        return Place(self._name, self._bytes.count(b"\n", 0, index) + 1, self._column(index) + 1)

    def root(self) -> XmlElement:
        """The complete tree."""
        return self._bottom.children[0]

    def _index(self) -> int:
        return self._text.index(max(getattr(self.parser, "CurrentByteIndex", 0), 0))

    def _column(self, index: int) -> int:
        begins = self._bytes.rfind(b"\n", 0, index) + 1
        return len(self._bytes[begins:index].decode("utf-8", errors="replace"))

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
        found = self._text.repeated.get(begins, ())
        return tuple(
            RepeatedAttribute(name, place.after(self._bytes[begins:index].decode("utf-8"))) for index, name in found
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
        end, _ = _scanned_tag(self._bytes, begins)
        return self._bytes[begins:end].decode("utf-8")


@dataclass(frozen=True, slots=True)
class MendedText:
    """A file made well-formed.

    Attributes:
        well_formed: What is parsed.
        blanked: The file, as long as it was, with blanks in place of attributes that their tag gave before.
        repeated: By the first byte of a tag, the first byte and name of each of those.
        inserted: First byte in ``well_formed`` of each insertion, rising.
        before: How many bytes are inserted up to the end of each.
    """

    well_formed: bytes
    blanked: bytes
    repeated: Mapping[int, list[tuple[int, str]]]
    inserted: tuple[int, ...]
    before: tuple[int, ...]

    def index(self, parsed: int) -> int:
        """The byte of the file that a byte of the parsed text is."""
        known = bisect_right(self.inserted, parsed)
        return parsed - self.before[known - 1] if known else parsed


class _Mender:
    """Goes through a file tag by tag and notes what to change."""

    def __init__(self, text: bytes, *, lenient: bool) -> None:
        self._text, self._lenient = text, lenient
        self._blanked = bytearray(text)
        self._repeated = dict[int, list[tuple[int, str]]]()
        self._changes = list[tuple[int, int, bytes]]()  # first byte, byte behind the last, what stands there instead

    def mended(self) -> MendedText:
        text, index = self._text, self._text.find(b"<")
        while index >= 0:
            begin, ending = next((pair for pair in _NO_TAGS if text.startswith(pair[0], index)), (b"<", b""))
            if ending:
                end = text.find(ending, index + len(begin))
                if self._lenient and ending == _COMMENT[1] and end >= 0:
                    self._mend_comment(index + len(begin), end)
            else:
                end = self._mend_tag(index)
            index = text.find(b"<", end) if end >= 0 else -1
        return self._changed()

    def _mend_comment(self, begins: int, ends: int) -> None:
        body = self._text[begins:ends].replace(b"--", b"==")
        self._blanked[begins:ends] = body[:-1] + b"=" if body.endswith(b"-") else body

    def _mend_tag(self, begins: int) -> int:
        """Its last byte, or -1."""
        end, attributes = _scanned_tag(self._text, begins)
        seen: set[bytes] = set()
        behind = -1  # the attribute before
        for name, first, last in attributes:
            key = name.lower() if self._lenient else name
            if key in seen:
                self._blanked[first:last] = re.sub(rb"[^\n]", b" ", self._text[first:last])
                self._repeated.setdefault(begins, []).append((first, name.decode("utf-8", errors="replace")))
            elif self._lenient:
                if first == behind:
                    self._changes.append((first, first, b" "))
                for found in _IN_VALUE.finditer(self._text, first, last):
                    self._changes.append((*found.span(), _ESCAPES[found.group()]))
            seen.add(key)
            behind = last
        return end

    def _changed(self) -> MendedText:
        pieces, inserted, before = list[bytes](), list[int](), list[int]()
        done = length = 0
        blanked = bytes(self._blanked)
        for first, last, instead in self._changes:
            pieces += (blanked[done:first], instead)
            length += first - done + len(instead)
            done = last
            inserted.append(length - len(instead) + last - first)
            before.append(length - last)
        pieces.append(blanked[done:])
        return MendedText(b"".join(pieces), blanked, self._repeated, tuple(inserted), tuple(before))


def mended(text: bytes, *, lenient: bool) -> MendedText:
    """A file in UTF-8 as XML: no attribute is repeated in a tag, which XML forbids.

    Args:
        text: In UTF-8.
        lenient: Whether names in capitals are the same names, values may hold & and <, attributes touch each other,
            and comments hold two dashes.
    """
    return _Mender(text, lenient=lenient).mended()


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
