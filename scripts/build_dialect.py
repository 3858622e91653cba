"""Generate ``mavlink.py`` and ``vocabulary.py`` of ``protocol/dialect`` from ``darko.xml`` when the package is built.

The dialect includes MAVLink's own ``common.xml``, which pymavlink ships beside its generated modules, so
definitions and generator always have the same version. Run by hand: ``python scripts/build_dialect.py``.

The vocabulary has the dialect's own enums as Python enums. Attributes that MAVLink's schema lacks are in processing
instructions, ``<?darko label="…" regime="…"?>``, which other generators ignore: ``class`` is the name of the Python
class (if it is not the enum's name), ``label`` is the entry in plain words (if they are not its name), and any other
attribute refers to an entry of the enum with that name.
"""

from __future__ import annotations

import contextlib
import io
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
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
    """Write the codec module for one dialect file.

    Args:
        source: The dialect, an XML file that includes ``common.xml``.
        target: The Python module to write; it is replaced atomically.

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
        options = mavgen.Opts(str(work / target.name), wire_protocol="2.0", language="Python3", validate=True)
        output = io.StringIO()
        with contextlib.redirect_stdout(output):
            done = mavgen.mavgen(options, [str(work / source.name)])
        if not done:
            raise RuntimeError(f"{source}: {output.getvalue().strip()}")
        _replace(target, (work / target.name).read_text(encoding="utf-8"))


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
