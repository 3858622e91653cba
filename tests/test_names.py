"""Words of the source: public names stand for one thing in a package, and docstrings state what they describe.

No two public classes, modules or constants of a package share a name with another meaning. No docstring begins like a
question.
"""

import ast
import re
from collections import defaultdict
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("protocol", "sitl", "darko_gcs")
FOLDERS = (*PACKAGES, "scripts", "tests")
GENERATED = {"protocol/dialect/mavlink.py", "protocol/dialect/vocabulary.py"}  # the dialect names what is in them
QUESTION = re.compile(r"(what|which|where|when|who|whose|how|why)\b", re.IGNORECASE)  # "Whether" begins a predicate
DOCUMENTED = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
SPECIAL = {"__init__", "__main__"}
COMMAND_FOLDERS = {
    "sitl/commands",
    "darko_gcs/commands",
}  # a module there is named after a command of the terminal

# Names that may stand in several modules of a package, each with the reason why they do not confuse.
ALLOWED: dict[str, dict[str, str]] = {
    "protocol": {},
    "sitl": {
        "commands": "the terminal's commands are a folder, the MAVLink commands a module of the MAVLink folder",
    },
    "darko_gcs": {},
}


@cache
def sources(package):
    """Paths of a package's own modules, relative to the root, and their syntax trees."""
    paths = {path.relative_to(ROOT).as_posix(): path for path in sorted((ROOT / package).rglob("*.py"))}
    return [(name, ast.parse(path.read_text("utf-8"))) for name, path in paths.items() if name not in GENERATED]


def is_public(name):
    return not name.startswith("_")


def modules(package):
    """Places of each name of a module or folder; a module may be called like its own folder."""
    found = defaultdict(set)
    for path, _ in sources(package):
        file = Path(path)
        folder = file.parent.as_posix()
        if file.stem == "__init__" and folder != package:
            found[file.parent.name].add(folder)
        elif file.stem not in SPECIAL and folder not in COMMAND_FOLDERS and file.stem != file.parent.name:
            found[file.stem].add(path)
    return found


def classes(package):
    """Modules that define each public class."""
    found = defaultdict(set)
    for path, tree in sources(package):
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and is_public(node.name):
                found[node.name].add(path)
    return found


def constants(package):
    """Modules that define each public constant; an alias of something imported does not count."""
    found = defaultdict(set)
    for path, tree in sources(package):
        for node in tree.body:
            for name, value in assigned(node):
                if name.isupper() and is_public(name) and not is_alias(value):
                    found[name].add(path)
    return found


def assigned(node):
    """The names a statement binds, each with its value."""
    if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
        yield node.target.id, node.value
    for target in node.targets if isinstance(node, ast.Assign) else ():
        if isinstance(target, ast.Name):
            yield target.id, node.value
        elif isinstance(target, ast.Tuple):
            each = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value] * len(target.elts)
            yield from ((part.id, value) for part, value in zip(target.elts, each, strict=True))


def questions(folder):
    """File, line and first line of each docstring that begins with a question word."""
    for path, tree in sources(folder):
        for node in ast.walk(tree):
            text = (ast.get_docstring(node) or "") if isinstance(node, DOCUMENTED) else ""
            if QUESTION.match(text):
                yield f"{path}:{node.body[0].lineno}: {text.splitlines()[0]}"


def is_alias(value):
    """Whether a value is an attribute of a module or class, taken as it is."""
    return isinstance(value, ast.Attribute)


@pytest.mark.long(after=1)
@pytest.mark.parametrize("kind", [modules, classes, constants])
@pytest.mark.parametrize("package", PACKAGES)
def test_a_name_stands_for_one_thing_in_a_package(package, kind):
    allowed = ALLOWED[package]
    doubled = {name: sorted(where) for name, where in kind(package).items() if len(where) > 1 and name not in allowed}
    assert not doubled


@pytest.mark.parametrize("package", PACKAGES)
def test_every_allowed_name_is_still_in_several_modules(package):
    doubled = {
        name for kind in (modules, classes, constants) for name, where in kind(package).items() if len(where) > 1
    }
    assert not ALLOWED[package].keys() - doubled


def test_a_second_meaning_is_found_and_an_alias_is_none(tmp_path, monkeypatch):
    (tmp_path / "house" / "garden").mkdir(parents=True)
    (tmp_path / "house" / "door.py").write_text(
        "from wall import brick\nWIDTH, RED = 1.0, brick.RED\nclass Lock: ...\n"
    )
    (tmp_path / "house" / "garden" / "door.py").write_text("WIDTH: float = 2.0\nRED = brick.RED\nclass Lock: ...\n")
    monkeypatch.setitem(globals(), "ROOT", tmp_path)
    names = [
        {name for name, where in kind("house").items() if len(where) > 1} for kind in (modules, classes, constants)
    ]
    assert names == [{"door"}, {"Lock"}, {"WIDTH"}]


@pytest.mark.long
@pytest.mark.parametrize("folder", FOLDERS)
def test_no_docstring_begins_with_a_question_word(folder):
    found = list(questions(folder))
    assert not found, "\n".join(found)


def test_a_question_is_found_in_every_kind_of_docstring(tmp_path, monkeypatch):
    (tmp_path / "shed").mkdir()
    (tmp_path / "shed" / "tool.py").write_text(
        '"""What cuts."""\n'
        "class Saw:\n"
        '    """Whose teeth\n    cut."""\n'
        "    async def cut(self):\n"
        '        """how deep."""\n'
        "def is_sharp():\n"
        '    """Whether it cuts."""\n'
        "def length():\n"
        '    """Length [m]. How long it is."""\n'
        "def handle(): ...\n"
    )
    monkeypatch.setitem(globals(), "ROOT", tmp_path)
    assert sorted(questions("shed")) == [
        "shed/tool.py:1: What cuts.",
        "shed/tool.py:3: Whose teeth",
        "shed/tool.py:6: how deep.",
    ]
