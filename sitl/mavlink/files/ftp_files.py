"""The files on offer over MAVLink FTP. They are not the disk's own tree: names are looked up, never joined to paths.

``@PARAM/param.pck``, ``@MISSION/{mission,fence,rally}.dat``, ``component_metadata/``, ``logs/``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from urllib.parse import parse_qsl

from protocol.dialect import mavlink
from protocol.engines.file_transfer import BytesFile, Entry, File, LogStore
from protocol.engines.table_values import Parameter
from protocol.plans.plan import MissionItem
from sitl.mavlink.files.component_metadata import FOLDER, default_values, metadata_files
from sitl.mavlink.files.parameter_pack import pack_parameters, pack_plan

__all__ = ["LOGS", "VehicleFiles"]

LOGS = "logs"
PLANS = {
    "mission.dat": mavlink.MAV_MISSION_TYPE_MISSION,
    "fence.dat": mavlink.MAV_MISSION_TYPE_FENCE,
    "rally.dat": mavlink.MAV_MISSION_TYPE_RALLY,
}

MakeContent = Callable[[Mapping[str, str]], bytes]  # from the query in a file's path


class VehicleFiles:
    """Files made from the vehicle's state when they are opened, and the logs of recorded flights.

    Args:
        parameters: Gives the parameter table with its present values.
        plan: Gives the items of a MAV_MISSION_TYPE.
        logs: The logs.
    """

    def __init__(
        self,
        parameters: Callable[[], Sequence[Parameter]],
        plan: Callable[[int], Sequence[MissionItem]],
        logs: LogStore,
    ) -> None:
        self._parameters, self._plan, self._logs = parameters, plan, logs
        self._made: dict[str, dict[str, MakeContent]] = {
            "@PARAM": {"param.pck": self._pack_parameters},
            "@MISSION": {name: self._plan_maker(kind) for name, kind in PLANS.items()},
            FOLDER: {name: _constant(data) for name, data in metadata_files().items()},
        }

    def entries(self, path: str) -> Sequence[Entry]:
        """The content of a folder.

        Raises:
            OSError: There is no such folder.
        """
        parts, _ = _split(path)
        if not parts:
            return [Entry(name, None) for name in (*self._made, LOGS)]
        folder, *rest = parts
        if not rest and folder == LOGS:
            return [Entry(log.name, log.size) for log in self._logs.logs()]
        if not rest and folder in self._made:
            return [Entry(name, len(make({}))) for name, make in self._made[folder].items()]
        self._require_no_file(parts)
        raise FileNotFoundError(path)

    def open(self, path: str) -> File:
        """A file as it is now.

        Raises:
            OSError: There is no such file.
        """
        parts, query = _split(path)
        if not parts or parts in ([LOGS], *([folder] for folder in self._made)):
            raise IsADirectoryError(path)
        if len(parts) == 2 and parts[0] == LOGS:
            return self._logs.open(parts[1])
        make = self._made.get(parts[0], {}).get(parts[1]) if len(parts) == 2 else None
        if make is None:
            raise FileNotFoundError(path)
        return BytesFile(make(query))

    def _require_no_file(self, parts: list[str]) -> None:
        """Raise NotADirectoryError if a path names a file, to tell it from a path that names nothing."""
        folder, name = parts[0], parts[1] if len(parts) == 2 else ""
        if name in self._made.get(folder, {}) or (folder == LOGS and name in {log.name for log in self._logs.logs()}):
            raise NotADirectoryError(name)

    def _pack_parameters(self, query: Mapping[str, str]) -> bytes:
        defaults = default_values() if query.get("withdefaults") == "1" else None
        return pack_parameters(
            self._parameters(), defaults, start=_count(query.get("start")), count=_count(query.get("count"))
        )

    def _plan_maker(self, kind: int) -> MakeContent:
        return lambda _query: pack_plan(self._plan(kind), kind)


def _constant(data: bytes) -> MakeContent:
    return lambda _query: data


def _split(path: str) -> tuple[list[str], dict[str, str]]:
    """Names and query of a path, with or without a leading slash."""
    names, _, query = path.partition("?")
    return [name for name in names.split("/") if name not in {"", "."}], dict(parse_qsl(query))


def _count(text: str | None) -> int:
    return int(text) if text is not None and text.isdecimal() else 0
