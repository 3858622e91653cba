"""ARCHITECTURE.md lists the rooms as pyproject.toml layers them, and it and the glossary say where things are."""

import ast
import importlib.util
import inspect
import re
import tomllib
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
GLOSSARY = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
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


# Private names of packages that a minor version may rename, and why each is used.
OTHERS = ("textual", "numba", "hypothesis", "xdist", "_pytest")
PRIVATE = re.compile(r"_[a-z]\w*")
EXCEPTIONS = {
    "_handle_exception": "an error in Textual's own timers, workers and widgets comes to nothing public",
    "_compositor": "tests alone: nothing public gives the text on a screen",
}
TREES = ("sitl", "darko_gcs", "protocol", "scripts", "tests")


@cache
def defined_by_others():
    """Private names of functions, classes and attributes, by the package that defines them."""
    names = {}
    for package in OTHERS:
        folder = Path(importlib.util.find_spec(package).origin).parent
        text = "\n".join(path.read_text(encoding="utf-8") for path in folder.rglob("*.py"))
        found = re.findall(r"(?:\b(?:def|class) |\bself\.|^    )(_[a-z]\w*)\b(?=\(|:| = )", text, re.MULTILINE)
        names |= dict.fromkeys(found, package)
    return names


def private_names(tree):
    """Private names that a module uses, in attributes, imports and texts, and those that it defines."""
    used, defined = set(), set()
    for node in ast.walk(tree):
        match node:
            case ast.Attribute(value=ast.Name(id="os")):  # ``os._exit`` is documented
                pass
            case ast.Attribute(attr=name, ctx=ast.Load()) | ast.Constant(value=str(name)):
                used.add(name)
            case ast.ImportFrom(module=str(module), names=aliases) if module.split(".")[0] in OTHERS:
                used |= {*module.split("."), *(alias.name for alias in aliases)}
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
                defined.add(name)
            case ast.Attribute(attr=name) | ast.Name(id=name, ctx=ast.Store()):
                defined.add(name)
    return {name for name in used if PRIVATE.fullmatch(name)}, defined


def test_no_private_name_of_another_package_is_used():
    modules = [ast.parse(path.read_text(encoding="utf-8")) for tree in TREES for path in (ROOT / tree).rglob("*.py")]
    used, defined = (set().union(*names) for names in zip(*map(private_names, modules), strict=True))
    foreign = {name for name in used - defined if name in defined_by_others()}
    assert foreign - EXCEPTIONS.keys() == set()


def test_no_private_name_of_textual_is_overridden():
    overridden = {}
    for path in (ROOT / "darko_gcs" / "tui").rglob("*.py"):
        module = importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))
        for _, kind in inspect.getmembers(module, inspect.isclass):
            theirs = [base for base in kind.__mro__ if base.__module__.split(".")[0] == "textual"]
            if kind.__module__ == module.__name__ and theirs:
                names = {
                    name for name, own in vars(kind).items() if PRIVATE.fullmatch(name) and inspect.isfunction(own)
                }
                overridden |= {name: kind for name in names if any(name in vars(base) for base in theirs)}
    assert overridden.keys() == {"_handle_exception"}
