"""Generate ``protocol/dialect/mavlink.py`` from ``darko.xml`` when the package is built.

The dialect includes MAVLink's own ``common.xml``, which pymavlink ships beside its generated modules, so
the definitions and the generator are always of one version. Run by hand: ``python scripts/build_dialect.py``.
"""

from __future__ import annotations

import contextlib
import io
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# Extension fields newer than the generator's definitions, by message; extensions change no CRC.
EXTENSIONS = {
    "MISSION_CURRENT": ("mission_id", "fence_id", "rally_points_id"),
    "MISSION_COUNT": ("opaque_id",),
    "MISSION_ACK": ("opaque_id",),
}

ROOT = Path(__file__).resolve().parent.parent
DIALECT = ROOT / "protocol" / "dialect"


def generate(source: Path, target: Path) -> None:
    """Write the codec module for one dialect file.

    Args:
        source: The dialect, an XML file that includes ``common.xml``.
        target: The Python module to write; replaced whole or not at all.

    Raises:
        RuntimeError: If the generator refuses the dialect; the message is its own output.
    """
    from pymavlink import dialects  # noqa: PLC0415 - only the build environment has to have it
    from pymavlink.generator import mavgen  # noqa: PLC0415

    definitions = Path(next(iter(dialects.__path__))) / "v20"
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        for name in ("common.xml", "standard.xml", "minimal.xml"):
            shutil.copy(definitions / name, work / name)
        extend(work / "common.xml")
        shutil.copy(source, work / source.name)
        options = mavgen.Opts(str(work / target.name), wire_protocol="2.0", language="Python3", validate=True)
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            done = mavgen.mavgen(options, [str(work / source.name)])
        if not done:
            raise RuntimeError(f"{source}: {said.getvalue().strip()}")
        staged = target.with_suffix(".new")
        shutil.copy(work / target.name, staged)
        staged.replace(target)


def extend(definitions: Path) -> None:
    """Add the newer extension fields to a copy of ``common.xml``, where it lacks them."""
    text = definitions.read_text(encoding="utf-8")
    for message, names in EXTENSIONS.items():
        start = text.index(f'name="{message}">')
        end = text.index("</message>", start)
        missing = [name for name in names if f'name="{name}"' not in text[start:end]]
        fields = "".join(f'  <field type="uint32_t" name="{name}">Id of a plan.</field>\n    ' for name in missing)
        text = text[:end] + fields + text[end:]
    definitions.write_text(text, encoding="utf-8")


class DialectBuildHook(BuildHookInterface):  # type: ignore[misc]
    """Hatchling's hook: the generated module is a build artefact, never committed."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002
        """Generate the codec before the files of the wheel are collected."""
        generate(DIALECT / "darko.xml", DIALECT / "mavlink.py")


if __name__ == "__main__":
    generate(DIALECT / "darko.xml", DIALECT / "mavlink.py")
    sys.exit(0)
