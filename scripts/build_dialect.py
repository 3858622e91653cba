"""Generate ``mavlink.py`` and ``vocabulary.py`` of ``protocol/dialect`` from ``darko.xml`` when the package is built.

The dialect includes MAVLink's own ``common.xml``, which pymavlink ships beside its generated modules, so
definitions and generator always have the same version. Run by hand: ``python scripts/build_dialect.py``.

Enums, numbers and what is known of a message are pymavlink's. The classes of messages are ours: pymavlink's take three
times as long and more to a frame and back.

The vocabulary has the dialect's own enums as Python enums. Attributes that MAVLink's schema lacks are in processing
instructions, ``<?darko label="…" regime="…"?>``, which other generators ignore: ``class`` is the name of the Python
class (if it is not the enum's name), ``label`` is the entry in plain words (if they are not its name), and any other
attribute refers to an entry of the enum with that name.
"""

from __future__ import annotations

import contextlib
import io
import itertools
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from inspect import Parameter, signature
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple
from xml.etree import ElementTree

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# Extension fields newer than the generator's definitions, by message; extensions change no CRC.
EXTENSIONS = {
    "MISSION_CURRENT": ("mission_id", "fence_id", "rally_points_id"),
    "MISSION_COUNT": ("opaque_id",),
    "MISSION_ACK": ("opaque_id",),
}

ROOT = Path(__file__).resolve().parent.parent
DIALECT = ROOT / "protocol" / "dialect"


def generate(source: Path, target: Path) -> None:
    """Write the messages of one dialect file.

    Args:
        source: The dialect, an XML file that includes ``common.xml``.
        target: The Python module to write; it is replaced atomically.

    Raises:
        RuntimeError: The generator refuses the dialect; the message is its output.
    """
    text = pymavlink_module(source)
    enums = text[text.index("# enums\n") : text.index("\n\n\nclass MAVLink_", text.index("# message IDs"))]
    kinds = load(text).mavlink_map.values()
    rows = [f"    {kind.id}: {kind.__name__}," for kind in kinds]
    table = "\n".join(["mavlink_map: Dict[int, Type[DialectMessage]] = {", *rows, "}\n"])
    _replace(target, "\n\n\n".join([MESSAGES_HEAD, enums, *map(_message_text, kinds), table]))


def pymavlink_module(source: Path) -> str:
    """Text of the module that pymavlink makes of a dialect file, without a method for each message to send it.

    Raises:
        RuntimeError: The generator refuses the dialect; the message is its output.
    """
    from pymavlink import dialects  # noqa: PLC0415 - only the build environment has to have it
    from pymavlink.generator import mavgen  # noqa: PLC0415

    definitions = Path(next(iter(dialects.__path__))) / "v20"
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        for name in ("common.xml", "standard.xml", "minimal.xml"):
            shutil.copy(definitions / name, work / name)
        extend(work / "common.xml")
        shutil.copy(source, work / source.name)
        options = mavgen.Opts(str(work / "made.py"), wire_protocol="2.0", language="Python3", validate=True)
        output = io.StringIO()
        with contextlib.redirect_stdout(output):
            done = mavgen.mavgen(options, [str(work / source.name)])
        if not done:
            raise RuntimeError(f"{source}: {output.getvalue().strip()}")
        text = (work / "made.py").read_text(encoding="utf-8")
    return re.split(r"\n    def \w+_encode\(", text, maxsplit=1)[0]


def load(text: str) -> Any:  # noqa: ANN401 - as untyped as pymavlink
    """The module that a text is."""
    module = ModuleType("loaded")
    exec(text, module.__dict__)  # noqa: S102 - generated just now from our own file
    return module


def extend(definitions: Path) -> None:
    """Add the newer extension fields to a copy of ``common.xml`` if they are missing."""
    text = definitions.read_text(encoding="utf-8")
    for message, names in EXTENSIONS.items():
        start = text.index(f'name="{message}">')
        end = text.index("</message>", start)
        missing = [name for name in names if f'name="{name}"' not in text[start:end]]
        fields = "".join(f'  <field type="uint32_t" name="{name}">Id of a plan.</field>\n    ' for name in missing)
        text = text[:end] + fields + text[end:]
    definitions.write_text(text, encoding="utf-8")


MESSAGES_HEAD = '''"""MAVLink's messages and enums, generated from ``darko.xml`` by ``scripts/build_dialect.py``."""

from struct import Struct
from typing import Dict, Sequence, Type

from protocol.dialect.dialect_message import DialectMessage'''
KEPT = (
    *("msgname", "fieldnames", "ordered_fieldnames", "fieldtypes", "fielddisplays_by_name", "fieldenums_by_name"),
    *("fieldunits_by_name", "native_format", "orders", "lengths", "array_lengths", "crc_extra"),
)
LONG = 4  # elements from which on a slice of an array is quicker than its elements one by one


class Field(NamedTuple):
    """One field of a message, on the wire."""

    name: str
    is_text: bool
    elements: int  # of an array; 0 for a single number
    at: int  # its first value in the payload


def _message_text(known: Any) -> str:  # noqa: ANN401 - pymavlink is untyped
    fields = {field.name: field for field in _fields(known)}
    arguments = ", ".join(["self", *map(_argument, list(signature(known.__init__).parameters.values())[1:])])
    lines = [f"class {known.__name__}(DialectMessage):", f'    """{known.__doc__}"""', "", f"    id = {known.id}"]
    lines += [f"    {name} = {getattr(known, name)!r}" for name in KEPT]
    lines += [f'    unpacker = Struct("{known.unpacker.format}")', "", f"    def __init__({arguments}) -> None:"]
    lines += [line for name in known.fieldnames for line in _stored(fields[name], name)]
    lines += ["", "    def pack_fields(self) -> bytes:"]
    lines += [f"        return _pack_{known.id}({', '.join(map(_packed, fields.values()))})"]
    lines += ["", "    def unpack_fields(self, data: bytes, at: int) -> None:"]
    lines += _unpacked(f"_unpack_{known.id}(data, at)", [*fields.values()])
    unpacker = f"{known.__name__}.unpacker"  # methods look globals up more quickly than what a class has
    return "\n".join(
        [*lines, "", "", f"_pack_{known.id}, _unpack_{known.id} = {unpacker}.pack, {unpacker}.unpack_from"]
    )


def _argument(parameter: Parameter) -> str:
    default = "" if parameter.default is Parameter.empty else f" = {parameter.default!r}"
    return f"{parameter.name}: {parameter.annotation}{default}"


def _fields(known: Any) -> list[Field]:  # noqa: ANN401
    types = dict(zip(known.fieldnames, known.fieldtypes, strict=True))
    starts = itertools.accumulate(known.lengths, initial=0)
    rows = zip(known.ordered_fieldnames, known.array_lengths, starts, strict=False)
    return [Field(name, types[name] == "char", elements, at) for name, elements, at in rows]


def _stored(field: Field, value: str) -> list[str]:
    """A field set to a value; a text is kept as it came, too, because it may go on behind a zero."""
    if not field.is_text:
        return [f"        self.{field.name} = {value}"]
    text = f'self._{field.name}_raw.split(b"\\0", 1)[0].decode("ascii", errors="replace")'
    return [f"        self._{field.name}_raw = {value}", f"        self.{field.name} = {text}"]


def _packed(field: Field) -> str:
    """A field as arguments of ``Struct.pack``."""
    if field.is_text:
        return f"self._{field.name}_raw"
    if field.elements > LONG:
        return f"*self.{field.name}[:{field.elements}]"
    return ", ".join(f"self.{field.name}[{k}]" for k in range(field.elements)) or f"self.{field.name}"


def _unpacked(values: str, fields: list[Field]) -> list[str]:
    """Statements that set all fields of a payload."""
    if not any(field.is_text or field.elements for field in fields):
        names = ", ".join(f"self.{field.name}" for field in fields) + ("," if len(fields) == 1 else "")
        return [f"        {names} = {values}"]
    lines = [f"        values = {values}"]
    for field in fields:
        if field.is_text:
            lines += _stored(field, f'values[{field.at}].rstrip(b"\\0")')
        else:
            lines += _stored(field, _elements(field))
    return lines


def _elements(field: Field) -> str:
    if field.elements > LONG:
        return f"list(values[{field.at}:{field.at + field.elements}])"
    if field.elements:
        return f"[{', '.join(f'values[{field.at + k}]' for k in range(field.elements))}]"
    return f"values[{field.at}]"


class Entry(NamedTuple):
    """One number of an enum."""

    value: int
    name: str  # without the enum's name
    label: str  # plain words
    description: str
    references: dict[str, str]  # entries of other enums, by enum


class EnumDefinition(NamedTuple):
    """One enum of the dialect."""

    enum: str  # without the dialect's prefix
    name: str  # of the Python class
    description: str
    is_bitmask: bool
    entries: tuple[Entry, ...]


HEAD = '''"""The dialect's own numbers as types, generated from ``darko.xml`` by ``scripts/build_dialect.py``."""

from __future__ import annotations

from enum import IntEnum, IntFlag
from typing import Final


class LabelledEnum(IntEnum):
    """An enum of the dialect."""

    @property
    def label(self) -> str:
        """The value in plain words."""
        return _LABELS[type(self).__name__][self.value]


class LabelledFlags(IntFlag):
    """A bitmask of the dialect."""

    @property
    def label(self) -> str:
        """The bits that are set, in plain words."""
        return ", ".join(_LABELS[type(self).__name__][bit.value] for bit in self)
'''
PREFIX = "DARKO_"


def generate_vocabulary(source: Path, target: Path) -> None:
    """Write the module of the dialect's own enums.

    Args:
        source: The dialect.
        target: The Python module to write; it is replaced atomically.

    Raises:
        RuntimeError: An entry is ambiguous, or refers to one that does not exist.
    """
    enums = [_read_enum(enum) for enum in _tree(source).iter("enum") if enum.get("name", "").startswith(PREFIX)]
    _check(enums)
    classes = [_class_text(enum) for enum in enums]
    tables = ["_LABELS: Final = {", *(_label_table(enum) for enum in enums), "}"]
    tables += [_reference_table(enum, kind) for enum in enums for kind in _kinds(enum)]
    _replace(target, "\n\n".join([HEAD, *classes]) + "\n\n" + "\n".join(tables) + "\n")


def _tree(source: Path) -> ElementTree.Element:
    parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_pis=True))  # noqa: S314 - our own file
    return ElementTree.parse(source, parser).getroot()  # noqa: S314


def _read_enum(element: ElementTree.Element) -> EnumDefinition:
    prefix = element.get("name", "")
    name = prefix.removeprefix(PREFIX)
    attributes = _instructions(element)
    entries = tuple(_read_entry(entry, prefix) for entry in element.iter("entry"))
    kind = attributes.get("class") or name.title().replace("_", "")
    return EnumDefinition(name, kind, _description(element), element.get("bitmask") == "true", entries)


def _read_entry(element: ElementTree.Element, prefix: str) -> Entry:
    name = element.get("name", "").removeprefix(f"{prefix}_")
    references = _instructions(element)
    label = references.pop("label", name.replace("_", " ").lower())
    return Entry(int(element.get("value", ""), 0), name, label, _description(element), references)


def _instructions(element: ElementTree.Element) -> dict[str, str]:
    """Attributes of the ``<?darko ...?>`` of an element."""
    instruction: object = ElementTree.ProcessingInstruction
    texts = [child.text or "" for child in element if child.tag is instruction]
    return {key: value for text in texts for key, value in re.findall(r'(\w+)="([^"]*)"', text)}


def _description(element: ElementTree.Element) -> str:
    return " ".join((element.findtext("description") or "").split())


def _check(enums: list[EnumDefinition]) -> None:
    entries = {enum.enum: {entry.name for entry in enum.entries} for enum in enums}
    for enum in enums:
        for attribute in ("value", "name", "label"):
            values = [getattr(entry, attribute) for entry in enum.entries]
            if len(set(values)) != len(values):
                raise RuntimeError(f"{PREFIX}{enum.enum}: two entries have the same {attribute}")
        for entry in enum.entries:
            for kind in _kinds(enum):
                if entry.references.get(kind) not in entries.get(kind.upper(), set()):
                    raise RuntimeError(f"{PREFIX}{enum.enum}_{entry.name}: it names no entry of {PREFIX}{kind.upper()}")


def _kinds(enum: EnumDefinition) -> Iterator[str]:
    """The other enums that the entries refer to."""
    yield from sorted({kind for entry in enum.entries for kind in entry.references})


def _class_text(enum: EnumDefinition) -> str:
    base = "LabelledFlags" if enum.is_bitmask else "LabelledEnum"
    lines = [f"class {enum.name}({base}):", f'    """{enum.description}"""', ""]
    lines += [f"    {entry.name} = {entry.value}  # {entry.description}" for entry in enum.entries]
    for kind in _kinds(enum):
        lines += ["", "    @property", f"    def {kind}(self) -> {kind.title()}:", f'        """Its {kind}."""']
        lines += [f"        return {_table_name(enum, kind)}[self]"]
    return "\n".join(lines) + "\n"


def _label_table(enum: EnumDefinition) -> str:
    rows = [f'        {entry.value}: "{entry.label}",' for entry in enum.entries]
    return "\n".join([f'    "{enum.name}": {{', *rows, "    },"])


def _reference_table(enum: EnumDefinition, kind: str) -> str:
    rows = [f"    {enum.name}.{e.name}: {kind.title()}.{e.references[kind]}," for e in enum.entries]
    return "\n".join([f"{_table_name(enum, kind)}: Final = {{", *rows, "}"])


def _table_name(enum: EnumDefinition, kind: str) -> str:
    return f"_{kind.upper()}_OF_{enum.enum}"


def _replace(target: Path, text: str) -> None:
    staged = target.with_suffix(".new")
    staged.write_text(text, encoding="utf-8")
    staged.replace(target)


def generate_all() -> None:
    """Write both modules."""
    generate(DIALECT / "darko.xml", DIALECT / "mavlink.py")
    generate_vocabulary(DIALECT / "darko.xml", DIALECT / "vocabulary.py")


class DialectBuildHook(BuildHookInterface):  # type: ignore[misc]
    """Hatchling's hook: the generated modules are build artefacts and never committed."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002
        """Generate the modules before the files of the wheel are collected."""
        generate_all()


if __name__ == "__main__":
    generate_all()
    sys.exit(0)
