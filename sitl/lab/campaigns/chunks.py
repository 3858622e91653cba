"""Chunks of a campaign on disk: named by what they hold the answer to, whole or not there, whoever wrote them.

A chunk's name is the hash of specification, cases and code version. It is written beside its place, brought to the
disk and renamed: a process that ends at any moment leaves whole chunks, and the next one flies what is missing.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import math
import os
from collections.abc import Iterable, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import NamedTemporaryFile

import protocol
import sitl
from sitl import SitlError
from sitl.lab.campaigns.case_flights import FlownCase, fly_case
from sitl.lab.campaigns.specification import Specification, draw

COMPUTES = ("numpy", "scipy", "numba", "llvmlite")  # whose versions may change the last bits of a flight
SOURCE_SUFFIXES = {".py", ".toml", ".xml", ".json", ".c", ".h"}
NAME_LENGTH = 32  # of a chunk [hexadecimal digits]
UNFINISHED = ".unfinished"  # ends the names of files that are being written


@cache
def code_version() -> str:
    """Hash of the sources that fly, and of the libraries' versions."""
    digest = hashlib.sha256()
    for package in (protocol, sitl):
        root = Path(str(package.__file__)).parent
        for path in sorted(path for path in root.rglob("*") if path.suffix in SOURCE_SUFFIXES):
            digest.update(f"{package.__name__}/{path.relative_to(root).as_posix()}\0".encode() + path.read_bytes())
    digest.update("".join(f"{name} {importlib.metadata.version(name)}\n" for name in COMPUTES).encode())
    return digest.hexdigest()


def chunk_name(specification: Specification, cases: range) -> str:
    """The name of a chunk: so many cases of a campaign by the code that is installed."""
    told = f"{specification.identity}\0{cases.start}:{cases.stop}\0{specification.cells}\0{code_version()}"
    return hashlib.sha256(told.encode()).hexdigest()[:NAME_LENGTH]


def fly_chunk(specification: Specification, cases: range) -> bytes:
    """Fly cases one after the other; gives the chunk as it is written."""
    return chunk_bytes(fly_case(specification, draw(specification, number)) for number in cases)


def chunk_bytes(flown: Iterable[FlownCase]) -> bytes:
    """Results as lines of JSON; a number that JSON does not have is a text."""
    rows = [[f.number, f.end, f.error, [v if math.isfinite(v) else str(v) for v in f.measures]] for f in flown]
    return "".join(json.dumps(row, separators=(",", ":")) + "\n" for row in rows).encode()


def results_of(data: bytes) -> list[FlownCase]:
    """The results of a chunk.

    Raises:
        ValueError: It is none.
    """
    rows = [json.loads(line) for line in data.decode().splitlines()]
    return [FlownCase(int(n), str(end), str(error), tuple(map(float, values))) for n, end, error, values in rows]


class ChunkStore:
    """The folder of a campaign.

    Args:
        folder: It is made if it is missing.
        specification: The campaign.

    Raises:
        SitlError: The folder cannot be made.
    """

    def __init__(self, folder: Path, specification: Specification) -> None:
        self.folder, self._specification = folder, specification
        self._chunks = folder / "chunks"
        try:
            self._chunks.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise SitlError(f"{folder}: cannot be made: {error.strerror}") from None

    def path(self, cases: range) -> Path:
        """The place of a chunk."""
        return self._chunks / f"{chunk_name(self._specification, cases)}.jsonl"

    def read(self, cases: range) -> list[FlownCase] | None:
        """The results of a chunk; None if it is not there, or does not hold them."""
        try:
            found = results_of(self.path(cases).read_bytes())
        except (OSError, ValueError, TypeError):
            return None
        is_whole = [flown.number for flown in found] == list(cases)
        widths = {len(flown.measures) for flown in found}
        return found if is_whole and widths == {len(self._specification.measures)} else None

    def write(self, cases: range, data: bytes) -> None:
        """Keep a chunk.

        Raises:
            SitlError: It cannot be written; nothing is left behind.
        """
        write_durably(self.path(cases), data)

    def missing(self, chunks: Sequence[range]) -> list[range]:
        """Those chunks that are not there."""
        return [cases for cases in chunks if self.read(cases) is None]


def write_durably(path: Path, data: bytes) -> None:
    """Write a file that is whole or not there, on the disk before its name is; several processes may write the same.

    Raises:
        SitlError: It cannot be written; nothing is left behind.
    """
    staged: Path | None = None
    try:
        with NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", suffix=UNFINISHED, delete=False) as file:
            staged = Path(file.name)
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        staged.chmod(0o644)
        staged.replace(path)
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
    except OSError as error:
        if staged is not None:
            with suppress(OSError):
                staged.unlink(missing_ok=True)
        raise SitlError(f"{path}: cannot be written: {error.strerror}; what is written stays") from None
