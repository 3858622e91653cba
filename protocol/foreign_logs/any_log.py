"""Opens a log of any kind: the content says which it is, not the name."""

from __future__ import annotations

from pathlib import Path

from protocol.errors import FileError
from protocol.foreign_logs.log_tables import MAX_FOREIGN_SIZE, ForeignFlight
from protocol.foreign_logs.message_tables import as_telemetry_log
from protocol.foreign_logs.paparazzi_pair import is_paparazzi_data, is_paparazzi_log, read_paparazzi
from protocol.tlog import LogOrigin, TlogReader, read_tlog

_ULOG_MAGIC = b"ULog\x01\x12\x35"
_DATAFLASH_MAGIC = b"\xa3\x95\x80"  # the head of FMT, which is the first record
_BEGINNING = 4096  # that tells the kind [bytes]


def read_log(path: Path | str) -> TlogReader:
    """A telemetry log, or what a log of another autopilot tells as one: PX4's ULog, DataFlash, Paparazzi's pair.

    Raises:
        FileError: The file cannot be read, is empty, is no log, or tells of no flight.
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            beginning, size = file.read(_BEGINNING), path.stat().st_size
            foreign = _is_foreign(beginning)
            if foreign and size > MAX_FOREIGN_SIZE:
                raise FileError(f"{path}: larger than {MAX_FOREIGN_SIZE >> 20} MiB")
            data = beginning + file.read() if foreign else b""
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}") from error
    return _converted(_read(path, data), path) if foreign else read_tlog(path)


def _is_foreign(beginning: bytes) -> bool:
    binary = beginning.startswith((_ULOG_MAGIC, _DATAFLASH_MAGIC))
    return binary or is_paparazzi_log(beginning) or is_paparazzi_data(beginning)


def _read(path: Path, data: bytes) -> ForeignFlight:
    # The libraries take a fifth of a second to load: they are loaded for a log that needs them.
    if data.startswith(_ULOG_MAGIC):
        from protocol.foreign_logs.px4_ulog import read_ulog  # noqa: PLC0415

        return read_ulog(data, str(path))
    if data.startswith(_DATAFLASH_MAGIC):
        from protocol.foreign_logs.ardupilot_dataflash import read_dataflash  # noqa: PLC0415

        return read_dataflash(data, str(path))
    return read_paparazzi(path, data)


def _converted(flight: ForeignFlight, path: Path) -> TlogReader:
    tables = [table for vehicle in flight.vehicles for table in vehicle.tables()]
    data = as_telemetry_log(tables, flight.start_usec)
    if not data:
        first = f", damaged at byte {flight.damage[0].offset}: {flight.damage[0].what}" if flight.damage else ""
        raise FileError(f"{path}: a {flight.kind} that tells nothing of a flight in its {flight.size} bytes{first}")
    return TlogReader(data, LogOrigin(flight.kind, flight.size, tuple(flight.damage)))
