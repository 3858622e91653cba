"""Signatures and key files."""

import hashlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.errors import FileError, LocalProtocolError
from protocol.wire.codec import Codec
from protocol.wire.signing import (
    NO_KEY,
    Keyring,
    Signature,
    is_secret,
    is_signed,
    load_key,
    sign_frame,
    signature_of,
    timestamp_at,
    verify,
)
from tests.support.links.link import frame
from tests.support.links.signed_frames import KEY, T, arm, heartbeat, setup, signed


def test_a_signature_is_the_first_48_bits_of_the_digest_the_specification_names():
    data = signed(heartbeat(), timestamp=0x0102_0304_0506, link=7)
    assert data[2] == 1
    assert data[-13:-6] == bytes([7, 6, 5, 4, 3, 2, 1])
    assert data[-6:] == hashlib.sha256(KEY + data[:-6]).digest()[:6]
    assert signature_of(data) == (7, 0x0102_0304_0506)


@given(position=st.integers(0, 33), bit=st.integers(0, 7))
def test_a_changed_bit_of_a_signed_frame_fails_verification(position, bit):
    data = bytearray(signed(heartbeat()))
    data[position] ^= 1 << bit
    assert not verify(data, KEY)


def test_only_unsigned_version_2_frames_are_signed():
    with pytest.raises(LocalProtocolError):
        sign_frame(signed(heartbeat()), KEY, Signature(0, T))
    with pytest.raises(LocalProtocolError):
        sign_frame(b"\xfe" + frame(heartbeat())[1:], KEY, Signature(0, T))


def test_timestamps_count_from_2015():
    assert timestamp_at(1_420_070_400.0) == 0
    assert timestamp_at(1_420_070_401.5) == 150_000
    assert timestamp_at(0.0) == 0
    assert timestamp_at(1e12) == 0xFFFF_FFFF_FFFF


def test_a_frame_that_is_no_longer_than_a_signature_carries_none():
    assert is_signed(b"\xfd\x00\x01".ljust(14, b"\0"))
    assert not is_signed(b"\xfd\x00\x01".ljust(13, b"\0"))


def test_a_frame_with_a_key_is_secret():
    assert is_secret(frame(setup(KEY)))
    assert is_secret(signed(setup(KEY)))
    assert not is_secret(frame(arm()))


def test_messages_of_other_senders_are_never_signed():
    ours = Codec(1, 1, Keyring({None: KEY}, timestamp=T).link(None))
    (theirs,) = Codec(255, 190).decode(frame(arm(), 42))
    with pytest.raises(LocalProtocolError, match="forward it without signing"):
        ours.encode(theirs)
    assert ours.statistics.sent == 0


@pytest.mark.parametrize("content", [KEY.hex().encode(), b" " + KEY.hex().upper().encode() + b"\r\n", KEY])
def test_a_key_file_holds_digits_or_bytes(tmp_path, content):
    (tmp_path / "key").write_bytes(content)
    assert load_key(str(tmp_path / "key")) == KEY


def test_a_key_may_be_given_as_digits():
    assert load_key(KEY.hex()) == KEY


@pytest.mark.parametrize("content", [b"", b"abc", KEY.hex().encode()[:-1], KEY + b"x", b"0" * 64, NO_KEY, b"z" * 64])
def test_an_invalid_key_is_refused_in_one_line_without_quoting_it(tmp_path, content):
    (tmp_path / "key").write_bytes(content)
    with pytest.raises(FileError, match="signing key") as caught:
        load_key(str(tmp_path / "key"))
    assert "\n" not in str(caught.value)
    assert len(content) < 3 or content.decode("latin-1") not in str(caught.value)


@pytest.mark.parametrize("text", ["", "nowhere/key", "0" * 64, KEY.hex()[:-1], "\0", "."])
def test_a_missing_key_file_is_refused_in_one_line(text):
    with pytest.raises(FileError, match="signing key") as caught:
        load_key(text)
    assert "\n" not in str(caught.value)
    assert KEY.hex()[:-1] not in str(caught.value)


@pytest.mark.parametrize(("length", "shown"), [(43, "n" * 43), (44, "n" * 40 + "...")])
def test_a_long_name_of_a_key_file_is_shortened(length, shown):
    with pytest.raises(FileError, match=f"nor a readable file: {shown}: No such file"):
        load_key("n" * length)


@pytest.mark.parametrize("size", [1, 31, 33, 64])
def test_other_sizes_than_32_bytes_are_no_key(tmp_path, size):
    (tmp_path / "key").write_bytes(b"\xff" * size)
    with pytest.raises(FileError, match="neither 64 hexadecimal digits nor 32 bytes"):
        load_key(str(tmp_path / "key"))
