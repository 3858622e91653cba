"""The small language as C: what is known, and that what is not known is refused with its place."""

import math
from typing import NamedTuple

import numpy as np
import pytest

from sitl.export.c_program import Program
from sitl.export.c_types import ExportError, Types, real_literal, wrapped_line
from sitl.model.airframe import Array
from sitl.storage import path_written, replacing, value_of, writer
from tests.support.exported import files


class Pair(NamedTuple):
    """Two numbers."""

    a: float  # the first [m]
    b: float


class Table(NamedTuple):
    """Numbers in rows."""

    rows: Array


class Large(NamedTuple):
    """More numbers than are passed by value."""

    a: Pair
    b: Pair
    c: Pair
    d: Pair
    e: Pair


class Kept(NamedTuple):
    """A record."""

    large: Large
    other: Large
    grid: Array
    row: Array


class View(NamedTuple):
    """Arrays that are somewhere else."""

    grid: Array
    n: int


LIMIT = 0.1
DESIGN = Pair(1.0, 2.0)
LARGE = Large(*(DESIGN for _ in range(5)))
KEPT = Kept(LARGE, LARGE, np.zeros((3, 3)), np.zeros(4))
put_large = writer(Kept, lambda kept: kept.large)
with_a = replacing(Large, "a")


def translated(function, *, single=False, shapes=(), design=DESIGN):
    """Text of a function's module."""
    program = Program(Types(design, single, {}), {}, path_written, {})
    made = program.instance(function, shapes)
    return program.finished("\n".join([made.head, *made.body])), program


def body(function, **choice):
    return [line.strip() for line in translated(function, **choice)[0].splitlines()][1:]


def head(function, **choice):
    return translated(function, **choice)[0].splitlines()[0]


def swapped(a: float, b: float) -> tuple[float, float]:
    a, b = b, a
    return a, b


def graded(x: float) -> int:
    # Above the limit.
    if x > LIMIT:
        grade = 2
    elif x > 0.0:
        grade = 1
    else:
        grade = 0
    return grade


def summed(table: Array) -> float:
    total = 0.0
    for i in range(table.size):
        total += table[i]
    return total


def mixed(n: int, x: float) -> float:
    return max(x / n, 2 * x, 0.0) if n > 0 and not x < 0.0 else -x


def folded(pair: Pair) -> Pair:
    return pair._replace(b=abs(pair.a))


def test_values_that_change_places_are_all_worked_out_first():
    lines = body(swapped)
    assert lines[:2] == ["const double made_1 = b;", "const double made_2 = a;"]
    assert lines[2:4] == ["a = made_1;", "b = made_2;"]


def test_a_variable_of_two_branches_is_declared_before_them_and_comments_stay():
    lines = body(graded)
    assert lines[0] == "int32_t grade;"
    assert "/* Above the limit. */" in lines
    assert lines.index("} else if (x > 0.0) {") < lines.index("grade = 1;")


def test_a_loop_over_an_array_knows_its_length():
    assert "for (int32_t i = 0; i < 7; ++i) {" in body(summed, shapes=((7,),))


def test_whole_numbers_become_real_ones_as_in_python():
    (line,) = body(mixed)
    assert line == (
        "return n > 0 && !(x < 0.0) ? darko_max_double(darko_max_double(x / (double)n, 2.0 * x), 0.0) : -x;"
    )


def test_a_field_is_replaced_in_a_copy():
    assert body(folded) == ["DarkoPair made_1 = pair;", "made_1.b = fabs(pair.a);", "return made_1;"]


def test_two_shapes_make_two_functions():
    def both(one: Array, other: Array) -> float:
        return summed(one) + summed(other)

    text, _ = translated(both, shapes=((2,), (3,)))
    assert "test_translation_summed_2(one) + test_translation_summed_3(other)" in text


def halved(x: float, n: int) -> int:
    while x > 1.0 and n < 9:
        x = 0.5 * x
        n += 1
        if n % 5 == 4:
            break
    return n


def filled(grid: Array, row: Array) -> None:
    grid[:, :] = 0.0
    for k in range(1, 3):
        row[k], grid[k, k] = 1.0, -1.0
        grid[k, 0] -= 2.0 * row[k]


def stored_late(row: Array) -> None:
    row[0], row[1] = row[1], row[0]


def taken_before_it_changes(kept: Kept, new: Large) -> float:
    before, other = value_of(kept.large), value_of(kept.other)
    put_large(kept, with_a(new, before.b))
    return before.a.a + other.a.a


def changes(kept: Kept, given: Large) -> float:
    put_large(kept, given)
    return given.a.a


def passes_what_changes(kept: Kept) -> float:
    first = changes(kept, value_of(kept.large))
    return first + changes(kept, value_of(kept.other))


def writes_twice(kept: Kept) -> float:
    return changes(kept, value_of(kept.other)) + kept.large.a.a


def cleared(view: View) -> None:
    grid, n = view
    for k in range(n):
        grid[k, k] = 0.0


def clears(kept: Kept) -> None:
    cleared(View(kept.grid, 3))


def trace(grid: Array) -> float:
    return grid[0, 0] + grid[1, 1]


def traced(kept: Kept) -> float:
    kept.row[0] = 1.0
    kept.grid[0, 0] = 2.0
    return trace(kept.grid)


def line_of(kept: Kept, k: int) -> Array:
    line: Array = kept.grid[k]
    return line


def first_of(kept: Kept) -> float:
    return line_of(kept, 1)[0]


def test_loops_end_as_they_do_here():
    lines = body(halved)
    assert "while (x > 1.0 && n < 9) {" in lines
    assert "if (darko_modulo(n, 5) == 4) {" in lines
    assert "break;" in lines


def test_arrays_that_are_written_to_are_not_constant():
    shapes = {"shapes": ((3, 3), (4,))}
    assert head(filled, **shapes).endswith("test_translation_filled(double grid[3][3], double row[4])")
    lines = body(filled, **shapes)
    assert "grid[n_0][n_1] = 0.0;" in lines
    assert "for (int32_t k = 1; k < 3; ++k) {" in lines
    assert lines[lines.index("row[k] = 1.0;") + 1 :][:2] == ["grid[k][k] = -1.0;", "grid[k][0] -= 2.0 * row[k];"]


def test_what_changes_is_copied_and_what_stays_is_pointed_to():
    lines = body(taken_before_it_changes, design=KEPT)
    assert lines[:2] == ["const DarkoLarge before = kept->large;", "const DarkoLarge *other = &kept->other;"]
    assert lines[2:5] == ["DarkoLarge made_1 = *new;", "made_1.a = before.b;", "kept->large = made_1;"]
    assert "(DarkoKept *kept, const DarkoLarge *new)" in head(taken_before_it_changes, design=KEPT)


def test_an_argument_that_the_call_changes_is_passed_as_a_copy():
    lines = body(passes_what_changes, design=KEPT)
    assert lines[0] == "const DarkoLarge made_1 = kept->large;"
    assert "changes(kept, &made_1);" in lines[1]
    assert "changes(kept, &kept->other);" in lines[2]


def test_what_writes_and_what_reads_it_are_not_left_to_the_order_of_c():
    with pytest.raises(ExportError, match=r"the order of 'changes\(kept, .*\) and kept\.large\.a\.a'"):
        translated(writes_twice, design=KEPT)


def test_a_view_leads_to_the_arrays_themselves():
    text, program = translated(clears, design=KEPT)
    assert "(DarkoKept *kept)" in text
    assert "(DarkoView){kept->grid, 3}" in text
    assert "double (*grid)[3];" in "\n".join(program.types.declarations())


def test_rows_of_an_array_are_passed_as_constant_ones_by_a_cast():
    assert "test_translation_trace((const double (*)[3])kept->grid)" in translated(traced, design=KEPT)[0]


def test_a_row_of_an_array_may_be_given_back():
    text, program = translated(first_of, design=KEPT)
    assert "return test_translation_line_of(kept, 1)[0];" in text
    assert "static inline const double *" in program.instance(line_of).head


def powered(x: float) -> float:
    return x**2


def cosine(x: float) -> float:
    return math.cos(x)


def chained(x: float) -> bool:
    return 0.0 < x < 1.0


def listed(x: float) -> float:
    values = [x, x]
    return values[0]


def tried(x: float) -> float:
    assert x > 1.0
    return x


def truthy(x: float) -> bool:
    return not x


@pytest.mark.parametrize(
    ("function", "what"),
    [
        (powered, r"the operator of 'x \*\* 2'"),
        (cosine, "'math.cos'"),
        (chained, "the chain of comparisons '0.0 < x < 1.0'"),
        (listed, r"the expression '\[x, x\]'"),
        (tried, "the statement 'assert x > 1.0'"),
        (truthy, "the truth of x: it is no bool"),
        (stored_late, r"'row\[0\]', which what is stored before it may change"),
    ],
)
def test_what_is_not_known_is_refused_with_file_and_line(function, what):
    line = function.__code__.co_firstlineno + 1
    with pytest.raises(ExportError, match=rf"tests/sitl/export/test_translation.py:{line}: .* know {what}"):
        translated(function, shapes=((2,),))


def test_an_array_of_unknown_shape_is_refused():
    def first(table: Table) -> float:
        return table.rows[0]

    with pytest.raises(ExportError, match=r"Table\.rows is an array of unknown shape"):
        translated(first)
    assert "table->rows[0]" in translated(first, design=Table(np.zeros(9)))[0]


@pytest.mark.parametrize("value", [0.1, 1.0 / 3.0, -2.5e-8, 0.5, 1e300, 123456.75])
def test_a_literal_is_the_number_to_the_bit_with_the_decimal_beside(value):
    text = real_literal(value, single=False)
    number = text.split(" /*", maxsplit=1)[0]
    assert (float.fromhex(number) if "0x" in number else float(number)) == value
    assert repr(value) in text


def test_a_literal_of_single_precision_is_the_nearest():
    text = real_literal(0.1, single=True)
    assert float.fromhex(text.split("f /*", maxsplit=1)[0]) == float(np.float32(0.1))


def test_long_lines_are_broken_outside_comments():
    line = "    return f(" + ", ".join(f"0x1.8p-{i} /* a, b */" for i in range(12)) + ");"
    parts = wrapped_line(line).split("\n")
    assert len(parts) > 1
    assert all(part.count("/*") == part.count("*/") for part in parts)
    assert "".join(part.strip() + " " for part in parts).split() == line.split()


@pytest.mark.long
def test_functions_bear_their_docstrings_and_structs_their_units():
    texts = files().files
    assert (
        "/* Force f_r = m g e_3 + gamma(e_p, e_v) that the position loop wants, world [N]. */"
        in (texts["hover_zero_moment.h"])
    )
    assert "bool has_airspeed; /* whether there is a tube */" in texts["darko_types.h"]
    assert f".J1 = {(0.0067).hex()} /* 0.0067 */" in texts["darko_gains.h"]
