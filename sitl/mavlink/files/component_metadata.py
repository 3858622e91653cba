"""Files that describe the vehicle to ground stations, which build their parameter pages from them.

https://mavlink.io/en/services/component_metadata.html; the files conform to general.schema.json and
parameter.schema.json of MAVLink's definitions.
"""

from __future__ import annotations

import json
import lzma
from functools import cache
from importlib.metadata import version
from typing import Any, NamedTuple

from protocol.engines.file_transfer import crc32
from sitl.vehicle.parameters import PARAMETERS, BoundParameter, Configuration

__all__ = ["FOLDER", "GENERAL_URI", "default_values", "general_crc", "metadata_files"]

FOLDER = "component_metadata"
GENERAL, PARAMETER = "general.json.xz", "parameter.json.xz"
GENERAL_URI = f"mftp:///{FOLDER}/{GENERAL}"
PARAMETER_METADATA = 1  # COMP_METADATA_TYPE_PARAMETER, newer than the generator's definitions


class ParameterPage(NamedTuple):
    """Group and page of a parameter in ground stations."""

    group: str
    category: str


PAGES = {  # by the field of Configuration
    "settings": ParameterPage("Flight", "Standard"),
    "tuning": ParameterPage("Hybrid controller", "Developer"),
    "world": ParameterPage("Simulated world", "Developer"),
}


@cache
def default_values() -> dict[str, float]:
    """The parameters of a vehicle with an empty state folder, by name."""
    return {name: parameter.value_in(Configuration()) for name, parameter in PARAMETERS.items()}


@cache
def metadata_files() -> dict[str, bytes]:
    """The files of ``FOLDER`` by name, each as JSON and compressed; the same on every start of one version."""
    parameters = _json({"version": 3, "parameters": [_described(parameter) for parameter in PARAMETERS.values()]})
    compressed = _compressed(parameters)
    general = _json(
        {
            "version": 1,
            "vendorName": "DarkO",
            "modelName": "DarkO tail-sitter (simulated)",
            "firmwareVersion": version("darko"),
            "metadataTypes": [
                {"type": PARAMETER_METADATA, "uri": f"mftp:///{FOLDER}/{PARAMETER}", "fileCrc": crc32(compressed)}
            ],
        }
    )
    plain = {GENERAL.removesuffix(".xz"): general, PARAMETER.removesuffix(".xz"): parameters}
    return plain | {GENERAL: _compressed(general), PARAMETER: compressed}


def general_crc() -> int:
    """Checksum of the general file, by which clients tell whether their copy is up to date."""
    return crc32(metadata_files()[GENERAL])


def _described(parameter: BoundParameter) -> dict[str, Any]:
    metadata, page = parameter.metadata, PAGES[parameter.group]
    units = {"units": metadata.unit} if metadata.unit else {}
    values = {"values": [{"value": number, "description": name} for number, name in metadata.values]}
    return {
        "name": metadata.name,
        "type": "Int32" if parameter.is_integer else "Float",
        "shortDesc": metadata.text,
        **units,
        **(values if metadata.values else {}),
        "min": metadata.bounds[0],
        "max": metadata.bounds[1],
        "default": default_values()[metadata.name],
        "group": page.group,
        "category": page.category,
    }


def _json(content: dict[str, Any]) -> bytes:
    return json.dumps(content, separators=(",", ":"), allow_nan=False).encode()


def _compressed(data: bytes) -> bytes:
    return lzma.compress(data, check=lzma.CHECK_CRC32)  # the only check that small decoders know
