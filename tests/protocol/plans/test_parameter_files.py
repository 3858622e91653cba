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
    return load_parameters(path).of((1, 1))


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
        assert load_parameters(tmp_path / name).of((1, 1)) == {"A": 1.5}
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
        ("1\t1\tA\t1\t9\n1\t154\tA\t2\t9\n1\t154\tA\t3\t9\n", ":3: A is given twice"),
        ("1\tx\tA\t1\t9\n", ":1: 'x' is not the id of a component"),
        ("256\t1\tA\t1\t9\n", ":1: '256' is not the id of a vehicle"),
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


OF_SEVERAL = "1\t1\tA\t2.5\t9\n1\t154\tA\t7\t9\n1\t154\tB\t8\t9\n"


def test_each_component_has_its_own_rows(tmp_path):
    (tmp_path / "p.params").write_text(OF_SEVERAL)
    file = load_parameters(tmp_path / "p.params")
    assert file.of((1, 1)) == {"A": 2.5}
    assert [(row.name, row.value, row.owner) for row in file.left_out((1, 1))] == [
        ("A", 7.0, (1, 154)),
        ("B", 8.0, (1, 154)),
    ]
    assert file.of((1, 154)) == {"A": 7.0, "B": 8.0}


def test_a_file_of_one_vehicle_is_for_any_and_one_of_several_for_its_own(tmp_path):
    (tmp_path / "p.params").write_text(OF_SEVERAL)
    assert load_parameters(tmp_path / "p.params").of((3, 1)) == {"A": 2.5}
    (tmp_path / "p.params").write_text("1\t1\tA\t1\t9\n2\t1\tA\t2\t9\n")
    file = load_parameters(tmp_path / "p.params")
    assert file.of((2, 1)) == {"A": 2.0}
    assert [row.owner for row in file.left_out((2, 1))] == [(1, 1)]
    with pytest.raises(FileError, match="has parameters of vehicles 1 and 2, none of vehicle 3"):
        file.of((3, 1))


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_byte_order_mark_is_no_part_of_the_first_line(tmp_path, encoding):
    (tmp_path / "p.parm").write_text("A 1\r\n", encoding=encoding)
    assert load_parameters(tmp_path / "p.parm").of((1, 1)) == {"A": 1.0}


def test_a_comment_may_be_in_any_encoding(tmp_path):
    (tmp_path / "p.parm").write_bytes("A 1 # \xe9\n".encode("latin-1"))
    assert load_parameters(tmp_path / "p.parm").of((1, 1)) == {"A": 1.0}
    (tmp_path / "p.parm").write_bytes("A 1\n".encode("utf-16-le"))
    with pytest.raises(FileError, match="it is no text, or one in UTF-16 without a byte order mark"):
        load_parameters(tmp_path / "p.parm")
