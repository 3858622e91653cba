"""Descriptions of our own vehicle's parameters, kept on disk: a recording has only their numbers."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from pathlib import Path

from darko_gcs.state.parameter_metadata import ParameterMetadata
from darko_gcs.station.parameter_metadata_client import read_parameter_file
from protocol.errors import FileError
from protocol.tools.files import write_atomically


class KnownParameters:
    """Parameters that this project's vehicle told last, as it sent them.

    Args:
        file: Where it is kept.
    """

    def __init__(self, file: Path) -> None:
        self._file = file

    def keep(self, data: bytes) -> None:
        """Keep a parameter file. A disk that fails costs the names in recordings, nothing else."""
        with contextlib.suppress(FileError, OSError):
            self._file.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(self._file, data)

    def load(self) -> Mapping[str, ParameterMetadata]:
        """By parameter name; empty if nothing is kept, or it cannot be read."""
        try:
            return read_parameter_file(self._file.read_bytes())
        except (FileError, OSError):
            return {}
