"""Changes that mutation testing makes to a module, and code that it leaves alone."""

import pytest

from scripts.mutation.mutants import mutants_of


def changes(text):
    return [(mutant.before, mutant.after) for mutant in mutants_of("module.py", text.encode())]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a < b", {"a <= b", "a >= b"}),
        ("a >= b", {"a > b", "a < b"}),
        ("a == b", {"a != b"}),
        ("a is b", {"a is not b"}),
        ("a not in b", {"a in b"}),
        ("a < b <= c", {"a <= b <= c", "a >= b <= c", "a < b < c", "a < b > c"}),
        ("a + b", {"a - b"}),
        ("a / b", {"a * b"}),
        ("a % b", {"a * b"}),
        ("a << b", {"a >> b"}),
        ("a & b", {"a | b"}),
        ("a and b", {"a or b"}),
        ("not a", {"a"}),
        ("-a", {"a"}),
        ("True", {"False"}),
        ("7", {"8"}),
        ("0.25", {"1.25"}),
        ("5_000_000", {"10000000"}),
        ("9.81", {"19.62"}),
        ("b if a else c", {"not (a)"}),
    ],
)
def test_what_an_expression_becomes(text, expected):
    assert {after for _, after in changes(text)} == expected


@pytest.mark.parametrize(
    "text",
    [
        '"""Text of 3 < 4."""',
        "x: Literal[3]",
        "def f(x: Literal[3]) -> Literal[4]: ...",
        "@lru_cache(maxsize=3)\ndef f(): ...",
        'raise ValueError(f"more than {3}")',
        'f"{a + 3}"',
        '"a" + b',
        '"%d" % b',
        "isinstance(a, Name | Other)",
        "Names = Name | None",
        '__all__ = ["a"]',
        "call()",
    ],
)
def test_what_is_for_people_or_for_types_stays_as_it_is(text):
    assert changes(text) == []


def test_a_condition_that_is_no_operator_itself_is_negated():
    assert changes("if a: ...") == [("a", "not (a)")]
    assert changes("while call(): ...") == [("call()", "not (call())")]
    assert changes("[a for a in b if a.c]") == [("a.c", "not (a.c)")]
    assert changes("if a < b: ...") == [("a < b", "a <= b"), ("a < b", "a >= b")]


def test_a_change_is_made_where_it_was_found_and_keeps_to_itself():
    source = b"# \xc2\xb5s\nclass C:\n    def f(self):\n        return 2 * (a\n            + b) ** 2\n"
    found = {mutant.after: mutant for mutant in mutants_of("module.py", source)}
    sum_ = found["a - b"]
    assert (sum_.file, sum_.line, sum_.function) == ("module.py", 4, "C.f")
    assert str(sum_) == "module.py:4  a + b  ->  a - b"
    assert sum_.applied(source) == b"# \xc2\xb5s\nclass C:\n    def f(self):\n        return 2 * ((a - b)) ** 2\n"
    assert found["(a + b) * 2"].applied(source).endswith(b"return 2 * ((a + b) * 2)\n")


def test_functions_within_functions_count_as_the_outer_one_and_defaults_as_the_module():
    found = mutants_of("module.py", b"x = 1\ndef f(y):\n    def g():\n        return 2\n    return lambda: 3\n")
    assert [(mutant.function, mutant.before) for mutant in found] == [("", "1"), ("f", "2"), ("f", "3")]


@pytest.mark.parametrize("decorator", ["cache", "functools.cache", "lru_cache(maxsize=8)"])
def test_what_is_computed_once_for_all_callers_counts_as_the_module(decorator):
    found = mutants_of("module.py", f"@{decorator}\ndef f(y):\n    def g():\n        return 2\n    return 3\n".encode())
    assert [(mutant.function, mutant.before) for mutant in found] == [("", "2"), ("", "3")]
    (other,) = mutants_of("module.py", b"@cached_by_name\ndef f(y):\n    return 3\n")
    assert other.function == "f"
