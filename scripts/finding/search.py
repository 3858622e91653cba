"""The search: places that have every word or nearly, best first."""

import math
from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

from .place import Place
from .tree import places
from .words import asked, joined, near, stem, stems

NAME, CLASS, ABOUT, CALLED, TEXT, MORE, AROUND, FILE = 1.0, 0.75, 0.75, 0.6, 0.7, 0.35, 0.35, 0.35  # weights of words
INFLECTED, BEGINNING, PART, NEARLY = 0.95, 0.8, 0.5, 0.55  # what a word counts that is found so, beside a whole one
LEAST_PART = 4  # letters of a part of a word
BRIEF = 2  # words of a description that says no more than a name
MISSING = 0.5  # what a missing word costs
FAR = 0.4  # share of the best score so far below which nothing is shown
ROOMS = {"tests/": 0.6, "sitl/lab/": 0.85, "scripts/": 0.85}  # what places there count, beside what flies
INDEXED = 1.1  # likewise one that the index or the glossary names


class Hit(NamedTuple):
    """A place, how well it fits, and the words that it lacks."""

    place: Place
    score: float
    missing: tuple[str, ...]


def search(words: list[str]) -> list[Hit]:
    """All hits that come near the best one, best first; of a name in a file the best alone.

    Args:
        words: As they are asked for; one that is spelled as a name finds that name first.
    """
    names = {word for word in words if word != word.lower() or "_" in word}
    best: dict[tuple[str, str], Hit] = {}
    stated = asked(words)
    most = (len(stated) // 2, len(stated) - 1)  # words that may be missing: more, if nothing is found
    found = next((sorted(found, key=_order) for found in (list(hits(stated, it)) for it in most) if found), [])
    for hit in found:
        if hit.score >= found[0].score - FAR * abs(found[0].score):
            best.setdefault((hit.place.path, hit.place.name), hit)
    return sorted(best.values(), key=lambda hit: hit.place.is_text or hit.place.name.rpartition(".")[2] not in names)


def lacking(hit: Hit, words: list[str]) -> list[str]:
    """Words as they were asked for that a hit lacks."""
    return [word for word in words if {*asked([word])} & {*hit.missing}]


def hits(words: list[str], most: int) -> Iterator[Hit]:
    """Places with all words or nearly, in no order.

    Args:
        words: In lower case.
        most: How many of them may be missing.
    """
    whole = [{i for i, text in enumerate(haystacks()) if word in text} for word in map(stem, words)]
    alike = [_with_any(near(word)) | found for word, found in zip(words, whole, strict=True)]
    rare = [math.log(1.0 + len(places()) / (1 + len(found))) for found in whole]
    for i in set().union(*alike):
        if sum(i in found for found in alike) >= len(words) - most:
            hit = _hit(places()[i], words, rare)
            if len(hit.missing) <= most and len(hit.missing) < len(words):
                yield hit


def _with_any(words: frozenset[str]) -> set[int]:
    return {i for i, text in enumerate(haystacks()) if any(word in text for word in words)} if words else set()


def _hit(place: Place, words: list[str], rare: list[float]) -> Hit:
    """A place with its score: the words that it lacks cost."""
    weights = _weights(place)
    found = [max(weight * likeness(word, it) for it, weight in weights.items()) for word in words]
    score = sum(r * (share or -MISSING) for r, share in zip(rare, found, strict=True))
    factor = INDEXED if place.called else 1.0
    for room, share in ROOMS.items():
        factor *= share if place.path.startswith(room) else 1.0
    missing = tuple(word for word, share in zip(words, found, strict=True) if not share)
    return Hit(place, score * factor if score > 0.0 else score / factor, missing)


def _order(hit: Hit) -> tuple[float, int, int, str, int]:
    """Best first; then those that say something, and say it in a shorter name."""
    name = stems(hit.place.name.rpartition(".")[2])
    return -hit.score, not hit.place.about, len(name), hit.place.path, hit.place.line


@cache
def files() -> dict[str, str]:
    """The first line of each file, by path."""
    return {place.path: place.about for place in places() if not place.name}


@cache
def haystacks() -> tuple[str, ...]:
    """All that is said of each place, in lower case, and again with its words run together; a stem of one is a part."""
    texts = (f"{' '.join(place[2:8])} {place.path} {files()[place.path]}".lower() for place in places())
    return tuple(f"{text} {text.replace(' ', '').replace('_', '').replace('-', '')}" for text in texts)


def _weights(place: Place) -> dict[str, float]:
    """Weight of each stem of a place."""
    scope, _, name = place.name.rpartition(".")
    name = name or place.path.rpartition("/")[2]
    own = TEXT if place.is_text else 1.0
    parts = [
        (stems(files()[place.path]), FILE),
        (stems(place.path.rpartition(".")[0]), FILE),
        (stems(place.around), AROUND),
        (stems(place.more), MORE),
        (stems(place.called), CALLED),
        (stems(place.value), MORE),
        (stems(place.about) | joined(place.about), (ABOUT if len(place.about.split()) > BRIEF else NAME) * own),
        (stems(scope), CLASS * own),
        (stems(name) | joined(name), NAME * own),
    ]
    weights: dict[str, float] = {}
    for found, weight in parts:
        for it in found:
            weights[it] = max(weight, weights.get(it, 0.0))
    return weights


@cache
def likeness(word: str, other: str) -> float:
    """The share by which a word or a stem counts as one that is asked for.

    Args:
        word: What is asked for.
        other: What is there.
    """
    if other == word:
        return 1.0
    if other == stem(word):
        return INFLECTED
    if other in near(word):
        return NEARLY
    if len(word) >= LEAST_PART and word in other:
        return BEGINNING if other.startswith(word) else PART
    return 0.0
