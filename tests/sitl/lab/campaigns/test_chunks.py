"""Chunks on disk: whole or not there, named by what they answer, and flown again where they are broken."""

import errno
import math
import os

import pytest

from sitl import SitlError
from sitl.lab.campaigns import chunks
from sitl.lab.campaigns.case_flights import FlownCase
from sitl.lab.campaigns.chunks import ChunkStore, chunk_bytes, chunk_name, results_of, write_durably
from tests.support.campaigns import SMALL, small

CASES = range(3)
ROWS = [FlownCase(number, "time", "", (0.1 + number, 1.0)) for number in CASES]


def test_results_come_back_to_the_bit():
    rows = [FlownCase(7, "diverged", 'a "word"\n', (math.pi, math.inf, -math.inf, 5e-324))]
    assert results_of(chunk_bytes(rows)) == rows
    assert math.isnan(results_of(chunk_bytes([FlownCase(1, "error", "", (math.nan,))]))[0].measures[0])


def test_a_name_is_that_of_specification_cases_and_code(monkeypatch):
    name = chunk_name(small(), CASES)
    assert chunk_name(small(cases=99, worst=["reached"]), CASES) == name
    others = [
        chunk_name(small(), range(4)),
        chunk_name(small(seed=2), CASES),
        chunk_name(small(SMALL.replace("0.2", "0.3")), CASES),
        chunk_name(small(SMALL.replace("relative = 0.1", "relative = 0.2")), CASES),
        chunk_name(small(SMALL.replace('"truth"', '"truth"\nairframe = "nominal"')), CASES),
    ]
    monkeypatch.setattr(chunks, "code_version", lambda: "other")
    assert len({name, *others, chunk_name(small(), CASES)}) == 7


@pytest.mark.parametrize(
    "broken", [b"", b"[0,", b"\xff", chunk_bytes(ROWS[:2]), chunk_bytes(ROWS).replace(b",1.0", b"")]
)
def test_a_broken_chunk_is_none(tmp_path, broken):
    store = ChunkStore(tmp_path, small())
    assert store.read(CASES) is None
    store.write(CASES, chunk_bytes(ROWS))
    assert store.read(CASES) == ROWS
    store.path(CASES).write_bytes(broken)
    assert store.read(CASES) is None


@pytest.mark.parametrize("step", ["fsync", "chmod"])
def test_a_full_disk_leaves_nothing_half_written(tmp_path, monkeypatch, step):
    def full(*_, **__):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, step, full)
    with pytest.raises(SitlError, match="x: cannot be written: No space left on device; what is written stays"):
        write_durably(tmp_path / "x", b"data")
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_made_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SitlError, match="file: cannot be made"):
        ChunkStore(tmp_path / "file", small())
