"""What the vehicle says about itself in files: the component metadata that ground stations build their pages from.

https://mavlink.io/en/services/component_metadata.html; the files conform to general.schema.json and
parameter.schema.json of MAVLink's definitions.
"""

from __future__ import annotations

import json
import lzma
from functools import cache
from importlib.metadata import version
from typing import Any

from protocol.engines.ftp import crc32
from sitl.autopilot.settings import Settings
from sitl.parameters import TABLE, Bindings, Entry, Surroundings
from sitl.simulation.tuning import Tuning

__all__ = ["FOLDER", "GENERAL_URI", "default_values", "general_crc", "metadata_files"]

FOLDER = "component_metadata"
GENERAL, PARAMETERS = "general.json.xz", "parameter.json.xz"
GENERAL_URI = f"mftp:///{FOLDER}/{GENERAL}"
PARAMETER_METADATA = 1  # COMP_METADATA_TYPE_PARAMETER, newer than the generator's definitions
GROUPS = {"settings": "Flight", "tuning": "Hybrid controller", "world": "Simulated world"}


@cache
def default_values() -> dict[str, float]:
    """The parameters of a vehicle that remembers nothing, by name."""
    defaults = Bindings(Settings(), Tuning(), Surroundings())
    return {entry.name: defaults.value(entry.name) for entry in TABLE}


@cache
def metadata_files() -> dict[str, bytes]:
    """The files of ``FOLDER`` by name, each as JSON and compressed; the same on every start of one version."""
    parameters = _json({"version": 3, "parameters": [_parameter(entry) for entry in TABLE]})
    compressed = _compressed(parameters)
    general = _json(
        {
            "version": 1,
            "vendorName": "DarkO",
            "modelName": "DarkO tail-sitter (simulated)",
            "firmwareVersion": version("darko"),
            "metadataTypes": [
                {"type": PARAMETER_METADATA, "uri": f"mftp:///{FOLDER}/{PARAMETERS}", "fileCrc": crc32(compressed)}
            ],
        }
    )
    plain = {GENERAL.removesuffix(".xz"): general, PARAMETERS.removesuffix(".xz"): parameters}
    return plain | {GENERAL: _compressed(general), PARAMETERS: compressed}


def general_crc() -> int:
    """Checksum of the general file, by which clients know whether they have it."""
    return crc32(metadata_files()[GENERAL])


def _parameter(entry: Entry) -> dict[str, Any]:
    told: dict[str, Any] = {
        "name": entry.name,
        "type": "Int32" if entry.integer else "Float",
        "shortDesc": entry.description,
        "units": entry.unit,
        "min": entry.minimum,
        "max": entry.maximum,
        "default": default_values()[entry.name],
        "group": GROUPS.get(entry.group, entry.group),
        "category": "Standard" if entry.group == "settings" else "Developer",
    }
    return told if entry.unit else {key: value for key, value in told.items() if key != "units"}


def _json(content: dict[str, Any]) -> bytes:
    return json.dumps(content, separators=(",", ":"), allow_nan=False).encode()


def _compressed(data: bytes) -> bytes:
    return lzma.compress(data, check=lzma.CHECK_CRC32)  # the only check that small decoders know
