"""The lines that ``scripts/where.py`` prints."""

import argparse

from .search import Hit, lacking, search

MOST = 10  # lines of an answer
WIDTH = 170  # characters of a line


def line_of(hit: Hit, words: list[str]) -> str:
    """One line: where, name, value, what it says, and which words it lacks."""
    place = hit.place
    named = f"{place.name} = {place.value}" if place.value else place.name or "(file)"
    missing = lacking(hit, words)
    near_miss = f"(without {', '.join(missing)}) " if missing else ""
    line = f"{place.path}:{place.line}  {near_miss}{named}  {' '.join(place.about.split())}"
    return line if len(line) <= WIDTH else f"{line[: WIDTH - 1]}…"


def main(arguments: list[str] | None = None) -> int:
    """Print what is found; exit code 1 if nothing is."""
    parser = argparse.ArgumentParser(
        description="Files, classes, functions, fields, constants and texts that have words."
    )
    parser.add_argument("words", nargs="+", metavar="WORD")
    words = " ".join(parser.parse_args(arguments).words).split()
    found = search(words)
    shown = found[:MOST] if len(found) <= MOST else found[: MOST - 1]
    lines = [line_of(hit, words) for hit in shown]
    lines += [f"and {len(found) - len(shown)} more: give another word"] if len(found) > len(shown) else []
    print("\n".join(lines), end="\n" if lines else "")
    return 0 if found else 1
