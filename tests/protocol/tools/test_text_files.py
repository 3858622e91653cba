"""Texts of any editor."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.tools.files import decode_text

TEXTS = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0\ufeff"))


@given(TEXTS, st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-32"]))
def test_a_text_is_read_in_every_encoding_that_says_which_it_is(text, encoding):
    assert decode_text(text.encode(encoding)) == text


@given(TEXTS)
def test_a_text_is_read_in_either_byte_order(text):
    for encoding in ("utf-16-le", "utf-16-be", "utf-32-le", "utf-32-be"):
        assert decode_text(f"\ufeff{text}".encode(encoding)) == text


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ("A 1\n".encode("utf-16-le"), "UTF-16 without a byte order mark"),
        ("A 1\nB 2 # é\n".encode("latin-1"), "line 2: byte 0xe9 is not UTF-8"),
        (b"\xff\xfeA", "its byte order mark says UTF-16, but it is not: truncated data"),
    ],
)
def test_what_is_no_such_text_is_named(data, said):
    with pytest.raises(UnicodeError, match=said):
        decode_text(data)


def test_bytes_outside_utf_8_may_be_replaced():
    assert decode_text("A 1 # é".encode("latin-1"), "replace") == "A 1 # \ufffd"
