"""Parameter files of two kinds of ground stations."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.errors import FileError
from protocol.plans.parameter_files import load_parameters, render_parm, render_qgc_params, save_parameters

NAMES = st.from_regex(r"[A-Z][A-Z0-9_]{0,15}", fullmatch=True)
VALUES = st.floats(width=32, allow_nan=False, allow_infinity=False)


def loaded(tmp_path, text):
    path = tmp_path / "p.params"
    path.write_text(text)
    return load_parameters(path)


@given(st.dictionaries(NAMES, VALUES, min_size=1))
def test_what_is_written_is_read_again(tmp_path_factory, values):
    folder = tmp_path_factory.mktemp("p")
    types = dict.fromkeys(values, 9)
    assert loaded(folder, render_qgc_params(values, types, 1, 1)) == pytest.approx(values, rel=1e-7)
    assert loaded(folder, render_parm(values)) == pytest.approx(values, rel=1e-7)


def test_the_name_of_the_file_decides_its_format(tmp_path):
    for name, first in (
        ("a.params", "1\t1\tA\t1.5\t9"),
        ("a.txt", "1\t1\tA\t1.5\t9"),
        ("a.parm", "A                1.5"),
        ("a.param", "A                1.5"),
    ):
        save_parameters(tmp_path / name, {"A": 1.5}, {"A": 9}, (1, 1))
        assert (tmp_path / name).read_text().splitlines()[-1] == first
        assert load_parameters(tmp_path / name) == {"A": 1.5}
    with pytest.raises(FileError, match="cannot be written"):
        save_parameters(tmp_path / "none" / "a.parm", {"A": 1.5}, {"A": 9}, (1, 1))


def test_files_of_others_are_read(tmp_path):
    assert loaded(tmp_path, "# c\n1\t1\tA\t1.5\t9\n1\t1\tB\t2\t6\n") == {"A": 1.5, "B": 2.0}
    assert loaded(tmp_path, "A 1.5  # why\nB,2\n\n") == {"A": 1.5, "B": 2.0}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("A\n", ":1: 'A' is not a name and a value"),
        ("A 1\nA 2\n", ":2: A is given twice"),
        ("A one\n", "A = 'one' is not a number"),
        ("A nan\n", "A = nan is not a number"),
        ("A-B 1\n", "'A-B' is not a parameter's name"),
        ("# nothing\n", "no parameters"),
    ],
)
def test_a_line_that_makes_no_sense_is_named(tmp_path, text, said):
    with pytest.raises(FileError, match=said):
        loaded(tmp_path, text)


def test_whole_numbers_below_a_thousand_millions_are_written_in_digits():
    values = {"A": 999_999_936.0, "B": 1e9, "C": -3.0, "D": 0.1}
    assert [line.split()[1] for line in render_parm(values).splitlines()[-4:]] == ["999999936", "1e+09", "-3", "0.1"]
