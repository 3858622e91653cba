"""Rooms import what is listed here, and ARCHITECTURE.md and the glossary say where things are."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
GLOSSARY = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
# What each room imports, without the name of its own package; the other rooms may import anything.
IMPORTS = {
    "sitl/tools": "protocol",
    "sitl/model": "",
    "sitl/enclosure": "model tools protocol",
    "sitl/control": "model protocol",
    "sitl/sensors": "model protocol",
    "sitl/estimation": "model sensors control",
    "sitl/design": "model control",
    "sitl/supervisor": "model control tools protocol",
    "sitl/simulation": "model enclosure control sensors estimation design supervisor tools protocol",
    "sitl/guidance": "model control design protocol",
    "sitl/prediction": "model control guidance simulation supervisor protocol",
    "sitl/autopilot": "model enclosure control guidance prediction tools protocol",
    "sitl/vehicle": "model enclosure control sensors guidance prediction simulation autopilot tools protocol",
    "sitl/mavlink": "model control sensors estimation guidance prediction simulation autopilot tools vehicle protocol",
    "sitl/lab/scenarios": "model enclosure control guidance simulation autopilot tools vehicle protocol",
    "sitl/day": "model enclosure sensors simulation autopilot mavlink tools vehicle protocol",
    "sitl/process": "model enclosure sensors prediction simulation autopilot"
    " mavlink scenarios day tools vehicle protocol",
    "sitl/lab/identification": "model control simulation tools protocol",
    "sitl/motion_capture": "model sensors mavlink protocol",
    "darko_gcs/state": "protocol",
    "darko_gcs/station": "state protocol",
    "darko_gcs/feed": "state station protocol",
    "darko_gcs/tasks": "state station feed protocol",
    "darko_gcs/scripting": "state station feed tasks protocol",
    "darko_gcs/tui": "state station feed protocol",
    "darko_gcs/motion_capture": "state station protocol",
    "darko_gcs/web": "",
    "darko_gcs/logs": "state protocol",
}


def rows(heading):
    """The cells of the table under a heading of ARCHITECTURE.md, without its head."""
    return table(PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0])


def table(section):
    lines = [line for line in section.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def quoted(text):
    return re.findall(r"`([^`]+)`", text)


def modules_imported(path):
    """Dotted names of the project's modules and folders that a module imports."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def room_of(module):
    """The room a module is in, ``protocol``, or None for what is in none."""
    package, *rest = module.split(".")
    if package == "protocol":
        return package
    if package in {"sitl", "darko_gcs"} and rest and (ROOT / package / rest[0]).is_dir():
        return f"{package}/{rest[0]}"
    return None


def rooms_imported(room):
    found = {room_of(name) for path in (ROOT / room).rglob("*.py") for name in modules_imported(path)}
    return found - {None, room}


def listed(room):
    package = room.split("/")[0]
    return {name if name == "protocol" else f"{package}/{name}" for name in IMPORTS[room].split()}


def named_rooms():
    return [room for names, _ in rows("Rooms") for room in quoted(names)]


def test_rooms_import_what_is_listed():
    assert {room: rooms_imported(room) for room in IMPORTS} == {room: listed(room) for room in IMPORTS}


def test_every_room_not_listed_is_one_that_the_page_says_may_import_anything():
    free = {room for names, holds in rows("Rooms") for room in quoted(names) if "import anything" in holds}
    assert set(named_rooms()) - set(IMPORTS) == free


def test_rooms_import_only_rooms_above_them_in_the_table():
    order = named_rooms()
    wrong = [
        (room, name)
        for room in IMPORTS
        for name in listed(room) - {"protocol"}
        if order.index(name) > order.index(room)
    ]
    assert wrong == []


def test_the_table_has_every_room():
    named = set(named_rooms())
    there = {f"{p.parent.name}/{p.name}" for package in ("sitl", "darko_gcs") for p in (ROOT / package).iterdir()
             if (p / "__init__.py").exists()}  # fmt: skip
    assert there == named


def is_defined(name, texts):
    defined = re.compile(rf"^\s*(?:def|class) {name}\b|^{name}\b.* = |^[A-Z, ]*\b{name}\b[A-Z, ]* = ", re.MULTILINE)
    return any(defined.search(text) for text in texts)


def test_what_the_index_names_is_defined_in_the_files_it_names():
    for wanted, files, names in rows("Where to find"):
        texts = [(ROOT / file).read_text(encoding="utf-8") for file in quoted(files)]
        assert [name for name in quoted(names) if not is_defined(name, texts)] == [], wanted


def test_what_the_glossary_names_is_defined_in_the_files_it_names():
    missing = []
    for section in GLOSSARY.split("\n## ")[1:]:
        for term, _, where in table(section):
            files = [name for name in quoted(where) if "/" in name]
            texts = [(ROOT / file).read_text(encoding="utf-8") for file in files]
            missing += [(term, name) for name in quoted(where) if "/" not in name and not is_defined(name, texts)]
    assert missing == []


def test_every_name_in_the_text_is_one_of_the_source():
    sources = [path for package in ("sitl", "darko_gcs", "protocol") for path in (ROOT / package).rglob("*.py")]
    words = set(re.findall(r"\w+", "".join(path.read_text(encoding="utf-8") for path in sources)))
    text = "\n".join(line for line in PAGE.splitlines() if not line.startswith("|"))
    named = {name for name in re.findall(r"`@?([\w.]+)`", text) if not name.endswith((".toml", ".py"))}
    assert [name for name in named if not set(name.split(".")) <= words] == []
