"""A place in the source, with the words that tell of it."""

from typing import NamedTuple

MOST_OF_A_VALUE = 40  # characters that are shown


class Place(NamedTuple):
    """A file (without a name), or something in it."""

    path: str
    line: int
    name: str = ""
    about: str = ""  # one line: what its docstring's first line, its comment or its text says
    more: str = ""  # the rest of that
    around: str = ""  # what its class says
    value: str = ""  # of a constant
    called: str = ""  # what the index and the glossary call it
    is_text: bool = False  # a string in what is named
