"""Files: text with any byte-order mark, and writing that leaves a whole file or none."""

from __future__ import annotations

import codecs
import os
from contextlib import suppress
from pathlib import Path

from protocol.errors import FileError

__all__ = [
    "decode_text",
    "wide_encoding",
    "write_atomically",
]

_WIDE = (  # the longer marks first: that of UTF-16 begins that of UTF-32
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


def wide_encoding(data: bytes) -> str | None:
    """The encoding that a byte order mark at the beginning names, if it is not UTF-8's."""
    return next((name for mark, name in _WIDE if data.startswith(mark)), None)


def decode_text(data: bytes, errors: str = "strict") -> str:
    """The text, without its byte order mark.

    Args:
        data: The whole file.
        errors: As of ``bytes.decode``, for what is no UTF-8.

    Raises:
        UnicodeError: It is not a text in one of the encodings; the message names the line.
    """
    encoding = wide_encoding(data)
    if encoding is not None:
        try:
            return data.decode(encoding)
        except UnicodeDecodeError as error:
            raise UnicodeError(f"its byte order mark says {encoding.upper()}, but it is not: {error.reason}") from None
    if b"\0" in data:
        raise UnicodeError("it holds zero bytes: it is no text, or one in UTF-16 without a byte order mark")
    try:
        return data.decode("utf-8-sig", errors)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise UnicodeError(f"line {line}: byte {data[error.start]:#04x} is not UTF-8") from None


def write_atomically(path: Path, data: bytes, *, mode: int = 0o666) -> None:
    """Write a file; an old one stays until the new one is complete and on the disk.

    Args:
        path: The file.
        data: Its whole content.
        mode: Its permissions, less the process's umask.

    Raises:
        FileError: The file cannot be written; nothing is left behind.
    """
    staged = path.with_name(f".{path.name}.new")
    try:
        staged.unlink(missing_ok=True)  # a leftover of a crash may have other permissions
        with os.fdopen(os.open(staged, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        staged.replace(path)
    except OSError as error:
        with suppress(OSError):
            staged.unlink(missing_ok=True)
        raise FileError(f"{path}: cannot be written: {error.strerror}") from error
