"""ARCHITECTURE.md lists the rooms as pyproject.toml layers them; it and the glossary say where things are.

Compiled functions stay short of arguments besides.
"""

import ast
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
GLOSSARY = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
COMPILED = {"kernel", "subroutine", "part", "entry", "unkept_entry", "guard", "reset"}  # decorators
MOST_ARGUMENTS = 6
LAYERS = {  # of each package, from the bottom, with the rooms and modules side by side in each
    contract["containers"][0]: [layer.split(" | ") for layer in reversed(contract["layers"])]
    for contract in tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    if contract["name"].startswith("rooms of")
}


def rows(heading):
    """The cells of the table under a heading of ARCHITECTURE.md, without its head."""
    return table(PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0])


def table(section):
    lines = [line for line in section.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def quoted(text):
    return re.findall(r"`([^`]+)`", text)


@pytest.mark.parametrize("package", ["sitl", "darko_gcs"])
def test_the_table_has_every_room_in_the_order_of_the_layers(package):
    level = {f"{package}/{name}": height for height, layer in enumerate(LAYERS[package]) for name in layer}
    named = [room for names, _ in rows("Rooms") for room in quoted(names) if room.startswith(package)]
    assert sorted(named) == sorted(name for name in level if (ROOT / name).is_dir())
    assert [level[room] for room in named] == sorted(level[room] for room in named)


def is_defined(name, texts):
    if "." in name:  # a field of a class
        owner, field = name.split(".")
        member = re.compile(rf"^class {owner}\b(?:(?!^class )[\s\S])*?^    {field}: ", re.MULTILINE)
        return any(member.search(text) for text in texts)
    defined = re.compile(
        rf"^\s*(?:def|class|const) {name}\b|^{name}\b.* = |^[A-Z_, ]*\b{name}\b[A-Z_, ]* = ", re.MULTILINE
    )
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


def compiled_functions():
    """Module and definition of every function that is compiled, or registered to be."""
    for package in ("sitl", "darko_gcs", "protocol"):
        for path in sorted((ROOT / package).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.FunctionDef) and COMPILED & {decorator(it) for it in node.decorator_list}:
                    yield path.relative_to(ROOT), node


def decorator(node):
    called = node.func if isinstance(node, ast.Call) else node
    return called.attr if isinstance(called, ast.Attribute) else getattr(called, "id", "")


@pytest.mark.long
def test_no_compiled_function_takes_more_than_six_arguments():
    taken = {
        f"{path}: {node.name}": len([*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs])
        for path, node in compiled_functions()
    }
    assert len(taken) > 500
    assert {name: count for name, count in taken.items() if count > MOST_ARGUMENTS} == {}


def test_every_name_in_the_text_is_one_of_the_source():
    sources = [path for package in ("sitl", "darko_gcs", "protocol") for path in (ROOT / package).rglob("*.py")]
    words = set(re.findall(r"\w+", "".join(path.read_text(encoding="utf-8") for path in sources)))
    text = "\n".join(line for line in PAGE.splitlines() if not line.startswith("|"))
    named = {name for name in re.findall(r"`@?([\w.]+)`", text) if not name.endswith((".toml", ".py"))}
    assert [name for name in named if not set(name.split(".")) <= words] == []
