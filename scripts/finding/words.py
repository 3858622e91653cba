"""Words as a search compares them: stems, and words that mean about the same."""

import re
from functools import cache
from itertools import pairwise
from pathlib import Path

WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[^\W\dA-Z_]+|\d+")
ENDINGS = (  # longer ones first
    *("ations", "ation", "ators", "ator", "ating", "ated", "ates", "ate", "ings", "ing"),
    *("ies", "ers", "er", "es", "ed", "s", "e", "y"),
)
LEAST = 3  # letters that a stem keeps
NOTHING = frozenset(
    {
        *("a", "an", "and", "are", "at", "by", "does", "do", "for", "from", "how", "in", "is", "it", "of", "on", "or"),
        *("the", "to", "what", "when", "where", "which", "happen", "happens", "often", "much", "many", "between"),
        *(
            "must",
            "as",
            "until",
            "too",
            "with",
            "be",
            "can",
            "if",
            "its",
            "that",
            "this",
            "than",
            "then",
            "there",
            "so",
        ),
    }
)
NEAR_WORDS = Path(__file__).with_name("near_words.txt")  # each line: words that a newcomer takes for one another


@cache
def stem(word: str) -> str:
    """A word without its ending: landed, landing and lands are one.

    Args:
        word: In lower case.
    """
    while (ending := _ending(word)) is not None:
        word = word.removesuffix(ending)
    return word[:-1] if len(word) > LEAST and word[-1] == word[-2] else word


def _ending(word: str) -> str | None:
    """The ending that a word can do without."""
    if word.endswith(("ss", "eed")):
        return None
    return next((it for it in ENDINGS if word.endswith(it) and len(word) - len(it) >= LEAST), None)


@cache
def stems(text: str) -> frozenset[str]:
    """All words of a text or a name, and their stems."""
    words = [part.lower() for part in WORD.findall(text)]
    return frozenset([*words, *map(stem, words)])


def joined(text: str) -> frozenset[str]:
    """Two neighbours as one word, and its stem: take-off is takeoff, set-point is setpoint."""
    words = [part.lower() for part in WORD.findall(text)]
    pairs = [a + b for a, b in pairwise(words)]
    return frozenset([*pairs, *map(stem, pairs)])


@cache
def near(word: str) -> frozenset[str]:
    """Stems of words that mean about the same.

    Args:
        word: In lower case.
    """
    return frozenset().union(*(group for group in _groups() if stem(word) in group)) - {stem(word)}


@cache
def _groups() -> list[set[str]]:
    return [{stem(word) for word in line.split()} for line in NEAR_WORDS.read_text(encoding="utf-8").splitlines()]


def asked(words: list[str]) -> list[str]:
    """Words that are asked for, a name as its parts, without the words that say nothing, if others are left."""
    lowered = [part.lower() for word in words for part in WORD.findall(word.replace("-", ""))]
    telling = [word for word in lowered if word not in NOTHING] or lowered
    return list(dict.fromkeys(telling))
