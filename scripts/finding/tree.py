"""All places of the source tree, with what ARCHITECTURE.md's index and the glossary call them."""

import re
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from .other_places import READERS, other_places
from .place import Place
from .python_places import python_places

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("sitl", "darko_gcs", "protocol", "scripts", "tests")
GENERATED = {ROOT / "protocol/dialect/mavlink.py", ROOT / "protocol/dialect/vocabulary.py"}
PAGES = ("ARCHITECTURE.md", "docs/glossary.md")  # with tables whose rows name places


@cache
def places() -> tuple[Place, ...]:
    """All files but generated ones, and what is in them."""
    called = names_of_pages()
    found: list[Place] = []
    for package in PACKAGES:
        for file in sorted((ROOT / package).rglob("*")):
            found += (_called(place, called) for place in _of_file(file))
    return tuple(found)


def _of_file(file: Path) -> Iterator[Place]:
    path = file.relative_to(ROOT).as_posix()
    if file in GENERATED or file.name.endswith(".min.js") or not file.is_file():
        return iter(())
    is_test = path.startswith("tests/")
    if file.suffix == ".py" and not is_test:
        return python_places(path, file.read_text(encoding="utf-8"))
    if (is_test and file.suffix != ".py") or file.suffix not in READERS or file.name.startswith("."):
        return iter(())
    return other_places(path, file.read_text(encoding="utf-8"))


def names_of_pages() -> dict[tuple[str, str], str]:
    """Words that rows of tables have for path and name, or for a path alone."""
    called: defaultdict[tuple[str, str], str] = defaultdict(str)
    for page in PAGES:
        for line in (ROOT / page).read_text(encoding="utf-8").splitlines():
            quoted = re.findall(r"`([^`]+)`", line)
            paths = [it for it in quoted if "/" in it]
            names = [it for it in quoted if "/" not in it]
            if not line.startswith("| ") or not paths:
                continue
            for path in paths:
                for name in names or [""]:
                    called[path, name] += f" {line.split(' | ')[0]}"
    return dict(called)


def _called(place: Place, called: dict[tuple[str, str], str]) -> Place:
    names = {part for name in place.name.split(", ") for part in (name, name.rpartition(".")[2])}
    said = " ".join(called.get((place.path, name), "") for name in sorted(names))
    return place._replace(called=said) if said.strip() and not place.is_text else place
