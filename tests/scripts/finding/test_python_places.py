"""Places in a file of Python: what is named there, what is said of it, and its texts."""

from scripts.finding.python_places import python_places

SOURCE = '''"""A file.

More of it.
"""

NEAR, FAR = 0.5, 2.0  # from the net [m]
# What is told: by number.
TABLE = {1: "the motor is cut", 2: "ok"}


class Settings(NamedTuple):
    """Numbers."""

    timeout: Annotated[float, Metadata("COM_LOSS_T", "Lost after this silence")] = 10.0
    plain: int = 3  # of the kind


class Box:
    """A solid.

    Attributes:
        width: Across [m].
    """

    width: float

    def __init__(self):
        self.lid = None  # open

    def contains(self, p):
        """Whether a point is inside.

        Args:
            p: The point.
        """
        # a corner counts
        if p.far_away:
            raise ValueError(f"no point {p} of the box")
        return True
'''


def found():
    return [(place.line, place.name, place.value, place.about) for place in python_places("a/file.py", SOURCE)]


def place(name):
    return next(it for it in python_places("a/file.py", SOURCE) if it.name == name and not it.is_text)


def test_constants_that_are_named_together_have_their_values_and_their_comment():
    assert (6, "NEAR, FAR", "0.5, 2.0", "from the net [m]") in found()


def test_a_field_has_the_texts_of_its_metadata_its_default_and_the_word_of_its_class():
    assert (14, "Settings.timeout", "10.0", "COM_LOSS_T Lost after this silence") in found()
    assert (15, "Settings.plain", "3", "of the kind") in found()
    assert place("Settings.timeout").around == "Numbers."


def test_a_field_is_described_by_its_class_and_an_attribute_by_its_comment():
    assert place("Box.width").about == "Across [m]."
    assert place("Box.lid").about == "open"


def test_a_method_is_named_with_its_class_and_has_the_comments_in_it_and_the_attributes_that_it_uses():
    method = place("Box.contains")
    assert method.about == "Whether a point is inside."
    assert method.around == "A solid."
    assert "The point." in method.more
    assert "a corner counts" in method.more
    assert "far_away" in method.more


def test_texts_of_two_words_are_places_and_docstrings_are_not_texts():
    texts = [(place.line, place.name, place.about) for place in python_places("a/file.py", SOURCE) if place.is_text]
    assert texts == [(8, "TABLE", '"the motor is cut"'), (38, "Box.contains", '"no point … of the box"')]


def test_a_comment_above_a_constant_tells_of_it():
    assert place("TABLE").about == "What is told: by number."


def test_the_file_is_the_first_place():
    assert found()[0] == (1, "", "", "A file.")
